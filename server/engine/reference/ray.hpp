// Integrates the light along one ray: a medium given as a function of depth, with surfaces (lines).
//
// A piece of the ray is integrated by Gauss quadrature; the optical depths at its nodes are
// computed from the same nodes (collocation). Nodes are graded quadratically towards breaks of the
// medium, because the splat kernel vanishes like distance^(3/2). A piece whose error bound is too
// large is bisected.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace windsplat::engine::reference {

constexpr int rule_nodes_max = 8;

// Nodes are in (0, 1) of a piece, excluding the ends; weights sum to 1.
struct Rule {
  int nodes = 0;
  std::array<double, rule_nodes_max> node{};
  std::array<double, rule_nodes_max> weight{};
  // [j][k]: weight of node k in the integral up to node j.
  std::array<std::array<double, rule_nodes_max>, rule_nodes_max> before{};
  // Weights of the last two Legendre coefficients of the integrand, which bound the error.
  std::array<std::array<double, rule_nodes_max>, 2> highest{};
};

// Which ends of a piece are breaks of the medium, as bits.
constexpr unsigned break_before = 1;
constexpr unsigned break_after = 2;

// The rule for each combination of breaks.
using Rules = std::array<Rule, 4>;

// 2 to 8 nodes; bisection by the error bound requires at least 4. With n nodes and no breaks the
// global error for a smooth medium is of order 2 n.
Rules make_rules(int nodes = 8);

// A medium at the nodes of a piece: extinction and emission (extinction times colour) per unit of
// depth.
struct Samples {
  std::array<double, rule_nodes_max> extinction{};
  std::array<std::array<double, rule_nodes_max>, 3> emission{};
};

// The light accumulated so far, front to back; premultiplied colour.
struct Light {
  std::array<double, 3> rgb{};
  double alpha = 0;
  double transmittance = 1;
};

// An infinitely thin, partly opaque surface across the ray: a line.
struct Surface {
  double depth = 0;
  double opacity = 0;
  std::array<double, 3> color{};
};

struct RayCount {
  std::int64_t pieces = 0;
  std::int64_t evaluations = 0;
};

// One piece of the medium in front of a black background. error: upper bound on |dI| + |dA|.
struct PieceLight {
  double alpha = 0;
  double transmitted = 1;
  std::array<double, 3> rgb{};
  double error = 0;
};
PieceLight piece_light(const Rule& rule, double length, const Samples& samples);

// Transmittance below which the rest of a ray is ignored.
constexpr double transmittance_least = 1e-16;

inline void cross_surface(const Surface& surface, Light& light) {
  const double seen = light.transmittance * surface.opacity;
  for (int c = 0; c < 3; ++c) light.rgb[c] += seen * surface.color[c];
  light.alpha += seen;
  light.transmittance *= 1 - surface.opacity;
}

// Integrates [from, to] with an error of about `tolerance`; if infinite, as one piece without
// bisection. medium(const double* depth, int count, Samples&) fills the first `count` samples.
template <class Medium>
void integrate_piece(const Rules& rules, const Medium& medium, double from, double to,
                     unsigned breaks, double tolerance, Light& light, RayCount& count) {
  const Rule& rule = rules[breaks];
  if (light.transmittance < transmittance_least) return;
  std::array<double, rule_nodes_max> depth{};
  for (int j = 0; j < rule.nodes; ++j) depth[j] = from + (to - from) * rule.node[j];
  Samples samples;
  medium(depth.data(), rule.nodes, samples);
  count.evaluations += rule.nodes;
  const PieceLight piece = piece_light(rule, to - from, samples);
  const double middle = 0.5 * (from + to);
  // Stops at the resolution of depths.
  const bool divisible = middle > from && middle < to;
  if (light.transmittance * piece.error > tolerance && divisible) {
    integrate_piece(rules, medium, from, middle, breaks & break_before, 0.5 * tolerance, light,
                    count);
    integrate_piece(rules, medium, middle, to, breaks & break_after, 0.5 * tolerance, light, count);
    return;
  }
  ++count.pieces;
  for (int c = 0; c < 3; ++c) light.rgb[c] += light.transmittance * piece.rgb[c];
  light.alpha += light.transmittance * piece.alpha;
  light.transmittance *= piece.transmitted;
}

// Integrates a whole ray, divided at `breaks` (depths where the medium begins, ends or is not
// smooth) and at `surfaces`; both ascend. medium.begin(from, to) is called before each piece, in
// ascending order.
template <class Medium>
Light integrate_ray(const Rules& rules, Medium& medium, const std::vector<double>& breaks,
                    const std::vector<Surface>& surfaces, double tolerance, RayCount& count) {
  Light light;
  const std::size_t cuts = breaks.size() + surfaces.size();
  const double share = tolerance / static_cast<double>(std::max<std::size_t>(cuts, 1));
  std::size_t b = 0;
  std::size_t s = 0;
  double from = 0;
  bool after_surface = false;
  for (std::size_t done = 0; done < cuts; ++done) {
    const bool surface =
        s < surfaces.size() && (b == breaks.size() || surfaces[s].depth <= breaks[b]);
    const double to = surface ? surfaces[s].depth : breaks[b];
    // There is no medium before the first break or after the last one.
    if (b > 0 && b < breaks.size() && to > from) {
      medium.begin(from, to);
      const unsigned ends = (after_surface ? 0 : break_before) | (surface ? 0 : break_after);
      integrate_piece(rules, medium, from, to, ends, share, light, count);
    }
    if (light.transmittance < transmittance_least) break;
    if (surface) {
      cross_surface(surfaces[s++], light);
    } else {
      ++b;
    }
    after_surface = surface;
    from = to;
  }
  return light;
}

}  // namespace windsplat::engine::reference
