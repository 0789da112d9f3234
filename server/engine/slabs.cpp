// Sweeps a tile front to back, slab by slab: accumulates the parts of splats, sorts lines by depth
// and composites both block by block.
#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "server/engine/stable_sort.hpp"
#include "server/engine/sweep.hpp"

namespace windsplat::engine {

namespace {

using kernels::Brick;
using kernels::brick_kernels;
using kernels::Hit;
using kernels::MetLine;
using kernels::RibbonRecord;
using kernels::Slab;
using kernels::slabs_ahead;
using kernels::SplatRecord;
using kernels::Tile;
using kernels::tile_blocks;

constexpr std::size_t bricks_between_checks = 64;
constexpr std::size_t tile_block_count = std::size_t{tile_blocks} * tile_blocks;

// Queue index of a slab; slab numbers before the camera's depth origin are negative.
std::size_t modulo(std::int64_t slab, std::size_t slabs) {
  const auto count = static_cast<std::int64_t>(slabs);
  return static_cast<std::size_t>((slab % count + count) % count);
}

// The splats of a sweep, each queued for the slab in which it is drawn next.
class Splats {
 public:
  explicit Splats(WaitingSplats& of) : of_(of) {
    of_.records.clear();
    of_.free.clear();
    of_.behind.clear();
    of_.first.fill(WaitingSplats::none);
    of_.last.fill(WaitingSplats::none);
    of_.count = 0;
  }

  [[nodiscard]] std::size_t count() const { return of_.count; }
  [[nodiscard]] const SplatRecord& operator[](std::uint32_t at) const { return of_.records[at]; }

  void prefetch(std::uint32_t at) const {
    constexpr std::size_t line = 64;
    const char* bytes = reinterpret_cast<const char*>(&of_.records[at]);
    for (std::size_t n = 0; n < sizeof(SplatRecord); n += line) __builtin_prefetch(bytes + n);
  }

  std::uint32_t add(const SplatRecord& record) {
    ++of_.count;
    if (of_.free.empty()) {
      of_.records.push_back(record);
      of_.behind.push_back(WaitingSplats::none);
      return static_cast<std::uint32_t>(of_.records.size() - 1);
    }
    const std::uint32_t at = of_.free.back();
    of_.free.pop_back();
    of_.records[at] = record;
    return at;
  }

  void remove(std::uint32_t at) {
    of_.free.push_back(at);
    --of_.count;
  }

  // Queues a record for slab `wanted`, or for the last slab that the queues, starting at `now`,
  // cover.
  void await(std::uint32_t record, std::int64_t wanted, std::int64_t now) {
    const auto reach = static_cast<std::int64_t>(WaitingSplats::slabs) - 1;
    const std::size_t slab = modulo(std::min(wanted, now + reach), WaitingSplats::slabs);
    of_.behind[record] = WaitingSplats::none;
    if (of_.first[slab] == WaitingSplats::none) {
      of_.first[slab] = record;
    } else {
      of_.behind[of_.last[slab]] = record;
    }
    of_.last[slab] = record;
  }

  // Moves the queue of a slab to `here`.
  void take(std::int64_t index, std::vector<std::uint32_t>& here) {
    const std::size_t slab = modulo(index, WaitingSplats::slabs);
    here.clear();
    for (std::uint32_t record = of_.first[slab]; record != WaitingSplats::none;
         record = of_.behind[record]) {
      here.push_back(record);
    }
    of_.first[slab] = of_.last[slab] = WaitingSplats::none;
  }

 private:
  WaitingSplats& of_;
};

// The lines of a sweep, each queued for the blocks that it may touch.
class Lines {
 public:
  explicit Lines(WaitingLines& of) : of_(of) {
    of_.records.clear();
    of_.free.clear();
    of_.waiting.clear();
    of_.chunks.clear();
    of_.free_chunks.clear();
    of_.first.fill(WaitingLines::none);
    of_.last.fill(WaitingLines::none);
    of_.count = 0;
  }

  [[nodiscard]] std::size_t count() const { return of_.count; }
  [[nodiscard]] const RibbonRecord* records() const { return of_.records.data(); }

  // Reserves records for the lines of a brick; `slots` receives brick_kernels free indices.
  RibbonRecord* make_room(std::uint32_t* slots) {
    while (of_.free.size() < brick_kernels) {
      of_.free.push_back(static_cast<std::uint32_t>(of_.records.size()));
      of_.records.emplace_back();
      of_.waiting.push_back(0);
    }
    std::copy_n(of_.free.rbegin(), brick_kernels, slots);
    return of_.records.data();
  }

