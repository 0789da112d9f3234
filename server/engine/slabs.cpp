// Sweeps a tile front to back, slab by slab: splats gather their parts, lines are sorted by depth,
// both are composited block by block.
#include <algorithm>
#include <cmath>
#include <limits>

#include "server/engine/stable_sort.hpp"
#include "server/engine/sweep.hpp"

namespace windsplat::engine {

namespace {

using kernels::Brick;
using kernels::brick_stops;
using kernels::Hit;
using kernels::Slab;
using kernels::Tile;
using kernels::tile_blocks;

constexpr std::size_t bricks_between_looks = 64;
constexpr int tile_block_count = tile_blocks * tile_blocks;

class SlabSweep {
 public:
  SlabSweep(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
            SweepSpace& space, Tile& tile)
      : plan_(plan), bins_(bins), table_(table), space_(space), tile_(tile) {
    forget(space_.splats);
    forget(space_.ribbons);
    if (!space_.prepared) space_.prepared = std::make_unique<kernels::Prepared>();
    space_.gathered.resize(static_cast<std::size_t>(tile_block_count) * kernels::gathered_floats);
    slab_.gathered = space_.gathered.data();
    slab_.stop = plan_.stop_transmittance;
  }

  bool run(const CancelToken& cancel, std::size_t first, std::size_t last) {
    next_ = first;
    last_ = last;
    for (std::int64_t done = 0; next_ < last_ || reached() > 0; ++done, ++index_) {
      if (reached() == 0) {
        const std::int64_t begins = slab_of(brick(next_).depth_first);
        index_ = done == 0 ? begins : std::max(index_, begins);
      }
      slab_.front = depth_of(index_);
      slab_.back = depth_of(index_ + 1);
      activate(cancel);
      draw();
      if (cancel.cancelled()) return false;
      if (done % slabs_between_checks == slabs_between_checks - 1) {
        if (table_.refresh_open(tile_) == 0) {
          for (; next_ < last_; ++next_) count_occluded(brick(next_));
          return true;
        }
      }
    }
    return false;
  }

 private:
  template <class Record>
  static void forget(Reached<Record>& of) {
    of.records.clear();
    of.free.clear();
    of.behind.clear();
    of.first.fill(of.none);
    of.last.fill(of.none);
    of.count = 0;
  }

  [[nodiscard]] std::size_t reached() const { return space_.splats.count + space_.ribbons.count; }

  [[nodiscard]] const Brick& brick(std::size_t entry) const {
    return bins_.bricks[bins_.entries[entry]];
  }

  void count_occluded(const Brick& brick) {
    tile_.counters.occluded += static_cast<std::int64_t>(brick.u_count) * brick.v_count;
  }

  // Bounded, so that a depth far beyond any slab still has a number.
  [[nodiscard]] std::int64_t slab_of(float depth) const {
    constexpr double farthest = 1e15;
    const double slab = std::floor(static_cast<double>(depth) / plan_.slab_depth);
    return static_cast<std::int64_t>(std::clamp(slab, -farthest, farthest));
  }

  [[nodiscard]] float depth_of(std::int64_t slab) const {
    return static_cast<float>(static_cast<double>(slab) * plan_.slab_depth);
  }

  template <class Record>
  static std::int64_t of_slabs(const Reached<Record>& of) {
    return static_cast<std::int64_t>(of.first.size());
  }

  template <class Record>
  static std::size_t place(const Reached<Record>& of, std::int64_t slab) {
    const std::int64_t slabs = of_slabs(of);
    return static_cast<std::size_t>((slab % slabs + slabs) % slabs);
  }

  // Puts a record down for the slab that it is next met in, or as near to that as can be told.
  template <class Record>
  void await(Reached<Record>& of, std::uint32_t record, std::int64_t earliest) {
    const std::int64_t wanted = std::max(earliest, slab_of(of.records[record].first));
    const std::size_t slab = place(of, std::min(wanted, index_ + of_slabs(of) - 1));
    of.behind[record] = of.none;
    if (of.first[slab] == of.none) {
      of.first[slab] = record;
    } else {
      of.behind[of.last[slab]] = record;
    }
    of.last[slab] = record;
  }

