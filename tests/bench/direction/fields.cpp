#include "tests/bench/direction/fields.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>

#include "server/data/open/open.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::bench {
namespace {

using test::Point;
using Vector = std::array<double, 3>;

// Positions from -1 to 1.
using Flow = Vector (*)(double x, double y, double z);

constexpr double pi = std::numbers::pi;

// Learning.

Vector helix(double x, double y, double z) {
  return {std::cos(3 * z) - 0.4 * y, std::sin(3 * z) + 0.4 * x, 0.4};
}

Vector noise(double x, double y, double z) {
  const Point at{(x + 1) / 2, (y + 1) / 2, (z + 1) / 2};
  Vector out{};
  for (std::uint32_t c = 0; c < 3; ++c) out.at(c) = test::turbulence(at, 4, 0.6, 100 * c + 7);
  return out;
}

// Arnold, Beltrami and Childress, with A = B = C.
Vector abc(double x, double y, double z) {
  return {std::sin(pi * z) + std::cos(pi * y), std::sin(pi * x) + std::cos(pi * z),
          std::sin(pi * y) + std::cos(pi * x)};
}

// Rankine: solid rotation within the core, potential flow beyond; rising along its axis.
Vector rankine(double x, double y, double /*z*/) {
  constexpr double core = 0.4;
  const double r = std::hypot(x, y);
  const double spin = r < core ? 1 / core : core / std::max(r * r, 1e-12);
  return {-spin * y, spin * x, 0.3 * std::exp(-r * r / (core * core))};
}

// The field of a point dipole along z, bounded at its place.
Vector dipole(double x, double y, double z) {
  const double r2 = x * x + y * y + z * z + 0.04;
  const double scale = 1 / std::pow(r2, 1.5);
  return {scale * 3 * z * x / r2, scale * 3 * z * y / r2, scale * (3 * z * z / r2 - 1)};
}

Vector shear(double x, double /*y*/, double z) {
  return {std::tanh(3 * z), 0.25 * std::sin(3 * x), 0};
}

// Judging.

// Taylor and Green: eight cells with a saddle in each face.
Vector taylor_green(double x, double y, double z) {
  return {std::sin(pi * x) * std::cos(pi * y) * std::cos(pi * z),
          -std::cos(pi * x) * std::sin(pi * y) * std::cos(pi * z),
          0.3 * std::cos(pi * x) * std::cos(pi * y) * std::sin(pi * z)};
}

// Lorenz (sigma 10, rho 28, beta 8/3): a saddle between two spirals.
Vector lorenz(double x, double y, double z) {
  const double u = 20 * x;
  const double v = 25 * y;
  const double w = 25 * (z + 1);
  return {10 * (v - u) / 20, (u * (28 - w) - v) / 25, (u * v - 8.0 / 3 * w) / 25};
}

// Hill: a ring of closed lines in a sphere of radius 0.7, potential flow around it.
Vector hill(double x, double y, double z) {
  constexpr double a = 0.7;
  const double r2 = x * x + y * y + z * z;
  if (r2 < a * a) {
    const double s = 1.5 / (a * a);
    return {s * x * z, s * y * z, s * (a * a - 2 * (x * x + y * y) - z * z)};
  }
  const double q = a * a * a / (2 * std::pow(r2, 2.5));
  return {3 * q * x * z, 3 * q * y * z, q * (3 * z * z - r2) - 1};
}

// Burgers: a vortex that strain draws out along x.
Vector burgers(double x, double y, double z) {
  const double r2 = std::max(y * y + z * z, 1e-9);
  const double spin = 0.5 * (1 - std::exp(-r2 / 0.08)) / r2;
  return {0.8 * x, -0.4 * y - spin * z, -0.4 * z + spin * y};
}

// Stuart: a row of cat's eyes in a shear layer, weakly bent along y.
Vector stuart(double x, double y, double z) {
  const double u = pi * x + 0.5 * std::sin(pi * y);
  const double w = pi * z;
  const double d = std::cosh(w) - 0.6 * std::cos(u);
  return {std::sinh(w) / d, 0.2 * std::cos(pi * y), -0.6 * std::sin(u) / d};
}

// A source and two sinks.
Vector charges(double x, double y, double z) {
  constexpr std::array<std::array<double, 4>, 3> places{
      {{-0.5, -0.3, 0.2, 2}, {0.6, 0.1, 0.4, -1}, {0.1, 0.5, -0.6, -1}}};
  Vector out{};
  for (const auto& [px, py, pz, charge] : places) {
    const double r2 = std::pow(x - px, 2) + std::pow(y - py, 2) + std::pow(z - pz, 2) + 0.03;
    const double scale = charge / std::pow(r2, 1.5);
    out[0] += scale * (x - px);
    out[1] += scale * (y - py);
    out[2] += scale * (z - pz);
  }
  return out;
}

// Around and through a torus of radius 0.6.
Vector torus(double x, double y, double z) {
  const double r = std::max(std::hypot(x, y), 1e-6);
  const double out = r - 0.6;
  const double fall = std::exp(-(out * out + z * z) / 0.2);
  const Vector around{-y / r, x / r, 0};
  return {fall * (0.5 * around[0] - 3 * z * x / r), fall * (0.5 * around[1] - 3 * z * y / r),
          fall * 3 * out};
}

// Bickley: a jet along y that meanders and rises over a ridge.
Vector bickley(double x, double y, double z) {
  const double axis = 0.3 * std::sin(pi * y);
  const double c = std::cosh((x - axis) / 0.3);
  const double along = 1 / (c * c) + 0.1;
  return {along * 0.3 * pi * std::cos(pi * y), along, along * 0.4 * std::sin(pi * y) * (1 - z * z)};
}

struct Formula {
  const char* name;
  Flow flow;
  bool learnt;
};
constexpr std::array<Formula, 14> formulas{{{"helix", helix, true},
                                            {"noise", noise, true},
                                            {"ABC flow", abc, true},
                                            {"Rankine vortex", rankine, true},
                                            {"dipole", dipole, true},
                                            {"shear", shear, true},
                                            {"Taylor-Green", taylor_green, false},
                                            {"Lorenz", lorenz, false},
                                            {"Hill's vortex", hill, false},
                                            {"Burgers vortex", burgers, false},
                                            {"cat's eyes", stuart, false},
                                            {"charges", charges, false},
                                            {"torus", torus, false},
                                            {"jet", bickley, false}}};

}  // namespace

const std::vector<DirectionField>& formula_fields() {
  static const std::vector<DirectionField> fields = [] {
    std::vector<DirectionField> out;
    out.reserve(formulas.size());
    for (const Formula& one : formulas) out.push_back({one.name, one.learnt, false});
    return out;
  }();
  return fields;
}

std::unique_ptr<data::Dataset> dataset_of(const DirectionField& field, int side) {
  constexpr std::uint64_t bytes_max = std::uint64_t{1} << 30U;
  if (field.is_file) {
    return std::make_unique<data::Dataset>(value_or_give_up(data::open_file(field.name)),
                                           field.name, bytes_max);
  }
  const auto* const found = std::find_if(formulas.begin(), formulas.end(),
                                         [&](const Formula& f) { return f.name == field.name; });
  if (found == formulas.end()) give_up("no formula " + field.name);
  const test::TrialField made{field.name, {side, side, side}, {1000, 1000, 1000}};
  const auto formula = [flow = found->flow](const Point& at, const std::array<int, 3>& /*index*/) {
    test::Values out;
    out.flow = flow(2 * at[0] - 1, 2 * at[1] - 1, 2 * at[2] - 1);
    return out;
  };
  return test::formula_dataset(made, formula);
}

}  // namespace windsplat::bench
