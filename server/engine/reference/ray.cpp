// The quadrature of one piece: samples -> light and its error bound.
#include "server/engine/reference/ray.hpp"

#include <numbers>

#include "server/base/check.hpp"

namespace windsplat::engine::reference {

namespace {

// P_n and its derivative at x in [-1, 1].
struct Legendre {
  double value = 1;
  double slope = 0;
};

Legendre legendre(int n, double x) {
  if (n == 0) return {1, 0};
  double before = 1;
  double here = x;
  for (int k = 1; k < n; ++k) {
    const double next = ((2 * k + 1) * x * here - k * before) / (k + 1);
    before = here;
    here = next;
  }
  return {here, n * (x * here - before) / (x * x - 1)};
}

// Maps w in [0, 1] to a position in the piece, such that x^(3/2) at a break becomes smooth in w.
struct Grading {
  double at = 0;
  double slope = 0;
};

Grading graded(double w, unsigned breaks) {
  if (breaks == (break_before | break_after)) return {w * w * (3 - 2 * w), 6 * w * (1 - w)};
  if (breaks == break_before) return {w * w, 2 * w};
  if (breaks == break_after) return {w * (2 - w), 2 * (1 - w)};
  return {w, 1};
}

Rule make_rule(int nodes, unsigned breaks) {
  Rule rule;
  rule.nodes = nodes;
  std::array<double, rule_nodes_max> x{};  // in (-1, 1)
  std::array<double, rule_nodes_max> gauss{};
  for (int j = 0; j < nodes; ++j) {
    x[j] = -std::cos(std::numbers::pi * (j + 0.75) / (nodes + 0.5));
    for (int step = 0; step < 20; ++step) {
      const Legendre p = legendre(nodes, x[j]);
      x[j] -= p.value / p.slope;
    }
    const double slope = legendre(nodes, x[j]).slope;
    gauss[j] = 1 / ((1 - x[j] * x[j]) * slope * slope);
    const double w = 0.5 * (1 + x[j]);
    rule.node[j] = graded(w, breaks).at;
    rule.weight[j] = gauss[j] * graded(w, breaks).slope;
  }
  for (int k = 0; k < nodes; ++k) {
    // The interpolant that is 1 at node k and 0 at the others is
    // gauss_k sum_n (2 n + 1) P_n(x_k) P_n; the integral of (2 n + 1) P_n up to x is
    // P_{n+1} - P_{n-1}.
    for (int j = 0; j < nodes; ++j) {
      double sum = 0.5 * (1 + x[j]);
      for (int n = 1; n < nodes; ++n) {
        const double rise = legendre(n + 1, x[j]).value - legendre(n - 1, x[j]).value;
        sum += 0.5 * legendre(n, x[k]).value * rise;
      }
      rule.before[j][k] = gauss[k] * sum * graded(0.5 * (1 + x[k]), breaks).slope;
    }
    for (int m = 0; m < 2; ++m) {
      const int n = nodes - 1 - m;
      rule.highest[m][k] = (2 * n + 1) * rule.weight[k] * legendre(n, x[k]).value;
    }
  }
  return rule;
}

// Error bound of the quadrature of f. Gauss quadrature is exact up to twice the degree of
// interpolation, so its error is the square of the interpolation error where the coefficients decay
// geometrically, and otherwise of the same size.
double quadrature_error(const Rule& rule, const std::array<double, rule_nodes_max>& f) {
  constexpr double safety = 8;
  double last = 0;
  double before = 0;
  double most = 0;
  for (int j = 0; j < rule.nodes; ++j) {
    last += rule.highest[0][j] * f[j];
    before += rule.highest[1][j] * f[j];
    most = std::max(most, rule.weight[j] * std::abs(f[j]));
  }
  const double high = std::max(std::abs(last), std::abs(before));
  return high == 0 ? 0 : high * std::min(1.0, safety * high / most);
}

}  // namespace

Rules make_rules(int nodes) {
  WINDSPLAT_CHECK(nodes >= 2 && nodes <= rule_nodes_max);
  return {make_rule(nodes, 0), make_rule(nodes, 1), make_rule(nodes, 2), make_rule(nodes, 3)};
}

PieceLight piece_light(const Rule& rule, double length, const Samples& samples) {
  PieceLight piece;
  std::array<double, rule_nodes_max> seen{};  // transmittance down to each node
  double tau = 0;
  double densest = 0;
  int thick = 0;  // the node whose colour represents the piece
  for (int j = 0; j < rule.nodes; ++j) {
    tau += rule.weight[j] * samples.extinction[j];
    double front = 0;
    for (int k = 0; k < rule.nodes; ++k) front += rule.before[j][k] * samples.extinction[k];
    seen[j] = std::exp(-length * std::max(front, 0.0));
    if (samples.extinction[j] * seen[j] > densest) {
      densest = samples.extinction[j] * seen[j];
      thick = j;
    }
  }
  if (tau <= 0) return piece;
  tau *= length;
  piece.transmitted = std::exp(-tau);
  piece.alpha = -std::expm1(-tau);
  // An error of tau changes the absorbed fraction by e^-tau times as much.
  const double tau_error = length * quadrature_error(rule, samples.extinction);
  // Absorption between the nodes that the rule misses.
  double absorbed_at_nodes = 0;
  for (int j = 0; j < rule.nodes; ++j) {
    absorbed_at_nodes += length * rule.weight[j] * samples.extinction[j] * seen[j];
  }
  const double missed = std::abs(absorbed_at_nodes - piece.alpha);
  const bool resolved = missed < 0.1 * piece.alpha;
  const double absorbed_error = std::min(piece.transmitted * tau_error, 1.0);
  double brightest = 0;
  // Light of uniform colour is integrated exactly; the rule integrates only deviations from it.
  for (int c = 0; c < 3; ++c) {
    const auto& emission = samples.emission[c];
    const double dense = samples.extinction[thick];
    const double color = dense > 0 ? emission[thick] / dense : 0;
    std::array<double, rule_nodes_max> rest{};
    double sum = 0;
    double own_brightest = std::abs(color);
    double spread = 0;  // largest deviation of the colours of the piece from this one
    for (int j = 0; j < rule.nodes; ++j) {
      const double rho = samples.extinction[j];
      const double deviation = emission[j] - color * rho;
      rest[j] = deviation * seen[j];
      sum += rule.weight[j] * rest[j];
      if (rho > 0) {
        spread = std::max(spread, std::abs(deviation) / rho);
        own_brightest = std::max(own_brightest, std::abs(emission[j]) / rho);
      }
    }
    // Errors of tau also change the transmittances under the integral.
    const double by_tau = spread * piece.alpha * std::min(tau_error, 1.0);
    const double by_rule = length * quadrature_error(rule, rest) + by_tau + spread * missed;
    // Bound by the colours: if the nodes resolve the light, no mixture of them deviates more.
    const double by_color = (resolved ? 2.5 : 1) * spread * piece.alpha;
    piece.rgb[c] = color * piece.alpha + (resolved ? length * sum : 0);
    piece.error =
        std::max(piece.error, std::min(by_rule, by_color) + own_brightest * absorbed_error);
    brightest = std::max(brightest, own_brightest);
  }
  piece.error = std::max(piece.error, absorbed_error);
  // The error cannot fall below rounding; bisection would not terminate.
  constexpr double rounding = 1e-15;
  if (piece.error <= rounding * piece.alpha * std::max(brightest, 1.0)) piece.error = 0;
  return piece;
}

}  // namespace windsplat::engine::reference
