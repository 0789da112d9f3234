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

using kernels::Pass;

// Pixels per world unit at a view depth, clamped to the near plane.
double scale_at(const kernels::Camera& camera, double depth) {
  if (camera.perspective == 0) return camera.inverse_pixel;
  return camera.inverse_pixel / std::max<double>(depth, camera.near);
}

// Upper bound on the area that thin splats cover at `scale` pixels per world unit, as a multiple of
// that at a scale of 0: the largest of the three terms of splat_cover of the kernels, divided by
// the third.
double splat_cover(const Pass& pass, std::array<double, 3> edge, double scale) {
  if (pass.places != nullptr) {
    for (int a = 0; a < 3; ++a) edge[a] = pass.cell_max[a];
    const double section = std::hypot(edge[1] * edge[2], edge[2] * edge[0], edge[0] * edge[1]);
    const double chord = std::hypot(edge[0], edge[1], edge[2]);
    return std::max(
        {edge[0] * edge[1] * edge[2] / chord * scale * scale, section / chord * scale, 1.0});
  }
  std::sort(edge.begin(), edge.end());
  return std::max({edge[0] * edge[1] * scale * scale, edge[1] * scale, 1.0});
}

int blocks_of(int pixels) { return (pixels + kernels::block_side - 1) / kernels::block_side; }

// Pixels of the picture in a range of blocks along one axis.
std::int64_t pixels_along(int first, int last, int size) {
  return std::min((last + 1) * kernels::block_side, size) - first * kernels::block_side;
}

}  // namespace

std::array<double, 3> widest_cells(const Pass& pass, const LatticeRange& range) {
  std::array<double, 3> edges{};
  for (int a = 0; a < 3; ++a) {
    for (int i = range.first[a]; i < range.first[a] + range.count[a]; ++i) {
      edges[a] = std::max<double>(edges[a], pass.axis[a].cell[i]);
    }
  }
  return edges;
}

// A line covers its length times r1 + r2 and twice the width of its halo, two half discs as large
// as its mark reaches, and at most a rectangle around the head of an arrow; a splat covers its
// extinction times its volume. All are assumed at the nearest depth. The sampling factors bound the
// ratio of the sum over pixels to the area, over all positions and rotations, for shapes and line
// ramps no narrower than a pixel.
double left_out_alphas(const RenderPlan& plan, const PassPlan& pass,
                       const std::array<double, 3>& edges, const LeftOut& left_out, double depth) {
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
  const double wider = std::max<double>(line.outer - line.r2, 0);
  const double d1 = r1 + wider;
  const double d2 = r2 + wider;
  double ends = std::numbers::pi * (d1 * d1 + d1 * d2 + d2 * d2) / 3;
  if (line.head_length > 0) ends += 2 * d2 * (line.head_length + d2);
  const double halo = line.steep > 0 ? static_cast<double>(line.halo / line.steep) : 0.0;
  const double length = line.length * left_out.parts * scale * oblique;
  const double covered = line_sampling * (length * (r1 + r2 + 2 * halo) + left_out.lines * ends);
  const double cover = left_out.medium > 0 ? splat_cover(pass.kernel, edges, scale) : 0;
  return line.opacity * covered + splat_sampling * left_out.medium * cover * oblique;
}

std::int64_t pixels_in(const BlockRange& range, const kernels::Camera& camera) {
  return pixels_along(range.x, range.x_last, camera.width) *
         pixels_along(range.y, range.y_last, camera.height);
}

BlockRange block_range(const Rectangle& rectangle, const kernels::Camera& camera) {
  const auto block = [](double pixel, int size) {
    const int last = (size - 1) / kernels::block_side;
    return static_cast<std::int16_t>(
        std::clamp(static_cast<int>(pixel) / kernels::block_side, 0, last));
  };
  return {block(rectangle.x0, camera.width), block(rectangle.x1, camera.width),
          block(rectangle.y0, camera.height), block(rectangle.y1, camera.height)};
}

void add_left_out(const RenderPlan& plan, const PassPlan& pass, const std::array<double, 3>& edges,
                  const LeftOut& left_out, const Projected& found, double& sum,
                  std::vector<BlockRange>& ranges) {
  const double alphas = left_out_alphas(plan, pass, edges, left_out, found.depth_first);
  ranges.push_back(block_range(found.seen, plan.camera));
  sum += std::min(alphas, static_cast<double>(pixels_in(ranges.back(), plan.camera)));
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