  template <class Record>
  void add(Reached<Record>& of, const Record* records, int count) {
    for (int n = 0; n < count; ++n) {
      std::uint32_t at = 0;
      if (of.free.empty()) {
        at = static_cast<std::uint32_t>(of.records.size());
        of.records.push_back(records[n]);
        of.behind.push_back(of.none);
      } else {
        at = of.free.back();
        of.free.pop_back();
        of.records[at] = records[n];
      }
      ++of.count;
      await(of, at, index_);
    }
  }

  void activate(const CancelToken& cancel) {
    kernels::SplatRecord splats[brick_stops];
    kernels::RibbonRecord ribbons[brick_stops];
    for (; next_ < last_ && brick(next_).depth_first < slab_.back; ++next_) {
      if (next_ % bricks_between_looks == 0 && cancel.cancelled()) return;
      const Brick& here = brick(next_);
      if (all_closed(tile_, here)) {
        count_occluded(here);
        continue;
      }
      kernels::Prepared& prepared = *space_.prepared;
      table_.prepare(plan_.camera, plan_.passes[here.pass].kernel, here, tile_, prepared);
      if (prepared.stops.count == 0) continue;
      add(space_.splats, splats, table_.pack_splats(plan_.camera, prepared, splats));
      add(space_.ribbons, ribbons, table_.pack_ribbons(prepared, ribbons));
    }
  }

  // Takes what waits for this slab.
  template <class Record>
  void take(Reached<Record>& of, std::vector<std::uint32_t>& here) {
    const std::size_t slab = place(of, index_);
    here.clear();
    for (auto record = of.first[slab]; record != of.none; record = of.behind[record]) {
      here.push_back(record);
    }
    of.first[slab] = of.last[slab] = of.none;
  }

  // Once a slab is drawn: what reaches beyond it waits for the next, the rest is forgotten.
  template <class Record>
  void pass(Reached<Record>& of, const std::vector<std::uint32_t>& here) {
    for (const std::uint32_t record : here) {
      if (of.records[record].last >= slab_.back) {
        await(of, record, index_ + 1);
      } else {
        of.free.push_back(record);
        --of.count;
      }
    }
  }

  void draw() {
    std::fill(std::begin(slab_.touched), std::end(slab_.touched), 0U);
    take(space_.splats, space_.here);
    for (const std::uint32_t splat : space_.here) {
      table_.gather(plan_.camera, space_.splats.records[splat], slab_, tile_);
    }
    pass(space_.splats, space_.here);
    take(space_.ribbons, space_.lines);
    std::size_t hits = 0;
    for (const std::uint32_t line : space_.lines) {
      if (space_.hits.size() < hits + kernels::hits_of_line_max) {
        space_.hits.resize(2 * hits + kernels::hits_of_line_max);
      }
      hits += static_cast<std::size_t>(table_.list_hits(plan_.camera, space_.ribbons.records[line],
                                                        slab_, tile_, space_.hits.data() + hits));
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
    pass(space_.ribbons, space_.lines);
  }

  // By block, then from front to back.
  void sort_hits(std::size_t count) {
    space_.first.assign(tile_block_count + 1, 0);
    for (std::size_t h = 0; h < count; ++h) ++space_.first[space_.hits[h].block + 1];
    for (int b = 0; b < tile_block_count; ++b) space_.first[b + 1] += space_.first[b];
    space_.sorted.resize(count);
    space_.next.assign(space_.first.begin(), space_.first.end() - 1);
    for (std::size_t h = 0; h < count; ++h) {
      const Hit& hit = space_.hits[h];
      space_.sorted[space_.next[hit.block]++] = hit;
    }
    for (int b = 0; b < tile_block_count; ++b) {
      stable_sort(space_.sorted, space_.first[b], space_.first[b + 1], space_.spare_hits,
                  [](const Hit& p, const Hit& q) { return p.depth < q.depth; });
    }
  }

  const RenderPlan& plan_;
  const Bins& bins_;
  const kernels::Table& table_;
  SweepSpace& space_;
  Tile& tile_;
  Slab slab_{};
  std::int64_t index_ = 0;
  std::size_t next_ = 0;
  std::size_t last_ = 0;
};

}  // namespace

bool sweep_slabs(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
                 const CancelToken& cancel, std::size_t index, SweepSpace& space, Tile& tile) {
  SlabSweep sweep(plan, bins, table, space, tile);
  return sweep.run(cancel, bins.first[index], bins.first[index + 1]);
}

}  // namespace windsplat::engine
