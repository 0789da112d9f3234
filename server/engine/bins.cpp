// Projects bricks, culls them and lists them by tile.
#include "server/engine/bins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace windsplat::engine {

namespace {

using kernels::Brick;
using kernels::BrickSummary;
using kernels::Pass;
using kernels::tile_blocks;
using kernels::tile_side;

// A rectangle of the picture in pixels; empty when first > last.
struct Rectangle {
  double x0 = 0, x1 = -1, y0 = 0, y1 = -1;
  [[nodiscard]] bool empty() const { return x0 > x1 || y0 > y1; }
};

// A brick's stops as a box of the world.
struct Box {
  std::array<double, 3> low{};
  std::array<double, 3> high{};
};

// Of a curved lattice: from where its stops really are.
Box curved_box(const Pass& pass, const Brick& brick) {
  Box box;
  box.low.fill(1e300);
  box.high.fill(-1e300);
  const auto offset = [&](int a, int visited) {
    return pass.step[a] * pass.axis[a].sample[pass.axis[a].visit[visited]];
  };
  for (int v = 0; v < brick.v_count; ++v) {
    for (int u = 0; u < brick.u_count; ++u) {
      const float* place =
          pass.places + 3 * (offset(pass.major, brick.slab) + offset(pass.v, brick.v_first + v) +
                             offset(pass.u, brick.u_first + u));
      for (int c = 0; c < 3; ++c) {
        box.low[c] = std::min<double>(box.low[c], place[c]);
        box.high[c] = std::max<double>(box.high[c], place[c]);
      }
    }
  }
  return box;
}

Box stops_box(const PassPlan& plan, const Brick& brick) {
  const Pass& pass = plan.kernel;
  if (pass.places != nullptr) return curved_box(pass, brick);
  Box box;
  const auto extend = [&](int a, int first, int count) {
    const AxisArrays& axis = plan.axis[a];
    // A brick's stops are consecutive: its extremes are its lowest and highest index.
    const auto [low, high] =
        std::minmax_element(axis.visit.begin() + first, axis.visit.begin() + first + count);
    box.low[a] = axis.position[*low];
    box.high[a] = axis.position[*high];
  };
  extend(pass.major, brick.slab, 1);
  extend(pass.u, brick.u_first, brick.u_count);
  extend(pass.v, brick.v_first, brick.v_count);
  return box;
}

// How far kernels reach beyond their stops along each world axis.
std::array<double, 3> kernel_reach(const Pass& pass, double line_reach, bool splats) {
  std::array<double, 3> reach{};
  for (int a = 0; a < 3; ++a) {
    const double cell = pass.cell_max[a];
    const double moved = 0.5 * (pass.line.jitter_center + pass.line.jitter_stride) * cell;
    const double line = pass.has_lines != 0 && line_reach >= 0 ? line_reach + moved : 0;
    const double splat = splats ? kernels::footprint_radius * cell : 0;
    reach[a] = std::max(line, splat) * 1.0001;
  }
  return reach;
}

// One axis of the screen: which part of [0, size] pixels a box may cover, widened by margin. Corner
// coordinates are (across, forward); with any corner behind `near` the planes through the eye and
// the screen's two edges decide.
struct Span {
  double low = 0, high = -1;
};

struct Corners {
  std::array<std::array<double, 3>, 8> at;  // right, down, forward
};

Span screen_span(const Corners& corners, int across, const kernels::Camera& camera, double half,
                 double margin) {
  const double scale = 1.0 / static_cast<double>(camera.pixel);
  const bool perspective = camera.perspective != 0;
  bool behind = false;
  double low = 1e300;
  double high = -1e300;
  for (const auto& corner : corners.at) {
    behind = behind || (perspective && corner[2] < camera.near);
    const double z = perspective ? std::max<double>(corner[2], camera.near) : 1.0;
    low = std::min(low, corner[across] / z);
    high = std::max(high, corner[across] / z);
  }
  if (!behind) return {half + low * scale - margin, half + high * scale + margin};
  // Outside one edge's plane with every corner: not seen at all; otherwise possibly everywhere.
  const double edge = (half + margin) * camera.pixel;
  bool left = true;
  bool right = true;
  for (const auto& corner : corners.at) {
    left = left && corner[across] < -edge * corner[2];
    right = right && corner[across] > edge * corner[2];
  }
  if (left || right) return {};
  return {-margin, 2 * half + margin};
}

// Where kernels may be seen, and how far from the eye.
struct Projected {
  Rectangle seen;
  double depth_first = 0, depth_last = 0;  // view depths of the kernels' reach
};

class Projector {
 public:
  explicit Projector(const RenderPlan& plan) : camera_(plan.camera), view_(*plan.view) {}

