// By the distances that docs/design/rendering-model.md gives under "Marks".
#include "server/study/truth/integrator_marks.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace windsplat::truth {

namespace {

using scene::LineShape;

// A strip of half width h, or a piece of a shape of that half width across, averaged over a box of
// the width of the ramp whose middle lies s inside the edge.
Real averaged(Real s, Real h, Real ramp_width) {
  const Real share = std::clamp(s / ramp_width + 0.5L, Real(0), Real(1));
  return std::min(share, std::clamp(2 * h / ramp_width, Real(0), Real(1)));
}

struct Widths {
  Real tail = 0, head = 0;  // half widths
};

Widths half_widths(const scene::VectorLayer& layer, Real length_px) {
  const Real mean = (static_cast<Real>(layer.r1) + static_cast<Real>(layer.r2)) / 2;
  const Real change = std::min(mean, length_px / 4);
  if (layer.mark.shape == LineShape::taper) return {mean + change, mean - change};
  return {mean, mean};
}

}  // namespace

MarkShare mark_share(const scene::VectorLayer& layer, const Vec& u, const Vec& p, Real w) {
  const Real long_px = length(u);
  const Real ramp_width = std::max(static_cast<Real>(layer.r2) - layer.r1, Real(1e-6L));
  const Real halo = layer.mark.halo;
  const Widths widths = half_widths(layer, long_px);
  const bool dot_like = long_px <= 1e-6L * layer.r2;
  const bool arrow = layer.mark.shape == LineShape::arrow && layer.mark.head_length > 0;
  const Real head = arrow && !dot_like ? std::min(Real(layer.mark.head_length), long_px / 2) : 0;
  const Real shaft = dot_like ? 1 : 1 - head / long_px;
  const Real at = std::min(w, shaft);
  const Real half = (1 - at) * widths.tail + at * widths.head;
  const Real inside = half - length(p - at * u);
  MarkShare share{averaged(inside, half, ramp_width),
                  averaged(inside + halo, half + halo, ramp_width)};
  if (head <= 0) return share;
  const Vec ahead = (1 / long_px) * u;
  const Real ahead_px = dot(p, ahead);
  const Real beside_px = length(p - ahead_px * ahead);
  const Real base_half = head * layer.mark.head_width / (2 * layer.mark.head_length);
  const Real slanted = std::hypot(head, base_half);  // length of a slanted edge
  const Real back = long_px - ahead_px;              // from the point
  const std::array<Real, 4> edges{(base_half * back - head * beside_px) / slanted, back,
                                  head - back, base_half - beside_px};
  const Real nearest = *std::min_element(edges.begin(), edges.end());
  const Real across = base_half * back / slanted;
  share.lit = std::max(share.lit, averaged(nearest, across, ramp_width));
  share.with_halo = std::max(share.with_halo, averaged(nearest + halo, across + halo, ramp_width));
  return share;
}

}  // namespace windsplat::truth
