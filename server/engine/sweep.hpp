// Composites the bricks of a tile in order of view depth: for the slab method, and for curved
// lattices, whose samples have no front-to-back order by index. A brick is prepared when the sweep
// reaches it and released once the sweep has passed it.
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

// A kernel and its view depth.
struct DepthEntry {
  float depth = 0;
  std::int32_t slot = 0;
  std::int32_t position = 0;
};

// Splats that the sweep has reached and not yet passed: recycled records, and for each of the next
// slabs a queue of the splats that start in it.
struct WaitingSplats {
  static constexpr std::size_t slabs = 256;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  std::vector<kernels::SplatRecord> records;
  std::vector<std::uint32_t> free;
  std::vector<std::uint32_t> behind;       // per record: the next one in its queue
  std::array<std::uint32_t, slabs> first;  // per slab, modulo
  std::array<std::uint32_t, slabs> last;
  std::size_t count = 0;
};

// Hits queued for the same slab, and the index of the next chunk of them.
struct HitChunk {
  static constexpr std::uint32_t size = 63;

  std::uint32_t count;
  std::uint32_t behind;
  kernels::Hit hits[size];
};

// The same for lines, which are queued by block. A record is kept while any of its hits is queued.
struct WaitingLines {
  static constexpr std::size_t slabs = 32;
  static constexpr std::uint32_t none = 0xFFFFFFFFU;

  std::vector<kernels::RibbonRecord> records;
  std::vector<std::uint32_t> free;
  std::vector<std::uint32_t> waiting;  // per record: number of queued hits
  std::vector<HitChunk> chunks;
  std::vector<std::uint32_t> free_chunks;
  std::array<std::uint32_t, slabs> first;  // per slab, modulo
  std::array<std::uint32_t, slabs> last;
  std::size_t count = 0;  // hits
};

// Storage of one worker, reused for every tile.
struct SweepSpace {
  // Curved lattices: prepared bricks.
  std::vector<std::unique_ptr<kernels::Prepared>> slots;
  std::vector<std::int32_t> free;
  std::vector<DepthEntry> active;  // last depth and slot of each prepared brick
  std::vector<DepthEntry> order;
  std::vector<DepthEntry> spare;  // storage for sorting
  // Slabs.
  std::unique_ptr<kernels::Prepared> prepared;
  WaitingSplats splats;
  WaitingLines lines;
  std::vector<std::uint32_t> here;          // splats in the current slab
  AlignedVector<float> gathered;            // records of one brick
  std::vector<kernels::Hit> listed;         // hits of one brick
  std::vector<kernels::Hit> hits;           // hits in the current slab
  std::vector<kernels::MetLine> met;        // the same hits, grouped by block
  std::vector<kernels::MetLine> spare_met;  // storage for sorting
};

// Calls visit(member) for each vector that grows with the contents of a tile; member(space) returns
// the vector.
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

// Slabs between two checks for opacity and cancellation.
constexpr std::int64_t slabs_between_checks = 4;

// True if every block of the tile that the brick may touch is opaque or shows the body before it.
bool all_closed(const kernels::Tile& tile, const kernels::Brick& brick);

// Whether the lines of the brick are combined by `or`: they are drawn before the sweep begins.
inline bool has_or_lines(const RenderPlan& plan, const kernels::Brick& brick) {
  return plan.or_lines && brick.pass == 0;
}

// Draws tile `index`, whose bricks must be sorted by their first depth. Returns true if it ended
// early because the tile became opaque. After cancellation the tile is invalid.
bool sweep_tile(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                const CancelToken& cancel, std::size_t index, SweepSpace& space,
                kernels::Tile& tile);

// The same for the slab method.
bool sweep_slabs(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                 const CancelToken& cancel, std::size_t index, SweepSpace& space,
                 kernels::Tile& tile);

}  // namespace windsplat::engine
