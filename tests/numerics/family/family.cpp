// Formulas of the family and its random views.
#include "tests/numerics/family/family.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/place.hpp"

namespace windsplat::test {
namespace {

using Index = std::array<int, 3>;

constexpr double circle = 6.283185307179586;
constexpr Values masked_values{
    {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN(),
     std::numeric_limits<double>::quiet_NaN()},
    std::numeric_limits<double>::quiet_NaN()};

double clamped(double v) { return std::clamp(v, 0.0, 1.0); }

TrialFormula spectrum(int finest, double decay, double cover, std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    Values out;
    for (std::uint32_t c = 0; c < 3; ++c) {
      out.flow[c] = 10 * turbulence(at, finest, decay, salt + 100 * c + 1);
    }
    out.cloud = clamped(cover + turbulence(at, finest, decay, salt + 900));
    return out;
  };
}

TrialFormula noise_in(double share, std::uint32_t salt) {
  return [=](const Point&, const Index& i) {
    Values out;
    for (std::uint32_t c = 0; c < 3; ++c) out.flow[c] = 10 * hashed(i[0], i[1], i[2], salt + c);
    const double drop = 0.5 + 0.5 * hashed(i[0], i[1], i[2], salt + 5);
    out.cloud = drop < share ? drop / share : 0;
    return out;
  };
}

TrialFormula plumes(int count, bool masks, std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    Values out;
    double core = 0;
    for (int n = 0; n < count; ++n) {
      const double bend = circle * (at[2] + hashed(n, 2, 0, salt));
      const double x = at[0] - 0.5 - (count > 1 ? 0.4 * hashed(n, 0, 0, salt) : 0) -
                       0.1 * std::cos(bend) * at[2];
      const double y = at[1] - 0.5 - (count > 1 ? 0.4 * hashed(n, 1, 0, salt) : 0) -
                       0.1 * std::sin(bend) * at[2];
      const double width = 0.05 + 0.1 * at[2];
      const double here = std::exp(-(x * x + y * y) / (width * width));
      core += here;
      out.flow[0] -= 10 * y / width * here;
      out.flow[1] += 10 * x / width * here;
      out.flow[2] += 6 * here;
    }
    if (masks && core < 1e-3) return masked_values;
    out.cloud = clamped(core * (1 + 0.5 * turbulence(at, 16, 0.7, salt + 7)));
    return out;
  };
}

TrialFormula front_across(const Point& normal, double width, std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    double across = 0.06 * std::sin(circle * (at[1] + at[2]));
    for (std::size_t a = 0; a < 3; ++a) across += normal[a] * (at[a] - 0.5);
    const double side = std::tanh(across / width);
    Values out;
    out.flow = {6 * side, 8 * normal[0] - 4 * normal[2], 2 * (1 - side * side)};
    out.cloud = (1 - side * side) * (0.6 + 0.4 * noise(at, 12, salt));
    return out;
  };
}

TrialFormula shells_of(double waves, double threshold) {
  return [=](const Point& at, const Index&) {
    const Point from{at[0] - 0.5, at[1] - 0.5, at[2] - 0.5};
    const double r = std::hypot(from[0], from[1], from[2]) + 1e-9;
    const double wave = std::sin(circle * waves * r);
    Values out;
    for (std::size_t c = 0; c < 3; ++c) out.flow[c] = 10 * wave * from[c] / r;
    out.cloud = wave > threshold ? 1 : 0;
    return out;
  };
}

// Sheets across an axis, each with its own direction of flow.
TrialFormula sheets_across(std::size_t axis, int thick, double share, std::uint32_t salt) {
  return [=](const Point& at, const Index& i) {
    const int sheet = i[axis] / thick;
    const double bearing = circle * hashed(sheet, 0, 0, salt);
    const double speed = 8 + 4 * noise(at, 6, salt + 1);
    Values out;
    out.flow[(axis + 1) % 3] = speed * std::sin(bearing);
    out.flow[(axis + 2) % 3] = speed * std::cos(bearing);
    const bool cloudy = 0.5 + 0.5 * hashed(sheet, 1, 0, salt + 2) < share;
    out.cloud = cloudy ? 0.6 + 0.4 * noise(at, 8, salt + 3) : 0;
    return out;
  };
}

TrialFormula vortices_of(int count, double radius_most, std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    Values out;
    for (int n = 0; n < count; ++n) {
      const double x = at[0] - 0.5 - (count > 1 ? 0.45 * hashed(n, 0, 0, salt) : 0);
      const double y = at[1] - 0.5 - (count > 1 ? 0.45 * hashed(n, 0, 0, salt + 1) : 0);
      const double radius = radius_most * (0.65 + 0.35 * hashed(n, 0, 0, salt + 2));
      const double fall = std::exp(-(x * x + y * y) / (radius * radius));
      out.flow[0] -= 30 * y / radius * fall;
      out.flow[1] += 30 * x / radius * fall;
      out.flow[2] += 5 * fall;
      out.cloud += fall;
    }
    out.cloud = std::min(out.cloud, 1.0);
    return out;
  };
}

