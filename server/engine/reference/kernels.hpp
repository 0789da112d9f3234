// Scene -> kernel positions with their lines and splats, in double precision; input of the
// reference and of the naive renderer of the tests.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::engine::reference {

using Vec = std::array<double, 3>;

inline double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// a + f b.
inline Vec plus(const Vec& a, double f, const Vec& b) {
  return {a[0] + f * b[0], a[1] + f * b[1], a[2] + f * b[2]};
}
inline Vec scaled(const Vec& v, double f) { return {f * v[0], f * v[1], f * v[2]}; }
inline double length(const Vec& v) { return std::hypot(v[0], v[1], v[2]); }

// The footprint g of a splat [Max91]: its radii in cells and its integral over the plane.
constexpr double footprint_s = 0.48;
constexpr double footprint_t = 1.37;
constexpr double footprint_integral = 1.4476982547;

// Camera axes in world space; pixel: size of a pixel, in perspective at unit depth.
struct View {
  Vec eye{}, right{}, down{}, forward{};
  double pixel = 1;
  double near = 0;
  double half_width = 0, half_height = 0;  // pixels
  bool perspective = true;
};
View make_view(const scene::Camera& camera);
// Along right, down, forward.
inline Vec to_camera(const View& view, const Vec& v) {
  return {dot(view.right, v), dot(view.down, v), dot(view.forward, v)};
}

// A kernel position along one axis: it represents `samples` samples and lies at the middle one (the
// lower of two). cell: sum of their spacings, world units. A slice has one position along its axis.
struct AxisPosition {
  int sample = 0;
  int samples = 1;
  double cell = 0;
};
std::vector<AxisPosition> axis_positions(const scene::Scene& scene, int axis, int stride,
                                         const data::Box& held);

// Layers of one stride share their kernel positions.
struct LayerGroup {
  int stride = 1;
  const scene::VectorLayer* lines = nullptr;
  std::vector<const scene::ScalarLayer*> media;
  std::array<std::vector<AxisPosition>, 3> axis;
};
std::vector<LayerGroup> group_layers(const scene::Scene& scene);  // the one with lines first

// A kernel position.
struct KernelPosition {
  std::array<int, 3> sample{};
  std::size_t index = 0;         // index of its sample in a field
  Vec from_eye{};                // world axes
  Vec centre{};                  // from_eye along right, down, forward
  std::array<Vec, 3> edge{};     // edges of its cell: the columns of A, world units
  std::array<Vec, 3> inverse{};  // the rows of A^-1
  Vec cell{};                    // widths of the uncurved cell
  bool has_cell = true;          // false if the cell has no volume (at the pole of a globe)

  [[nodiscard]] Vec to_cells(const Vec& v) const {
    return {dot(inverse[0], v), dot(inverse[1], v), dot(inverse[2], v)};
  }
};
// A position without a cell has neither line nor splat.
KernelPosition make_kernel_position(const scene::Scene& scene, const View& view,
                                    const std::array<AxisPosition, 3>& positions);

// The vector at a kernel position as drawn: `unit` along the axes of the cell (shorter than 1 if a
// slice removed a component), `extent` from tail to head in world units.
// On a curved lattice the components are along the edges of the cell.
struct DrawnVector {
  double magnitude = 0;  // magnitude of the data
  double rise = 0;       // from tail to head along the vertical of the cell, before a slice
  Vec unit{};
  Vec extent{};
};
// Empty if masked, below min_magnitude or without a direction.
std::optional<DrawnVector> read_vector(const scene::Scene& scene, const scene::VectorLayer& layer,
                                       const KernelPosition& position);

// A projected line: ends in camera space (right, down, forward) and in pixels, q at both ends (-1/2
// at the tail of the unclipped line, 1/2 at its head), linear colour, not premultiplied.
template <class Real>
struct BasicRibbon {
  std::array<Real, 3> a{}, b{};
  Real x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  Real q0 = 0, q1 = 0;
  std::array<Real, 3> color{};
  Real r1 = 0, r2 = 0, opacity = 0, desaturation = 0;
  scene::LineMark mark;
  bool perspective = false;
  bool moving = false;
  Real phase = 0;
  // A segment of a curved line: it has the pixels p with cut . (p - start) >= 0 and
  // end . (p - end of the line) < end_most.
  // Its light at both ends, and the part of the whole line before it and within it, are of the
  // whole line.
  bool chained = false;
  Real whole = 0, whole_rise = 1;
  // Dashes at both ends, of a line with dashes.
  bool dashed = false;
  Real turn0 = 0, turn1 = 0;
  std::array<Real, 2> cut{}, end{};
  Real end_most = 1;
};
using Ribbon = BasicRibbon<double>;