  Projected operator()(const PassPlan& plan, const Box& box,
                       const std::array<double, 3>& reach) const {
    Corners corners;
    double nearest = 1e300;
    double farthest = -1e300;
    for (unsigned c = 0; c < 8; ++c) {
      std::array<double, 3> sum{};
      for (int a = 0; a < 3; ++a) {
        const bool top = ((c >> static_cast<unsigned>(a)) & 1U) != 0;
        const double at = (top ? box.high[a] + reach[a] : box.low[a] - reach[a]) - view_.eye[a];
        sum[0] += at * view_.right[a];
        sum[1] -= at * view_.up[a];
        sum[2] += at * view_.forward[a];
      }
      corners.at[c] = sum;
      nearest = std::min(nearest, sum[2]);
      farthest = std::max(farthest, sum[2]);
    }
    if (camera_.perspective != 0 && farthest < camera_.near) return {};
    const double margin = 1.0 + (plan.kernel.has_lines != 0 ? plan.kernel.line.r2 : 0.0);
    const Span x = screen_span(corners, 0, camera_, camera_.half_width_px, margin);
    const Span y = screen_span(corners, 1, camera_, camera_.half_height_px, margin);
    if (x.low > x.high || y.low > y.high) return {};
    const Rectangle r{std::max(x.low, 0.0), std::min<double>(x.high, camera_.width),
                      std::max(y.low, 0.0), std::min<double>(y.high, camera_.height)};
    return {r, nearest, farthest};
  }