// A boundary layer below jets; clouds in broken decks.
TrialFormula atmosphere(std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    Values out;
    const double jet = std::exp(-std::pow((at[2] - 0.75) / 0.12, 2));
    const double wave = std::sin(circle * (2 * at[0] + 0.3 * noise(at, 4, salt)));
    out.flow = {30 * jet * (0.6 + 0.4 * std::cos(circle * at[1])) + 5, 8 * jet * wave,
                0.2 * noise(at, 16, salt + 1)};
    const double deck = std::exp(-std::pow((at[2] - 0.3) / 0.05, 2)) +
                        0.5 * std::exp(-std::pow((at[2] - 0.8) / 0.08, 2));
    out.cloud = clamped(deck * 2 * (0.1 + turbulence(at, 16, 0.7, salt + 2)));
    return out;
  };
}

// Gyres that weaken with depth; land and the sea floor are masked.
TrialFormula ocean(std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    const double floor = 0.5 + turbulence({at[0], at[1], 0}, 8, 0.6, salt);
    if (at[2] < floor) return masked_values;
    const double depth = std::exp(3 * (at[2] - 1));
    Values out;
    out.flow = {depth * turbulence(at, 8, 0.8, salt + 1), depth * turbulence(at, 8, 0.8, salt + 2),
                0.01 * noise(at, 8, salt + 3)};
    out.cloud = clamped(0.5 * depth * (1 + noise(at, 4, salt + 4)));
    return out;
  };
}

Values uniform_fog(const Point& at, const Index&) {
  Values out;
  out.flow = {8, 3, 1 + 0.01 * at[2]};
  out.cloud = 0.7 + 0.001 * at[0];
  return out;
}

TrialFormula blocks(int count, std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    const auto of = [&](std::uint32_t c) {
      return hashed(static_cast<int>(at[0] * count), static_cast<int>(at[1] * count),
                    static_cast<int>(at[2] * count), salt + c);
    };
    return Values{{10 * of(0), 10 * of(1), 10 * of(2)}, of(3) > 0.3 ? 1.0 : 0.0};
  };
}

// Flow around balls of cloud.
TrialFormula balls(int count, std::uint32_t salt) {
  return [=](const Point& at, const Index&) {
    Values out;
    out.flow = {6, 0, 0};
    for (int n = 0; n < count; ++n) {
      Point from{};
      double square = 0;
      const auto seed = salt + static_cast<std::uint32_t>(n);
      for (std::size_t a = 0; a < 3; ++a) {
        from[a] = at[a] - 0.5 - 0.4 * hashed(n, static_cast<int>(a), 0, seed);
        square += from[a] * from[a];
      }
      const double radius = 0.08 + 0.05 * hashed(n, 3, 0, seed);
      const double near = std::exp(-square / (radius * radius));
      for (std::size_t a = 0; a < 3; ++a) out.flow[a] += 60 * near * from[a];
      if (square < radius * radius) out.cloud = 1;
    }
    return out;
  };
}

Values banded_jets(const Point& at, const Index&) {
  Values out;
  out.flow = {20 * std::sin(circle * 4 * at[1]), 3 * std::sin(circle * at[0]), 0};
  out.cloud = clamped(std::cos(circle * 4 * at[1]) * std::sin(0.5 * circle * at[2]));
  return out;
}

// Falls with the square of the distance from two charges.
Values charges(const Point& at, const Index&) {
  Values out;
  double potential = 0;
  for (const int sign : {-1, 1}) {
    const Point from{at[0] - 0.5 - 0.2 * sign, at[1] - 0.5, at[2] - 0.5 + 0.1 * sign};
    const double r = std::hypot(from[0], from[1], from[2]) + 0.03;
    for (std::size_t a = 0; a < 3; ++a) out.flow[a] += sign * from[a] / (r * r * r);
    potential += 1 / r;
  }
  out.cloud = clamped(0.04 * potential);
  return out;
}

}  // namespace

