// A tile's bricks by view depth: what the slab method does, and what a curved lattice needs, whose
// samples no order of indexes puts front to back. Bricks are made ready when the sweep reaches them
// and forgotten once it has passed them.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/base/aligned_vector.hpp"
#include "server/base/cancel.hpp"
#include "server/engine/bins.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine {

// A kernel by its place in depth.
struct DepthEntry {
  float depth = 0;
  std::int32_t slot = 0;
  std::int32_t stop = 0;
};

// Splats that have been reached and not yet passed: records in memory that is used again, and for
// each of the next slabs a list of those that wait for it, in order of arrival.
struct WaitingSplats {
  static constexpr std::size_t slabs = 256;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  std::vector<kernels::SplatRecord> records;
  std::vector<std::uint32_t> free;
  std::vector<std::uint32_t> behind;       // of each record, who arrived after it
  std::array<std::uint32_t, slabs> first;  // by slab, modulo
  std::array<std::uint32_t, slabs> last;
  std::size_t count = 0;
};

// Hits that wait for the same slab, and where more of them are.
struct HitChunk {
  static constexpr std::uint32_t size = 63;

  std::uint32_t count;
  std::uint32_t behind;
  kernels::Hit hits[size];
};

// The same for lines, which wait block by block. A line's record is kept while it has hits that
// wait.
struct WaitingLines {
  static constexpr std::size_t slabs = 32;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  std::vector<kernels::RibbonRecord> records;
  std::vector<std::uint32_t> free;
  std::vector<std::uint32_t> waiting;  // of each record, how many hits
  std::vector<HitChunk> chunks;
  std::vector<std::uint32_t> free_chunks;
  std::array<std::uint32_t, slabs> first;  // by slab, modulo
  std::array<std::uint32_t, slabs> last;
  std::size_t count = 0;  // hits
};

// A worker's own memory, used for one tile after the other.
struct SweepSpace {
  // Curved lattices: bricks as they were made ready.
  std::vector<std::unique_ptr<kernels::Prepared>> slots;
  std::vector<std::int32_t> free;
  std::vector<DepthEntry> active;  // a brick: its last depth and its slot
  std::vector<DepthEntry> order;
  std::vector<DepthEntry> spare;  // for sorting
  // Slabs.
  std::unique_ptr<kernels::Prepared> prepared;
  WaitingSplats splats;
  WaitingLines lines;
  std::vector<std::uint32_t> here;          // splats in the slab at hand
  AlignedVector<float> gathered;            // by slab, modulo
  std::vector<kernels::Hit> listed;         // of one brick
  std::vector<kernels::Hit> hits;           // in the slab at hand
  std::vector<kernels::MetLine> met;        // the same by block
  std::vector<kernels::MetLine> spare_met;  // for sorting
};

// Calls visit(member) for the vectors that grow with what a tile holds, member(space) each.
template <class Visit>
void each_vector(const Visit& visit) {
  visit([](SweepSpace & s) -> auto& { return s.slots; });
  visit([](SweepSpace & s) -> auto& { return s.free; });
  visit([](SweepSpace & s) -> auto& { return s.active; });
  visit([](SweepSpace & s) -> auto& { return s.order; });
  visit([](SweepSpace & s) -> auto& { return s.spare; });
  visit([](SweepSpace & s) -> auto& { return s.splats.records; });
  visit([](SweepSpace & s) -> auto& { return s.splats.free; });
  visit([](SweepSpace & s) -> auto& { return s.splats.behind; });
  visit([](SweepSpace & s) -> auto& { return s.lines.records; });
  visit([](SweepSpace & s) -> auto& { return s.lines.free; });
  visit([](SweepSpace & s) -> auto& { return s.lines.waiting; });
  visit([](SweepSpace & s) -> auto& { return s.lines.chunks; });
  visit([](SweepSpace & s) -> auto& { return s.lines.free_chunks; });
  visit([](SweepSpace & s) -> auto& { return s.here; });
  visit([](SweepSpace & s) -> auto& { return s.gathered; });
  visit([](SweepSpace & s) -> auto& { return s.listed; });
  visit([](SweepSpace & s) -> auto& { return s.hits; });
  visit([](SweepSpace & s) -> auto& { return s.met; });
  visit([](SweepSpace & s) -> auto& { return s.spare_met; });
}

// Between two checks of whether the tile is done or cancelled.
constexpr std::int64_t slabs_between_checks = 4;

// True if every block of the tile that the brick may touch lets no light through any more.
bool all_closed(const kernels::Tile& tile, const kernels::Brick& brick);

// Draws tile `index`; true if it ended early because it had become opaque. Cancelled, it returns
// early and the tile is worthless. The bricks of the tile are sorted by their first depth.
bool sweep_tile(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                const CancelToken& cancel, std::size_t index, SweepSpace& space,
                kernels::Tile& tile);

// The same for the slab method.
bool sweep_slabs(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                 const CancelToken& cancel, std::size_t index, SweepSpace& space,
                 kernels::Tile& tile);

}  // namespace windsplat::engine
