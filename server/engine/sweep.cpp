// Sweeps a tile front to back.
#include "server/engine/sweep.hpp"

#include <algorithm>
#include <cmath>

namespace windsplat::engine {

namespace {

using kernels::Brick;
using kernels::Hit;
using kernels::Prepared;
using kernels::Slab;
using kernels::Tile;
using kernels::tile_blocks;

constexpr int tile_block_count = tile_blocks * tile_blocks;
constexpr std::int64_t slabs_between_checks = 4;

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
    space_.gathered.resize(static_cast<std::size_t>(tile_block_count) * kernels::gathered_floats);
    slab_.gathered = space_.gathered.data();
    slab_.stop = plan_.stop_transmittance;
  }

  bool run(const CancelToken& cancel, std::uint32_t first, std::uint32_t last) {
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
      activate();
      if (plan_.slabs) {
        draw_slab();
      } else {
        draw_kernels();
      }
      retire();
      if (done % slabs_between_checks == slabs_between_checks - 1) {
        if (cancel.cancelled()) return false;
        if (table_.refresh_open(tile_, plan_.stop_transmittance) == 0) {
          for (; next_ < last_; ++next_) count_occluded(brick(next_));
          return true;
        }
      }
    }
    return false;
  }

 private:
  [[nodiscard]] const Brick& brick(std::uint32_t entry) const {
    return bins_.bricks[bins_.entries[entry]];
  }

  void count_occluded(const Brick& brick) {
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

  void activate() {
    for (; next_ < last_ && brick(next_).depth_first < slab_.back; ++next_) {
      const Brick& here = brick(next_);
      if (all_closed(tile_, here)) {
        count_occluded(here);
        continue;
      }
      const std::int32_t slot = take_slot();
      table_.prepare(plan_.camera, plan_.passes[here.pass].kernel, here, tile_,
                     *space_.slots[slot]);
      if (space_.slots[slot]->stops.count > 0) {
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

  void draw_slab() {
    std::fill(std::begin(slab_.touched), std::end(slab_.touched), 0U);
    std::size_t hits = 0;
    for (const DepthEntry& entry : space_.active) {
      const Prepared& prepared = *space_.slots[entry.slot];
      table_.gather(plan_.camera, prepared, slab_, tile_);
      if (prepared.pass->has_lines == 0) continue;
      if (space_.hits.size() < hits + kernels::hits_of_brick_max) {
        space_.hits.resize(2 * hits + kernels::hits_of_brick_max);
      }
      hits += table_.list_hits(plan_.camera, prepared, slab_, tile_, space_.hits.data() + hits);
    }
    sort_hits(hits);
    for (int block = 0; block < tile_block_count; ++block) {
      const std::uint32_t from = space_.first[block];
      const auto count = static_cast<int>(space_.first[block + 1] - from);
      const std::uint32_t row = slab_.touched[block / tile_blocks];
      const bool touched = (row >> static_cast<unsigned>(block % tile_blocks) & 1U) != 0;
      if (!touched && count == 0) continue;
      table_.close_slab(plan_.camera, plan_.compositing, slab_, space_.sorted.data() + from, count,
                        block, tile_);
    }
  }

  // By block, then from front to back.
  void sort_hits(std::size_t count) {
    space_.first.assign(tile_block_count + 1, 0);
    for (std::size_t h = 0; h < count; ++h) ++space_.first[space_.hits[h].block + 1];
    for (int b = 0; b < tile_block_count; ++b) space_.first[b + 1] += space_.first[b];
    space_.sorted.resize(count);
    std::vector<std::uint32_t>& at = next_of_block_;
    at.assign(space_.first.begin(), space_.first.end() - 1);
    for (std::size_t h = 0; h < count; ++h) {
      const Hit& hit = space_.hits[h];
      space_.sorted[at[hit.block]++] = hit;
    }
    for (int b = 0; b < tile_block_count; ++b) {
      std::stable_sort(space_.sorted.begin() + space_.first[b],
                       space_.sorted.begin() + space_.first[b + 1],
                       [](const Hit& p, const Hit& q) { return p.depth < q.depth; });
    }
  }

  // The kernels whose centres lie in the slab, one after the other.
  void draw_kernels() {
    space_.order.clear();
    for (const DepthEntry& entry : space_.active) {
      const kernels::Stops& stops = space_.slots[entry.slot]->stops;
      for (int l = 0; l < stops.count; ++l) {
        const float depth = stops.depth[l];
        if (depth >= slab_.front && depth < slab_.back) {
          space_.order.push_back({depth, entry.slot, l});
        }
      }
    }
    std::stable_sort(space_.order.begin(), space_.order.end(),
                     [](const DepthEntry& a, const DepthEntry& b) { return a.depth < b.depth; });
    for (const DepthEntry& kernel : space_.order) {
      table_.draw_prepared(plan_.camera, *space_.slots[kernel.slot], kernel.stop, kernel.stop + 1,
                           tile_);
    }
  }

  const RenderPlan& plan_;
  const Bins& bins_;
  const kernels::Table& table_;
  SweepSpace& space_;
  Tile& tile_;
  Slab slab_{};
  std::uint32_t next_ = 0;
  std::uint32_t last_ = 0;
  std::vector<std::uint32_t> next_of_block_;
};

}  // namespace

bool sweep_tile(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                const CancelToken& cancel, std::size_t index, SweepSpace& space, Tile& tile) {
  Sweep sweep(plan, bins, table, space, tile);
  return sweep.run(cancel, bins.first[index], bins.first[index + 1]);
}

}  // namespace windsplat::engine
