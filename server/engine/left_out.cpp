// The bound on what tolerances leave out: sums of alphas, limited by the pixels that they may
// touch.
#include "server/engine/left_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace windsplat::engine {
namespace {

using kernels::Brick;
using kernels::Pass;

// Pixels per world unit at a view depth, clamped to the near plane.
double scale_at(const kernels::Camera& camera, double depth) {
  if (camera.perspective == 0) return camera.inverse_pixel;
  return camera.inverse_pixel / std::max<double>(depth, camera.near);
}

// Upper bound on the area that thin splats of a brick cover at `scale` pixels
// per world unit, as a multiple of that at a scale of 0: the largest of the
// three terms of splat_cover of the kernels, divided by the third. Uses the
// widest cells of the brick.
double splat_cover(const Pass& pass, const Brick& brick, double scale) {
  std::array<double, 3> edge{};
  const auto widest = [&](int a, int first, int count) {
    for (int i = first; i < first + count; ++i) {
      edge[a] = std::max<double>(edge[a], pass.axis[a].cell[pass.axis[a].visit[i]]);
    }
  };
  if (pass.places != nullptr) {
    for (int a = 0; a < 3; ++a) edge[a] = pass.cell_max[a];
    const double section = std::hypot(edge[1] * edge[2], edge[2] * edge[0], edge[0] * edge[1]);
    const double chord = std::hypot(edge[0], edge[1], edge[2]);
    return std::max(
        {edge[0] * edge[1] * edge[2] / chord * scale * scale, section / chord * scale, 1.0});
  }
  widest(pass.major, brick.sheet, 1);
  widest(pass.u, brick.u_first, brick.u_count);
  widest(pass.v, brick.v_first, brick.v_count);
  std::sort(edge.begin(), edge.end());
  return std::max({edge[0] * edge[1] * scale * scale, edge[1] * scale, 1.0});
}

int blocks_of(int pixels) { return (pixels + kernels::block_side - 1) / kernels::block_side; }

// Pixels of the picture in a range of blocks along one axis.
std::int64_t pixels_along(int first, int last, int size) {
  return std::min((last + 1) * kernels::block_side, size) - first * kernels::block_side;
}

}  // namespace

// A line covers its length times r1 + r2 and two half discs, a splat its extinction times its
// volume. All are assumed at the nearest depth. The sampling factors bound the ratio of the sum
// over pixels to the area, over all positions and rotations, for shapes and line ramps no narrower
// than a pixel.
double left_out_alphas(const RenderPlan& plan, const PassPlan& pass, const Brick& brick,
                       const KeptSummary& summary, double depth) {
  constexpr double line_sampling = 1.2;
  constexpr double splat_sampling = 1.03;
  const kernels::Camera& camera = plan.camera;
  const kernels::LineStyle& line = pass.kernel.line;
  const double scale = scale_at(camera, depth);
  double oblique = 1;  // length of the longest ray at unit depth
  if (camera.perspective != 0) {
    const double x = static_cast<double>(camera.half_width_px) * camera.pixel;
    const double y = static_cast<double>(camera.half_height_px) * camera.pixel;
    oblique = std::sqrt(1 + x * x + y * y);
  }
  const double r1 = line.r1;
  const double r2 = std::max<double>(line.r2, r1 + 1);
  const double discs = std::numbers::pi * (r1 * r1 + r1 * r2 + r2 * r2) / 3;
  const double length = line.length * static_cast<double>(summary.weak_parts) * scale * oblique;
  const double covered = line_sampling * (length * (r1 + r2) + summary.weak_lines * discs);
  const double cover = summary.thin_medium > 0 ? splat_cover(pass.kernel, brick, scale) : 0;
  return line.opacity * covered +
         splat_sampling * static_cast<double>(summary.thin_medium) * cover * oblique;
}

std::int64_t pixels_in(const BlockRange& range, const kernels::Camera& camera) {
  return pixels_along(range.x, range.x_last, camera.width) *
         pixels_along(range.y, range.y_last, camera.height);
}

void TouchedBlocks::begin(const kernels::Camera& camera) {
  row_ = blocks_of(camera.width) + 1;
  covering_.assign(static_cast<std::size_t>(row_ * (blocks_of(camera.height) + 1)), 0);
}

std::int64_t TouchedBlocks::pixels(const kernels::Camera& camera) {
  std::int64_t pixels = 0;
  const int high = blocks_of(camera.height);
  for (int y = 0; y < high; ++y) {
    std::int32_t* const here = covering_.data() + y * row_;
    std::int32_t along = 0;
    std::int64_t columns = 0;
    for (int x = 0; x + 1 < row_; ++x) {
      along += here[x];
      here[x] = along + (y > 0 ? here[x - row_] : 0);
      if (here[x] > 0) columns += pixels_along(x, x, camera.width);
    }
    pixels += columns * pixels_along(y, y, camera.height);
  }
  return pixels;
}

}  // namespace windsplat::engine