 private:
  const kernels::Camera& camera_;
  const scene::Camera& view_;
};

// Bricks of one slab of one pass, with the slab's share of the report.
struct SlabBricks {
  std::vector<Brick> bricks;
  std::int64_t samples = 0;
  std::int64_t culled = 0;
  std::int64_t without_line = 0;
  std::int64_t without_splat = 0;
  std::int64_t without_both = 0;
  double left_out = 0;  // alphas of what tolerances left out, summed over pixels, at most
};

// Pixels a world unit at a view depth, or the nearest that is drawn.
double scale_at(const kernels::Camera& camera, double depth) {
  if (camera.perspective == 0) return camera.inverse_pixel;
  return camera.inverse_pixel / std::max<double>(depth, camera.near);
}

// The sum over the picture of the alphas that a brick's weak lines and thin splats would have, at
// most: a line covers its length times r1 + r2 and two half discs, a splat spreads its extinction
// times its volume. All are taken at the brick's nearest, where there are `scale` pixels a world
// unit. Pixels sample what they show: shapes that are no narrower than a pixel, and lines whose
// ramp is not, add up to at most this many times their area, over all places and turns.
double left_out(const RenderPlan& plan, const PassPlan& pass, const BrickSummary& summary,
                double scale) {
  constexpr double line_sampling = 1.2;
  constexpr double splat_sampling = 1.03;
  if (summary.weak_lines == 0 && summary.thin_medium <= 0) return 0;
  const kernels::Camera& camera = plan.camera;
  const kernels::LineStyle& line = pass.kernel.line;
  const double pixels = static_cast<double>(camera.width) * camera.height;
  double oblique = 1;  // a ray's length at unit depth, at most
  if (camera.perspective != 0) {
    oblique = std::hypot(1.0, std::hypot(camera.half_width_px, camera.half_height_px) *
                                  static_cast<double>(camera.pixel));
  }
  const double r1 = line.r1;
  const double r2 = std::max<double>(line.r2, r1 + 1);
  const double discs = std::numbers::pi * (r1 * r1 + r1 * r2 + r2 * r2) / 3;
  const double length = line.length * static_cast<double>(summary.weak_parts) * scale * oblique;
  const double covered = line_sampling * (length * (r1 + r2) + summary.weak_lines * discs);
  const double lines = line.opacity * std::min(covered, summary.weak_lines * pixels);
  return lines + splat_sampling * static_cast<double>(summary.thin_medium) * oblique;
}

void set_blocks(const Rectangle& r, const kernels::Camera& camera, Brick& brick) {
  const auto block = [](double pixel, int size) {
    const int last = (size - 1) / kernels::block_side;
    return static_cast<std::int16_t>(
        std::clamp(static_cast<int>(pixel) / kernels::block_side, 0, last));
  };
  brick.block_x = block(r.x0, camera.width);
  brick.block_x_last = block(r.x1, camera.width);
  brick.block_y = block(r.y0, camera.height);
  brick.block_y_last = block(r.y1, camera.height);
}

void add_brick(const RenderPlan& plan, const kernels::Table& table, const Projector& project,
               Brick brick, SlabBricks& out) {
  const PassPlan& pass = plan.passes[brick.pass];
  const std::int64_t stops = static_cast<std::int64_t>(brick.u_count) * brick.v_count;
  const Box box = stops_box(pass, brick);
  out.samples += stops;
  // First by the longest line that the style allows: what is outside is not even read.
  const bool lines = pass.kernel.has_lines != 0;
  const double longest = lines ? 0.5 * pass.kernel.line.length : -1;
  const bool medium = pass.kernel.has_medium != 0;
  const Projected whole = project(pass, box, kernel_reach(pass.kernel, longest, medium));
  if (whole.seen.empty()) {
    out.culled += stops;
    return;
  }
  BrickSummary summary;
  const double scale = scale_at(plan.camera, whole.depth_first);
  table.summarise(pass.kernel, brick, static_cast<float>(scale), summary);
  out.without_line += summary.without_line;
  out.without_splat += summary.without_splat;
  out.without_both += summary.without_both;
  out.left_out += left_out(plan, pass, summary, scale);
  if (summary.lines == 0 && summary.splats == 0) return;
  const double part =
      std::min(1.0F, summary.magnitude_max * pass.kernel.line.inverse_full_magnitude);
  const double reach = summary.lines > 0 ? longest * part * 1.00001 : -1;
  brick.line_reach = static_cast<float>(std::max(reach, 0.0));
  const Projected found = project(pass, box, kernel_reach(pass.kernel, reach, summary.splats > 0));
  if (found.seen.empty()) return;
  set_blocks(found.seen, plan.camera, brick);
  brick.depth_first = static_cast<float>(found.depth_first - plan.camera.depth_origin);
  brick.depth_last = static_cast<float>(found.depth_last - plan.camera.depth_origin);
  out.bricks.push_back(brick);
}

SlabBricks slab_bricks(const RenderPlan& plan, const kernels::Table& table, int pass_index,
                       int slab) {
  const PassPlan& pass = plan.passes[pass_index];
  const Projector project(plan);
  SlabBricks out;
  for (const auto& v : pass.axis[pass.kernel.v].bricks) {
    for (const auto& u : pass.axis[pass.kernel.u].bricks) {
      Brick brick{};
      brick.pass = pass_index;
      brick.slab = slab;
      brick.u_first = u[0];
      brick.u_count = u[1];
      brick.v_first = v[0];
      brick.v_count = v[1];
      add_brick(plan, table, project, brick, out);
    }
  }
  return out;
}

// Slabs of all passes front to back: the eye's own and those above it upward, then those below it
// downward. Passes of different strides are interleaved by distance, lines first.
struct SlabKey {
  int side;      // 0 upward, 1 downward
  int distance;  // samples from the eye's slab
  int pass;
  int slab;
};

std::vector<SlabKey> order_slabs(const RenderPlan& plan) {
  std::vector<SlabKey> keys;
  for (int p = 0; p < static_cast<int>(plan.passes.size()); ++p) {
    const PassPlan& pass = plan.passes[p];
    const AxisArrays& axis = pass.axis[pass.kernel.major];
    const int eye_sample = axis.sample[axis.visit.front()];
    for (int s = 0; s < static_cast<int>(axis.visit.size()); ++s) {
      const int ahead = axis.sample[axis.visit[s]] - eye_sample;
      keys.push_back({ahead >= 0 ? 0 : 1, std::abs(ahead), p, s});
    }
  }
  std::stable_sort(keys.begin(), keys.end(), [](const SlabKey& a, const SlabKey& b) {
    if (a.side != b.side) return a.side < b.side;
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.pass < b.pass;
  });
  return keys;
}

template <class Visit>
void each_tile(const Bins& bins, const Brick& brick, const Visit& visit) {
  for (int y = brick.block_y / tile_blocks; y <= brick.block_y_last / tile_blocks; ++y) {
    for (int x = brick.block_x / tile_blocks; x <= brick.block_x_last / tile_blocks; ++x) {
      visit(static_cast<std::size_t>(y) * bins.tiles_x + x);
    }
  }
}

void list_by_tile(Bins& bins) {
  const std::size_t tiles = static_cast<std::size_t>(bins.tiles_x) * bins.tiles_y;
  bins.first.assign(tiles + 1, 0);
  for (const Brick& brick : bins.bricks) {
    each_tile(bins, brick, [&](std::size_t tile) { ++bins.first[tile + 1]; });
  }
  for (std::size_t t = 0; t < tiles; ++t) bins.first[t + 1] += bins.first[t];
  bins.entries.resize(bins.first[tiles]);
  std::vector<std::uint32_t> next(bins.first.begin(), bins.first.end() - 1);
  for (std::size_t b = 0; b < bins.bricks.size(); ++b) {
    each_tile(bins, bins.bricks[b], [&](std::size_t tile) {
      bins.entries[next[tile]++] = static_cast<std::uint32_t>(b);
    });
  }
}

}  // namespace

