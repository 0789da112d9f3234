// What bricks hold once samples below their tolerances are left out, kept between frames: no camera
// changes it, so a view that turns need not read every sample again. 16 bytes a brick of 64 stops.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/engine/kernels/table.hpp"
#include "server/engine/plan.hpp"

namespace windsplat::engine {

struct KeptSummary {
  float weak_parts = 0;   // see kernels::BrickSummary
  float thin_medium = 0;  // at a scale of 0
  float magnitude_max = 0;
  std::uint8_t lines = 0;
  std::uint8_t splats = 0;
  std::uint8_t without_both = 0;
  std::uint8_t weak_lines = unknown;

  static constexpr std::uint8_t unknown = 255;
  [[nodiscard]] bool known() const { return weak_lines != unknown; }
  [[nodiscard]] bool holds_any() const { return lines > 0 || splats > 0; }
  // Something that a tolerance has to answer for.
  [[nodiscard]] bool left_out_any() const { return weak_lines > 0 || thin_medium > 0; }
  // Whether it neither draws nor leaves out anything that a tolerance would have to answer for.
  [[nodiscard]] bool blank() const { return known() && !holds_any() && !left_out_any(); }
};

// The summaries of one pass, by the places of bricks in the lattice, whatever the order of visit.
// Frames fill in what they read. A region is a cube of 8 x 8 x 8 stops, 8 bricks deep.
struct PassSummaries {
  int u_bricks = 0;
  int v_bricks = 0;
  int layers = 0;   // stops along the major axis
  int regions = 0;  // along the major axis
  std::vector<KeptSummary> bricks;
  std::vector<std::uint8_t> blank_regions;  // 1: every brick of it is known to be blank

  [[nodiscard]] std::size_t brick(int layer, int v, int u) const {
    return (static_cast<std::size_t>(layer) * v_bricks + v) * u_bricks + u;
  }
  [[nodiscard]] std::size_t region(int layer, int v, int u) const {
    return brick(layer / kernels::brick_side, v, u);
  }
  // Looks at the bricks of a region that was not blank so far.
  bool find_blank(int region_layer, int v, int u);
};

// A few passes' summaries, those used longest ago replaced by new ones. A pass is known again by
// its fields themselves (another one at the same address is another one) and by every number that a
// summary depends on.
class SummaryCache {
 public:
  // At most this many passes, and no more than these bytes unless one frame alone needs more.
  static constexpr std::size_t passes_max = 8;
  static constexpr std::size_t bytes_max = std::size_t{64} << 20U;

  SummaryCache();
  ~SummaryCache();
  SummaryCache(const SummaryCache&) = delete;
  SummaryCache& operator=(const SummaryCache&) = delete;

  // Before a frame's first pass.
  void begin_frame() { ++frame_; }
  // Stays valid until the frame after.
  PassSummaries& of(const PassPlan& pass, const kernels::Table& table);

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Entry;
  Entry& replaceable();
  void trim_storage(std::size_t coming);

  std::uint64_t frame_ = 0;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::vector<std::uint32_t> key_;  // of the pass looked for
};

// The brick's summary, read from the fields.
KeptSummary summarise(const kernels::Table& table, const kernels::Pass& in_order,
                      const kernels::Brick& brick);

}  // namespace windsplat::engine