// A ribbon at pixel (x, y); opacity 0 if it does not cover the pixel.
template <class Real>
struct RibbonHit {
  Real opacity = 0;
  Real depth = 0;
  std::array<Real, 3> color{};
};

// Opacities of a marked line over that of its middle, with r1 < r2: without and with its halo.
template <class Real>
struct MarkCover {
  Real line = 0;
  Real whole = 0;
};

// A shape of width 2 `half` at the signed distance `inside` its edge, over a ramp of width `edge`.
template <class Real>
MarkCover<Real> cover_within(Real inside, Real half, Real halo, Real edge) {
  const auto at = [&](Real wider) {
    const Real most = std::clamp(2 * (half + wider) / edge, Real(0), Real(1));
    return std::clamp(Real(0.5) + (inside + wider) / edge, Real(0), most);
  };
  return {at(0), at(halo)};
}

// Pixel (px, py) from the tail of a line along (ux, uy); w is the nearest position along it.
template <class Real>
MarkCover<Real> mark_cover(const BasicRibbon<Real>& line, Real px, Real py, Real w) {
  const Real ux = line.x1 - line.x0;
  const Real uy = line.y1 - line.y0;
  const Real length = std::hypot(ux, uy);
  const Real edge = std::max(line.r2 - line.r1, Real(1e-6));
  const Real middle = (line.r1 + line.r2) / 2;
  const Real halo = static_cast<Real>(line.mark.halo);
  const Real most = length / (4 * std::max(line.whole_rise, Real(1e-6)));
  const Real change = std::clamp(
      static_cast<Real>(scene::narrowing(line.mark, static_cast<double>(middle))), -most, most);
  const bool arrow = line.mark.shape == scene::LineShape::arrow && line.mark.head_length > 0;
  const Real head = arrow ? std::min(static_cast<Real>(line.mark.head_length), length / 2) : 0;
  const Real least = Real(1e-6) * line.r2;
  const Real at = std::min(w, 1 - head / std::max(length, least));
  const Real half = middle + change * (1 - 2 * (line.whole + at * line.whole_rise));
  MarkCover<Real> cover =
      cover_within(half - std::hypot(px - at * ux, py - at * uy), half, halo, edge);
  if (!(head > 0) || length <= least) return cover;
  const Real slope = static_cast<Real>(line.mark.head_width / line.mark.head_length / 2);
  const Real cosine = 1 / std::hypot(Real(1), slope);
  const Real from_point = length - (px * ux + py * uy) / length;
  const Real across = std::abs(px * uy - py * ux) / length;
  const Real inside = std::min(std::min(cosine * (slope * from_point - across), from_point),
                               std::min(head - from_point, slope * head - across));
  const auto tip = cover_within(inside, cosine * slope * from_point, halo, edge);
  return {std::max(cover.line, tip.line), std::max(cover.whole, tip.whole)};
}

// W(frac(turns)), averaged over a pixel along the line; docs/design/rendering-model.md.
template <class Real>
Real mean_dash(const BasicRibbon<Real>& line, Real f) {
  const Real pixels = std::hypot(line.x1 - line.x0, line.y1 - line.y0);
  const Real turns = line.turn1 - line.turn0;
  const Real blur = std::clamp(std::abs(turns) / (2 * std::max(pixels, Real(1e-6) * line.r2)),
                               Real(1e-3), Real(8));
  const auto integral = [](Real p) {
    const Real whole = std::floor(p);
    const Real part = p - whole;
    return whole / 2 + (part < Real(0.5) ? part * part : 2 * part - part * part - Real(0.5));
  };
  const Real at = line.turn0 + f * turns;
  return (integral(at + blur) - integral(at - blur)) / (2 * blur);
}