std::vector<FamilyMember> family(std::uint32_t seed) {
  const std::uint32_t s = 100000 * seed;
  const Point cube{1e3, 1e3, 1e3};
  std::vector<FamilyMember> out;
  const auto add = [&out](const char* name, const Index& dims, const Point& extent,
                          TrialFormula formula) {
    out.push_back({{name, dims, extent}, std::move(formula)});
  };
  add("smooth flow", {32, 32, 32}, cube, spectrum(2, 0.5, 0.3, s + 11000));
  add("steep turbulence", {32, 32, 32}, cube, spectrum(16, 0.4, 0.3, s + 12000));
  add("turbulence", {40, 40, 40}, cube, spectrum(32, 0.63, 0.1, s + 13000));
  add("flat spectrum", {32, 32, 32}, cube, spectrum(16, 0.95, 0, s + 14000));
  add("turbulence in a column", {16, 16, 96}, {1e3, 1e3, 6e3}, spectrum(16, 0.7, 0.3, s + 15000));
  add("white noise", {24, 24, 24}, cube, noise_in(1, s + 1600));
  add("sparse noise", {40, 40, 40}, cube, noise_in(0.03, s + 1700));
  add("plume", {24, 24, 48}, {1e3, 1e3, 2e3}, plumes(1, true, s + 1800));
  add("plumes", {40, 40, 24}, {4e3, 4e3, 2e3}, plumes(9, false, s + 1900));
  add("front", {48, 32, 16}, {2e5, 1e5, 1e4}, front_across({1, 0, 0}, 0.02, s + 20));
  add("oblique front", {36, 36, 24}, {1e4, 1e4, 5e3}, front_across({0.7, 0.3, 0.6}, 0.06, s + 21));
  add("shells", {36, 36, 36}, cube, shells_of(7, 0.7));
  add("thick shells", {28, 28, 28}, cube, shells_of(2, 0));
  add("level sheets", {32, 32, 40}, cube, sheets_across(2, 2, 0.3, s + 22));
  add("upright sheets", {40, 32, 24}, cube, sheets_across(0, 4, 0.5, s + 23));
  add("sparse vortices", {48, 48, 16}, {4e3, 4e3, 1e3}, vortices_of(12, 0.05, s + 24));
  add("vortex", {32, 32, 32}, cube, vortices_of(1, 0.3, s + 25));
  add("atmosphere", {48, 40, 20}, {1e5, 1e5, 2e3}, atmosphere(s + 2600));
  add("tall atmosphere", {24, 24, 40}, {1e4, 1e4, 1e4}, atmosphere(s + 2700));
  add("ocean", {48, 40, 12}, {1e6, 8e5, 4e3}, ocean(s + 2800));
  add("needle", {8, 8, 160}, {1e2, 1e2, 2e3}, spectrum(32, 0.7, 0.3, s + 29000));
  add("pancake", {96, 96, 4}, {1e4, 1e4, 400}, spectrum(32, 0.8, 0.2, s + 30000));
  add("uniform fog", {24, 24, 24}, cube, uniform_fog);
  add("blocks", {36, 36, 36}, cube, blocks(6, s + 31));
  add("balls", {36, 36, 36}, cube, balls(20, s + 3200));
  add("banded jets", {48, 24, 24}, {2e3, 1e3, 1e3}, banded_jets);
  return out;
}

std::vector<FamilyMember> strangers() {
  std::vector<FamilyMember> out;
  out.push_back({{"charges", {30, 30, 30}, {1e3, 1e3, 1e3}}, charges});
  out.push_back({{"long blocks", {40, 28, 20}, {2e3, 1e3, 1e3}}, blocks(3, 990)});
  out.push_back({{"many vortices", {44, 44, 20}, {2e3, 2e3, 1e3}}, vortices_of(40, 0.08, 991)});
  return out;
}

protocol::View random_view(data::Dataset& dataset, std::uint32_t scene, std::uint32_t viewpoint,
                           int width_most) {
  std::mt19937 of_scene(1000 + scene);
  std::mt19937 of_view(5000 + 1000 * scene + viewpoint);
  const auto uniform = [](std::mt19937& random, double low, double high) {
    return low + (high - low) * random() / 4294967296.0;
  };
  const auto logarithmic = [&](std::mt19937& random, double low, double high) {
    return std::exp(uniform(random, std::log(low), std::log(high)));
  };
  enum Content { lines, medium, both };
  const auto content = static_cast<Content>(scene % 3);
  protocol::View view;
  view.dataset = dataset.info().id;
  view.scalars.emplace();
  if (content != lines) view.scalars->emplace_back().field = "cloud";
  if (content == medium) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view.image.width = static_cast<int>(logarithmic(of_view, 160, width_most));
  view.image.height = static_cast<int>(view.image.width * uniform(of_view, 0.56, 0.8));
  auto completed = scene::complete(view, dataset);
  if (!completed) throw std::runtime_error(completed.error().message);
  view = completed->view();
  scene::orbit(view, completed->lattice(), uniform(of_view, 0, 360), uniform(of_view, -20, 80),
               logarithmic(of_view, 0.6, 4));
  if (content != medium) {
    protocol::VectorView& vector = view.vector;
    vector.r2 = logarithmic(of_scene, 0.7, 5);
    vector.r1 = 0.43 * vector.r2;
    vector.opacity = uniform(of_scene, 0.3, 1);
    *vector.length *= logarithmic(of_scene, 0.5, 2.5);
    vector.min_magnitude = uniform(of_scene, 0, 0.4) * (*vector.magnitude_range)[1];
  }
  const double density = logarithmic(of_scene, 0.1, 20);
  if (content != medium && uniform(of_scene, 0, 1) < 0.5) {  // dense short lines
    *view.vector.length /= *view.vector.stride;
    view.vector.stride = 1;
  }
  for (protocol::ScalarView& layer : *view.scalars) {
    for (auto& point : *layer.extinction) point[1] *= density;
  }
  completed = scene::complete(view, dataset);
  if (!completed) throw std::runtime_error(completed.error().message);
  return completed->view();
}

}  // namespace windsplat::test