Bins make_bins(const RenderPlan& plan, const kernels::Table& table, ThreadPool& pool,
               const CancelToken& cancel, WorkReport& work) {
  Bins bins;
  bins.tiles_x = (plan.camera.width + tile_side - 1) / tile_side;
  bins.tiles_y = (plan.camera.height + tile_side - 1) / tile_side;
  const std::vector<SlabKey> slabs = order_slabs(plan);
  std::vector<SlabBricks> found(slabs.size());
  pool.run(slabs.size(), [&](std::size_t i, unsigned) {
    if (cancel.cancelled()) return;
    found[i] = slab_bricks(plan, table, slabs[i].pass, slabs[i].slab);
  });
  if (cancel.cancelled()) return {};
  double left_out = 0;
  for (const SlabBricks& slab : found) {
    bins.bricks.insert(bins.bricks.end(), slab.bricks.begin(), slab.bricks.end());
    work.samples += slab.samples;
    work.culled += slab.culled;
    work.skipped_vector += slab.without_line;
    work.skipped_scalar += slab.without_splat;
    work.skipped_both += slab.without_both;
    left_out += slab.left_out;
  }
  // A pixel changes by no more than all of its light.
  work.skipped_bound =
      std::min(1.0, left_out / (static_cast<double>(plan.camera.width) * plan.camera.height));
  if (plan.slabs || plan.curved) {
    // Swept by depth: those that begin first come first.
    std::stable_sort(bins.bricks.begin(), bins.bricks.end(),
                     [](const Brick& a, const Brick& b) { return a.depth_first < b.depth_first; });
  }
  list_by_tile(bins);
  return bins;
}

}  // namespace windsplat::engine