template <class Real>
RibbonHit<Real> hit_ribbon(const BasicRibbon<Real>& line, Real x, Real y) {
  const Real ux = line.x1 - line.x0;
  const Real uy = line.y1 - line.y0;
  const Real px = x - line.x0;
  const Real py = y - line.y0;
  const Real eps = Real(1e-6) * line.r2;
  const Real w = Real(0.5) + std::clamp(((px - ux / 2) * ux + (py - uy / 2) * uy) /
                                            std::max(ux * ux + uy * uy, eps * eps),
                                        Real(-0.5), Real(0.5));
  const Real distance = std::hypot(px - w * ux, py - w * uy);
  RibbonHit<Real> hit;
  if (line.chained) {
    if (line.cut[0] * px + line.cut[1] * py < 0) return hit;
    const Real ex = x - line.x1;
    const Real ey = y - line.y1;
    if (line.end[0] * ex + line.end[1] * ey >= line.end_most) return hit;
  }
  Real light = 1;
  if (!line.mark.plain()) {
    const MarkCover<Real> cover = mark_cover(line, px, py, w);
    if (!(cover.whole > 0)) return hit;
    hit.opacity = line.opacity * cover.whole;
    light = cover.line / cover.whole;
  } else {
    if (distance >= line.r2) return hit;
    hit.opacity =
        line.opacity * (distance <= line.r1 ? Real(1) : (line.r2 - distance) / (line.r2 - line.r1));
  }
  Real f = w;
  if (line.perspective) {
    const Real inverse_z = (1 - w) / line.a[2] + w / line.b[2];
    f = w / line.b[2] / inverse_z;
  }
  const Real q = line.q0 + f * (line.q1 - line.q0);
  hit.depth = line.a[2] + f * (line.b[2] - line.a[2]);
  if (line.moving && line.dashed) {
    hit.opacity *= mean_dash(line, f);
  } else if (line.moving) {
    const Real turn = q + Real(0.5) - line.phase;
    hit.opacity *= 1 - std::abs(2 * (turn - std::floor(turn)) - 1);
  }
  const Real top = std::max({line.color[0], line.color[1], line.color[2]});
  const auto lit = [&](int c, Real at) {
    return line.color[c] + line.desaturation * (at + Real(0.5)) * (top - line.color[c]);
  };
  const auto dark = static_cast<Real>(1 - line.mark.tail_light);
  for (int c = 0; c < 3; ++c) {
    if (line.chained) {
      // Linear between the ends of the segment, each with the light of the whole line there.
      const Real tail = (1 - dark * (1 - line.whole)) * lit(c, line.q0);
      const Real head = (1 - dark * (1 - line.whole - line.whole_rise)) * lit(c, line.q1);
      hit.color[c] = light * (tail + f * (head - tail));
      continue;
    }
    hit.color[c] = light * (lit(c, q) - dark * (1 - f) * lit(c, line.q0));
  }
  return hit;
}

// The ribbon of a kernel position; empty if masked, below min_magnitude, without a direction,
// outside the kernel box or in front of the near plane. On a curved lattice the components of a
// vector are along the edges of the cell.
std::optional<Ribbon> make_ribbon(const scene::Scene& scene, const View& view,
                                  const scene::VectorLayer& layer, const KernelPosition& position);

// rho per world unit and linear colour, not premultiplied, of all layers together; rho 0: no splat.
struct Density {
  double rho = 0;
  Vec color{};
};
Density make_density(const scene::Scene& scene,
                     const std::vector<const scene::ScalarLayer*>& layers,
                     const KernelPosition& position);

// Extinction of a value, at most 1e30. At a step, that of the second point.
double table_extinction(const scene::ScalarLayer& layer, double value);
// The straight linear colour of a value.
Vec table_color(const scene::ColorTable& table, double value);

// Bounding box on the screen, in pixels.
struct ScreenBox {
  double x0 = 0, x1 = 0, y0 = 0, y1 = 0;
};
// Whether a splat, the ellipsoid of radius 1.37 cells, reaches beyond the near plane.
bool lies_beyond_near(const View& view, const KernelPosition& position);
// Bounding box of the silhouette of a splat that reaches beyond the near plane; the whole screen if
// it reaches the plane of the eye.
ScreenBox splat_box(const View& view, const KernelPosition& position);
ScreenBox ribbon_box(const Ribbon& line);

// A splat in the form that rays are intersected with.
struct Splat {
  Vec from_eye{};
  std::array<Vec, 3> inverse{};
  double rho = 0;
  Vec color{};
};

struct Kernels {
  std::vector<Splat> splats;
  std::vector<ScreenBox> splat_boxes;
  std::vector<Ribbon> ribbons;
};
// Appends the segments of the layer's streamlets.
void list_chains(const scene::Scene& scene, const View& view, const scene::VectorLayer& layer,
                 Kernels& kernels);
// The list is incomplete after cancellation.
Kernels list_kernels(const scene::Scene& scene, const View& view, const CancelToken& cancel = {});
// The same, appended to `kernels`; vectors with sufficient capacity do not reallocate.
void list_kernels(const scene::Scene& scene, const View& view, const CancelToken& cancel,
                  Kernels& kernels);
// Upper bounds of the numbers of kernels of a scene, from any viewpoint.
struct KernelBounds {
  std::uint64_t splats = 0;
  std::uint64_t ribbons = 0;
};
KernelBounds kernel_bounds(const scene::Scene& scene);

}  // namespace windsplat::engine::reference
