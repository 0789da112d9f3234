// Contents of bricks after samples below the tolerances are removed. They do not depend on the
// camera and are kept between frames, so that rotating a view does not read every sample again.
// 16 bytes per brick of 64 kernel positions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/engine/kernels/table.hpp"
#include "server/engine/plan.hpp"

namespace windsplat::engine {

struct KeptSummary {
  float weak_parts = 0;   // as in kernels::BrickSummary
  float thin_medium = 0;  // at a scale of 0
  float magnitude_max = 0;
  std::uint8_t lines = 0;
  std::uint8_t splats = 0;
  std::uint8_t without_both = 0;
  std::uint8_t weak_lines = unknown;

  static constexpr std::uint8_t unknown = 255;
  [[nodiscard]] bool known() const { return weak_lines != unknown; }
  [[nodiscard]] bool holds_any() const { return lines > 0 || splats > 0; }
  // Whether a tolerance removed anything.
  [[nodiscard]] bool left_out_any() const { return weak_lines > 0 || thin_medium > 0; }
  // Whether the brick draws nothing and no tolerance removed anything.
  [[nodiscard]] bool blank() const { return known() && !holds_any() && !left_out_any(); }
};

// The summaries of one pass by brick in lattice order, independent of the visit order. Each frame
// adds those that it reads. A region is a cube of 8 x 8 x 8 kernel positions, 8 bricks deep.
struct PassSummaries {
  int u_bricks = 0;
  int v_bricks = 0;
  int layers = 0;   // kernel positions along the major axis
  int regions = 0;  // along the major axis
  // Of fields that are boxes of a grid, which have no summaries of what is left out: layers and
  // bricks of a box along major, v and u, the steps between its boxes in `places`, and the places.
  std::array<int, 3> box{1, 1, 1};
  std::array<int, 3> box_step{0, 0, 0};
  std::vector<int> places;  // 0: left out; empty: the fields are no grid
  std::vector<KeptSummary> bricks;
  std::vector<std::uint8_t> blank_regions;  // 1: every brick is known to be blank

  [[nodiscard]] std::size_t brick(int layer, int v, int u) const {
    if (places.empty()) return (static_cast<std::size_t>(layer) * v_bricks + v) * u_bricks + u;
    const auto place = static_cast<std::size_t>(place_of(layer, v, u));
    return ((place * box[0] + layer % box[0]) * box[1] + v % box[1]) * box[2] + u % box[2];
  }
  // Whether the fields have nothing there.
  [[nodiscard]] bool is_left_out(int layer, int v, int u) const {
    return !places.empty() && place_of(layer, v, u) == 0;
  }
  [[nodiscard]] int place_of(int layer, int v, int u) const {
    const int index =
        layer / box[0] * box_step[0] + v / box[1] * box_step[1] + u / box[2] * box_step[2];
    return places[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] std::size_t region(int layer, int v, int u) const {
    return (static_cast<std::size_t>(layer / kernels::brick_side) * v_bricks + v) * u_bricks + u;
  }
  [[nodiscard]] std::size_t bytes() const;
  // Empty summaries of a pass.
  void begin(const PassPlan& pass);
  // Tests the bricks of a region and records the result in blank_regions.
  bool find_blank(int region_layer, int v, int u);
};

// Least-recently-used cache of the summaries of a few passes. The key is the identity of the fields
// (not merely their addresses, which may be reused) and every number that a summary depends on.
class SummaryCache {
 public:
  // The limit on bytes may be exceeded by the passes of a single frame.
  static constexpr std::size_t passes_max = 8;
  static constexpr std::size_t bytes_max = std::size_t{64} << 20U;

  SummaryCache();
  ~SummaryCache();
  SummaryCache(const SummaryCache&) = delete;
  SummaryCache& operator=(const SummaryCache&) = delete;

  // Call before the first pass of a frame.
  void begin_frame() { ++frame_; }
  // The reference is valid until the next frame begins.
  PassSummaries& of(const PassPlan& pass, const kernels::Table& table);

  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Entry;
  Entry& replaceable();
  void trim_storage(std::size_t coming);

  std::uint64_t frame_ = 0;
  std::vector<std::unique_ptr<Entry>> entries_;
  std::vector<std::uint32_t> key_;  // key of the requested pass
};

// Reads the fields of a brick and returns its summary.
KeptSummary summarise(const kernels::Table& table, const kernels::Pass& in_order,
                      const kernels::Brick& brick);

}  // namespace windsplat::engine
