// Sweeps a tile of a curved lattice front to back, kernel by kernel.
#include "server/engine/sweep.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "server/engine/stable_sort.hpp"

namespace windsplat::engine {

namespace {

using kernels::Brick;
using kernels::Prepared;
using kernels::Tile;

// View depths from the camera's depth origin.
struct Interval {
  float front = 0, back = 0;
};

class Sweep {
 public:
  Sweep(const RenderPlan& plan, const Bins& bins, const kernels::Table& table, SweepSpace& space,
        Tile& tile)
      : plan_(plan), bins_(bins), table_(table), space_(space), tile_(tile) {
    space_.free.clear();
    for (std::size_t s = 0; s < space_.slots.size(); ++s) {
      space_.free.push_back(static_cast<std::int32_t>(s));
    }
    space_.active.clear();
  }

  bool run(const CancelToken& cancel, std::size_t first, std::size_t last) {
    next_ = first;
    last_ = last;
    std::int64_t slab = 0;
    for (std::int64_t done = 0; next_ < last_ || !space_.active.empty(); ++done, ++slab) {
      if (space_.active.empty()) {
        const auto begins =
            static_cast<std::int64_t>(std::floor(brick(next_).depth_first / plan_.slab_depth));
        slab = done == 0 ? begins : std::max(slab, begins);
      }
      slab_.front = static_cast<float>(static_cast<double>(slab) * plan_.slab_depth);
      slab_.back = static_cast<float>(static_cast<double>(slab + 1) * plan_.slab_depth);
      activate(cancel);
      if (cancel.cancelled()) return false;
      draw_kernels();
      retire();
      if (done % slabs_between_checks == slabs_between_checks - 1) {
        if (cancel.cancelled()) return false;
        if (table_.count_open(tile_) == 0) {
          for (; next_ < last_; ++next_) count_occluded(brick(next_));
          return true;
        }
      }
    }
    return false;
  }

 private:
  [[nodiscard]] const Brick& brick(std::size_t entry) const {
    return bins_.bricks[bins_.entries[entry]];
  }

  void count_occluded(const Brick& brick) {
    if (has_or_lines(plan_, brick)) return;
    tile_.counters.occluded += static_cast<std::int64_t>(brick.u_count) * brick.v_count;
  }

  std::int32_t take_slot() {
    if (space_.free.empty()) {
      space_.slots.push_back(std::make_unique<Prepared>());
      return static_cast<std::int32_t>(space_.slots.size() - 1);
    }
    const std::int32_t slot = space_.free.back();
    space_.free.pop_back();
    return slot;
  }

  void activate(const CancelToken& cancel) {
    for (; next_ < last_ && brick(next_).depth_first < slab_.back; ++next_) {
      constexpr std::size_t bricks_between_checks = 64;
      if (next_ % bricks_between_checks == 0 && cancel.cancelled()) return;
      const Brick& here = brick(next_);
      if (has_or_lines(plan_, here)) continue;
      if (all_closed(tile_, here)) {
        count_occluded(here);
        continue;
      }
      const std::int32_t slot = take_slot();
      table_.prepare(plan_.camera, plan_.passes[here.pass].kernel, here, tile_,
                     *space_.slots[slot]);
      if (space_.slots[slot]->positions.count > 0) {
        space_.active.push_back({here.depth_last, slot, 0});
      } else {
        space_.free.push_back(slot);
      }
    }
  }

  void retire() {
    const auto passed = [&](const DepthEntry& entry) { return entry.depth < slab_.back; };
    for (const DepthEntry& entry : space_.active) {
      if (passed(entry)) space_.free.push_back(entry.slot);
    }
    space_.active.erase(std::remove_if(space_.active.begin(), space_.active.end(), passed),
                        space_.active.end());
  }

  // Draws the kernels whose centres lie in the slab, in order of depth.
  void draw_kernels() {
    space_.order.clear();
    for (const DepthEntry& entry : space_.active) {
      const kernels::KernelPositions& positions = space_.slots[entry.slot]->positions;
      for (std::uint64_t left = positions.lines | positions.splats; left != 0; left &= left - 1U) {
        const int l = std::countr_zero(left);
        const float depth = positions.depth[l];
        if (depth >= slab_.front && depth < slab_.back) {
          space_.order.push_back({depth, entry.slot, l});
        }
      }
    }
    stable_sort(space_.order, space_.spare,
                [](const DepthEntry& a, const DepthEntry& b) { return a.depth < b.depth; });
    for (const DepthEntry& kernel : space_.order) {
      table_.draw_prepared(plan_.camera, *space_.slots[kernel.slot], kernel.position, tile_);
    }
  }

  const RenderPlan& plan_;
  const Bins& bins_;
  const kernels::Table& table_;
  SweepSpace& space_;
  Tile& tile_;
  Interval slab_;
  std::size_t next_ = 0;
  std::size_t last_ = 0;
};

}  // namespace

bool sweep_tile(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                const CancelToken& cancel, std::size_t index, SweepSpace& space, Tile& tile) {
  if (plan.slabs) return sweep_slabs(plan, bins, table, cancel, index, space, tile);
  Sweep sweep(plan, bins, table, space, tile);
  return sweep.run(cancel, bins.first[index], bins.first[index + 1]);
}

}  // namespace windsplat::engine