  // Marks the first `lines` of those records as used, record n with counts[n] hits.
  void take_room(const std::uint32_t* slots, int lines, const int* counts) {
    of_.free.resize(of_.free.size() - static_cast<std::size_t>(lines));
    for (int n = 0; n < lines; ++n) {
      of_.waiting[slots[n]] = static_cast<std::uint32_t>(counts[n]);
      of_.count += static_cast<std::size_t>(counts[n]);
    }
  }

  void await(const Hit& hit, std::int64_t index) {
    const std::size_t slab = modulo(index, WaitingLines::slabs);
    std::uint32_t last = of_.last[slab];
    if (last == WaitingLines::none || of_.chunks[last].count == HitChunk::size) {
      last = add_chunk(slab);
    }
    HitChunk& chunk = of_.chunks[last];
    chunk.hits[chunk.count++] = hit;
  }

  // Calls visit(hit) for each hit queued for the slab. The callback returns the slab to queue it
  // for next, or `index` to drop it.
  template <class Visit>
  void take(std::int64_t index, const Visit& visit) {
    const std::size_t slab = modulo(index, WaitingLines::slabs);
    std::uint32_t at = std::exchange(of_.first[slab], WaitingLines::none);
    of_.last[slab] = WaitingLines::none;
    while (at != WaitingLines::none) {
      const std::uint32_t count = of_.chunks[at].count;
      for (std::uint32_t n = 0; n < count; ++n) {
        const Hit hit = of_.chunks[at].hits[n];
        const std::int64_t next = visit(hit);
        if (next != index) {
          await(hit, next);
        } else {
          --of_.count;
          if (--of_.waiting[hit.line] == 0) of_.free.push_back(hit.line);
        }
      }
      of_.free_chunks.push_back(at);
      at = of_.chunks[at].behind;
    }
  }

 private:
  std::uint32_t add_chunk(std::size_t slab) {
    std::uint32_t at = 0;
    if (of_.free_chunks.empty()) {
      at = static_cast<std::uint32_t>(of_.chunks.size());
      of_.chunks.emplace_back();
    } else {
      at = of_.free_chunks.back();
      of_.free_chunks.pop_back();
    }
    of_.chunks[at].count = 0;
    of_.chunks[at].behind = WaitingLines::none;
    const std::uint32_t last = std::exchange(of_.last[slab], at);
    (last == WaitingLines::none ? of_.first[slab] : of_.chunks[last].behind) = at;
    return at;
  }

  WaitingLines& of_;
};

class SlabSweep {
 public:
  SlabSweep(const RenderPlan& plan, const Bins& bins, const kernels::Table& table,
            SweepSpace& space, Tile& tile)
      : plan_(plan),
        bins_(bins),
        table_(table),
        space_(space),
        tile_(tile),
        splats_(space.splats),
        lines_(space.lines) {
    if (plan.camera.perspective != 0) {
      near_ = static_cast<float>(static_cast<double>(plan.camera.near) - plan.camera.depth_origin);
    }
    if (!space_.prepared) space_.prepared = std::make_unique<kernels::Prepared>();
    constexpr std::size_t floats = tile_block_count * kernels::gathered_floats;
    space_.gathered.resize(slabs_ahead * floats);
    space_.listed.resize(kernels::hits_of_brick_max);
    for (std::size_t n = 0; n < slabs_ahead; ++n) {
      slabs_[n].gathered = space_.gathered.data() + n * floats;
    }
  }

  bool run(const CancelToken& cancel, std::size_t first, std::size_t last) {
    next_ = first;
    last_ = last;
    for (bool begun = false; next_ < last_ || waiting(); begun = true, ++index_) {
      if (!waiting()) {
        const std::int64_t begins = slab_of(brick(next_).depth_first);
        index_ = begun ? std::max(index_, begins) : begins;
      }
      for (std::int64_t n = index_; n < index_ + slabs_ahead; ++n) {
        Slab& slab = slab_at(n);
        slab.front = depth_of(n);
        slab.back = depth_of(n + 1);
        slab.begin = near_ < slab.back ? std::max(slab.front, near_) : slab.front;
      }
      activate(cancel);
      gather();
      close();
      if (cancel.cancelled()) return false;
      if (table_.count_open(tile_) == 0) {
        for (; next_ < last_; ++next_) count_occluded(brick(next_));
        return true;
      }
    }
    return false;
  }

