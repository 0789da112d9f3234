// Projection of boxes, conservative near the eye.
#include "server/engine/projector.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace windsplat::engine {

namespace {

// Interval of pixels that a box may cover along one axis of the screen, widened by a margin. If a
// corner lies in front of the near plane, the box is tested against the planes through the eye and
// the two edges of the screen instead.
struct Span {
  double low = 0, high = -1;
  bool behind = false;
};

// Corners of a box in camera space, by component: right, down, forward.
struct Corners {
  std::array<std::array<double, 8>, 3> at;
  std::array<double, 8> inverse_z;  // depths clamped to the near plane; orthographic: 1
  bool behind = false;              // a corner lies in front of the near plane
};

Span screen_span(const Corners& corners, int across, const kernels::Camera& camera, double half,
                 double margin) {
  const std::array<double, 8>& at = corners.at[across];
  if (!corners.behind) {
    double low = 1e300;
    double high = -1e300;
    for (std::size_t c = 0; c < 8; ++c) {
      const double x = at[c] * corners.inverse_z[c];
      low = std::min(low, x);
      high = std::max(high, x);
    }
    const double scale = 1.0 / static_cast<double>(camera.pixel);
    return {half + low * scale - margin, half + high * scale + margin, false};
  }
  // If all corners are outside one plane, the box is invisible; otherwise assume the whole axis.
  const double edge = (half + margin) * camera.pixel;
  bool left = true;
  bool right = true;
  for (std::size_t c = 0; c < 8; ++c) {
    left = left && at[c] < -edge * corners.at[2][c];
    right = right && at[c] > edge * corners.at[2][c];
  }
  if (left || right) return {};
  return {-margin, 2 * half + margin, true};
}

// Corner c has the upper end of axis a where bit a of c is set.
Corners corners_of(const kernels::Camera& camera, const scene::Camera& view, const Box& box,
                   const std::array<double, 3>& reach) {
  const std::array<glm::dvec3, 3> frame{view.right, -view.up, view.forward};
  std::array<double, 3> low{};
  std::array<double, 3> high{};
  for (int a = 0; a < 3; ++a) {
    low[a] = box.low[a] - reach[a] - view.eye[a];
    high[a] = box.high[a] + reach[a] - view.eye[a];
  }
  Corners out;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::array<double, 2> x{low[0] * frame[i].x, high[0] * frame[i].x};
    const std::array<double, 2> y{low[1] * frame[i].y, high[1] * frame[i].y};
    const std::array<double, 2> z{low[2] * frame[i].z, high[2] * frame[i].z};
    for (std::size_t c = 0; c < 8; ++c) out.at[i][c] = x[c & 1U] + y[c >> 1U & 1U] + z[c >> 2U];
  }
  out.inverse_z.fill(1);
  if (camera.perspective == 0) return out;
  for (std::size_t c = 0; c < 8; ++c) {
    out.inverse_z[c] = 1 / std::max<double>(out.at[2][c], camera.near);
    out.behind = out.behind || out.at[2][c] < camera.near;
  }
  return out;
}

}  // namespace

Projected Projector::operator()(const PassPlan& plan, const Box& box,
                                const std::array<double, 3>& reach) const {
  const Corners corners = corners_of(camera_, view_, box, reach);
  const auto [first, last] = std::minmax_element(corners.at[2].begin(), corners.at[2].end());
  const double nearest = *first;
  const double farthest = *last;
  if (camera_.perspective != 0 && farthest < camera_.near) return {};
  const double margin = 1.0 + (plan.kernel.has_lines != 0 ? plan.kernel.line.outer : 0.0);
  const Span x = screen_span(corners, 0, camera_, camera_.half_width_px, margin);
  const Span y = screen_span(corners, 1, camera_, camera_.half_height_px, margin);
  if (x.low > x.high || y.low > y.high) return {};
  const Rectangle r{std::max(x.low, 0.0), std::min<double>(x.high, camera_.width),
                    std::max(y.low, 0.0), std::min<double>(y.high, camera_.height)};
  const bool whole = !x.behind && !y.behind && x.low >= 0 && x.high <= camera_.width &&
                     y.low >= 0 && y.high <= camera_.height;
  return {r, nearest, farthest, whole};
}

}  // namespace windsplat::engine
