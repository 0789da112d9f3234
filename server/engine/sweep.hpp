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

// What of splats or lines has been reached and not yet passed: records in memory that is used
// again, and for each of the next slabs a list of those that wait for it, in order of arrival.
template <class Record>
struct Reached {
  static constexpr std::size_t slabs = 256;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  std::vector<Record> records;
  std::vector<std::uint32_t> free;
  std::vector<std::uint32_t> behind;       // of each record, who arrived after it
  std::array<std::uint32_t, slabs> first;  // by slab, modulo
  std::array<std::uint32_t, slabs> last;
  std::size_t count = 0;
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
  Reached<kernels::SplatRecord> splats;
  Reached<kernels::RibbonRecord> ribbons;
  std::vector<std::uint32_t> here;  // of one kind, in the slab at hand
  std::vector<std::uint32_t> lines;
  AlignedVector<float> gathered;
  std::vector<kernels::Hit> hits;    // as listed
  std::vector<kernels::Hit> sorted;  // by block, then depth
  std::vector<kernels::Hit> spare_hits;
  std::vector<std::uint32_t> first;  // of each block, in `sorted`
  std::vector<std::uint32_t> next;
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
  visit([](SweepSpace & s) -> auto& { return s.ribbons.records; });
  visit([](SweepSpace & s) -> auto& { return s.ribbons.free; });
  visit([](SweepSpace & s) -> auto& { return s.ribbons.behind; });
  visit([](SweepSpace & s) -> auto& { return s.here; });
  visit([](SweepSpace & s) -> auto& { return s.lines; });
  visit([](SweepSpace & s) -> auto& { return s.hits; });
  visit([](SweepSpace & s) -> auto& { return s.sorted; });
  visit([](SweepSpace & s) -> auto& { return s.spare_hits; });
}

// Between looks at whether the tile is done or nobody wants it any more.
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