 private:
  [[nodiscard]] bool waiting() const {
    return splats_.count() + lines_.count() > 0 || index_ <= gathered_until_;
  }

  [[nodiscard]] const Brick& brick(std::size_t entry) const {
    return bins_.bricks[bins_.entries[entry]];
  }

  void count_occluded(const Brick& brick) {
    if (has_or_lines(plan_, brick)) return;
    tile_.counters.occluded += static_cast<std::int64_t>(brick.u_count) * brick.v_count;
  }

  // Clamped, so that the conversion to an integer is defined for any depth.
  [[nodiscard]] std::int64_t slab_of(float depth) const {
    constexpr double farthest = 1e15;
    const double slab = std::floor(static_cast<double>(depth) / plan_.slab_depth);
    return static_cast<std::int64_t>(std::clamp(slab, -farthest, farthest));
  }

  [[nodiscard]] float depth_of(std::int64_t slab) const {
    return static_cast<float>(static_cast<double>(slab) * plan_.slab_depth);
  }

  Slab& slab_at(std::int64_t index) { return slabs_[modulo(index, slabs_ahead)]; }

  // First slab of a hit, clamped to the slabs that the queues cover.
  std::int64_t slab_of(const Hit& hit) {
    constexpr auto farthest = static_cast<float>(WaitingLines::slabs - 1);
    const float slabs = (hit.first - slab_at(index_).front) * inverse_depth_;
    return index_ + static_cast<std::int64_t>(std::clamp(slabs, 0.0F, farthest));
  }

  void activate(const CancelToken& cancel) {
    for (; next_ < last_ && brick(next_).depth_first < slab_at(index_).back; ++next_) {
      if (next_ % bricks_between_checks == 0 && cancel.cancelled()) return;
      const Brick& here = brick(next_);
      if (has_or_lines(plan_, here)) continue;
      if (all_closed(tile_, here)) {
        count_occluded(here);
        continue;
      }
      kernels::Prepared& prepared = *space_.prepared;
      table_.prepare(plan_.camera, plan_.passes[here.pass].kernel, here, tile_, prepared);
      if (prepared.positions.splats != 0) add_splats(prepared);
      if (prepared.positions.lines != 0) add_lines(prepared);
    }
  }

  void add_splats(const kernels::Prepared& prepared) {
    SplatRecord splats[brick_kernels];
    const int count = table_.pack_splats(plan_.camera, prepared, splats);
    for (int n = 0; n < count; ++n) {
      const std::int64_t first = std::max(slab_of(splats[n].first), index_);
      splats_.await(splats_.add(splats[n]), first, index_);
    }
  }

  void add_lines(const kernels::Prepared& prepared) {
    std::uint32_t slots[brick_kernels];
    int counts[brick_kernels];
    RibbonRecord* records = lines_.make_room(slots);
    const int lines =
        table_.pack_lines(plan_.camera, prepared, static_cast<float>(plan_.slab_depth), slots,
                          tile_, records, space_.listed.data(), counts);
    lines_.take_room(slots, lines, counts);
    const Hit* hit = space_.listed.data();
    for (int n = 0; n < lines; ++n) {
      for (const Hit* last = hit + counts[n]; hit < last; ++hit) lines_.await(*hit, slab_of(*hit));
    }
  }

  // Accumulates the splats that begin in this slab into it and the following ones.
  void gather() {
    splats_.take(index_, space_.here);
    const Slab& now = slab_at(index_);
    const float reach = slab_at(index_ + slabs_ahead - 1).back;
    for (std::size_t n = 0; n < space_.here.size(); ++n) {
      // The records are not in the order of the queue.
      constexpr std::size_t ahead = 4;
      if (n + ahead < space_.here.size()) splats_.prefetch(space_.here[n + ahead]);
      const std::uint32_t at = space_.here[n];
      const SplatRecord& splat = splats_[at];
      if (splat.first >= now.back) {
        splats_.await(at, std::max(slab_of(splat.first), index_ + 1), index_);
        continue;
      }
      table_.gather(plan_.camera, splat, slabs_, static_cast<int>(modulo(index_, slabs_ahead)),
                    tile_);
      if (splat.last >= reach) {
        gathered_until_ = std::max(gathered_until_, index_ + slabs_ahead - 1);
        splats_.await(at, index_ + slabs_ahead, index_);
      } else {
        if (splat.last >= depth_of(gathered_until_ + 1)) gathered_until_ = slab_of(splat.last);
        splats_.remove(at);
      }
    }
  }

  // Composites the slab, block by block.
  void close() {
    Slab& slab = slab_at(index_);
    for (std::uint32_t& row : lined_) row = 0;
    if (lines_.count() > 0) meet(slab);
    for (int row = 0; row < tile_blocks; ++row) {
      std::uint32_t left = (lined_[row] | slab.touched[row]) & tile_.open[row];
      if (tile_.body != nullptr) left |= blocks_at_body(row, slab.back);
      for (; left != 0; left &= left - 1U) {
        const int column = __builtin_ctz(left);
        const int block = row * tile_blocks + column;
        const bool lined = (lined_[row] >> static_cast<unsigned>(column) & 1U) != 0;
        const auto [first, last] = lined ? lines_at(block) : std::pair<std::size_t, std::size_t>();
        table_.close_slab(plan_.camera, plan_.compositing, slab, lines_.records(),
                          space_.met.data() + first, static_cast<int>(last - first), block, tile_);
      }
      slab.touched[row] = 0;
    }
  }

  // The open blocks of a row that the body or a layer enters before `depth`, as bits.
  [[nodiscard]] std::uint32_t blocks_at_body(int row, float depth) const {
    std::uint32_t found = blocks_at(*tile_.body, row, depth);
    for (int n = 0; n < tile_.layers; ++n) found |= blocks_at(tile_.layer[n], row, depth);
    return found;
  }

  [[nodiscard]] std::uint32_t blocks_at(const kernels::TileBody& body, int row, float depth) const {
    if (body.nearest >= depth) return 0;
    std::uint32_t found = 0;
    for (std::uint32_t left = body.seen[row] & tile_.open[row]; left != 0; left &= left - 1U) {
      const int column = std::countr_zero(left);
      if (body.blocks[row * tile_blocks + column].nearest < depth) found |= left & (~left + 1U);
    }
    return found;
  }

  // Collects the lines that open blocks may meet in the slab in space_.met, grouped by block;
  // met_until_ holds the end of each group.
  void meet(const Slab& slab) {
    std::vector<Hit>& hits = space_.hits;
    hits.clear();
    std::fill(std::begin(met_until_), std::end(met_until_), 0U);
    lines_.take(index_, [&](const Hit& hit) {
      const auto row = static_cast<unsigned>(hit.block) / tile_blocks;
      const std::uint32_t bit = std::uint32_t{1} << static_cast<unsigned>(hit.block) % tile_blocks;
      if ((tile_.open[row] & bit) == 0) return index_;
      if (hit.first >= slab.back) return std::max(slab_of(hit), index_ + 1);
      hits.push_back(hit);
      lined_[row] |= bit;
      ++met_until_[hit.block];
      return hit.last >= slab.back ? index_ + 1 : index_;
    });
    std::uint32_t sum = 0;
    for (std::uint32_t& until : met_until_) sum = std::exchange(until, sum) + sum;
    if (space_.met.size() < hits.size()) space_.met.resize(hits.size());
    for (const Hit& hit : hits) {
      space_.met[met_until_[hit.block]++] = {0.5F * (hit.first + hit.last), hit.first, hit.line};
    }
  }

  // Range of space_.met for a block.
  std::pair<std::size_t, std::size_t> lines_at(int block) {
    const std::size_t first = block == 0 ? 0 : met_until_[block - 1];
    const std::size_t last = met_until_[block];
    if (last - first > kernels::met_lines_sorted_max) {
      stable_sort(space_.met, first, last, space_.spare_met,
                  [](const MetLine& p, const MetLine& q) { return p.depth < q.depth; });
    }
    return {first, last};
  }

  const RenderPlan& plan_;
  const Bins& bins_;
  const kernels::Table& table_;
  SweepSpace& space_;
  Tile& tile_;
  Splats splats_;
  Lines lines_;
  Slab slabs_[slabs_ahead] = {};
  std::uint32_t lined_[tile_blocks] = {};  // bit set: the block may meet lines in this slab
  std::uint32_t met_until_[tile_block_count] = {};
  float near_ = std::numeric_limits<float>::lowest();  // the near plane, from the depth origin
  float inverse_depth_ = static_cast<float>(1.0 / plan_.slab_depth);
  std::int64_t index_ = 0;
  std::int64_t gathered_until_ = std::numeric_limits<std::int64_t>::min();
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
