// The generated scenes: samples, formulas and the views of them.
#include "tests/bench/scenes/scene_set.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/place.hpp"
#include "tests/bench/support.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::bench {
namespace {

using Dims = std::array<int, 3>;
using test::Point;
using test::Values;
using Open = std::function<std::unique_ptr<data::Dataset>(int)>;

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

Dims reduced(Dims dims, int reduction) {
  for (int& side : dims) side = std::max(side / reduction, 2);
  return dims;
}

Open sample(const char* name, const Dims& dims) {
  return [=](int reduction) {
    constexpr std::uint64_t bytes_max = std::uint64_t{4} << 30U;
    return std::make_unique<data::Dataset>(
        value_or_give_up(data::open_sample(name, reduced(dims, reduction), 1)), name, bytes_max);
  };
}

Open formula(const char* name, const Dims& dims, const std::array<double, 3>& extent_m,
             const std::function<Values(const Point&)>& values, bool terrain = false) {
  return [=](int reduction) {
    return test::formula_dataset({name, reduced(dims, reduction), extent_m, terrain},
                                 [=](const Point& at, const Dims&) { return values(at); });
  };
}

Values eddies(const Point& at, int finest, double cover) {
  Values out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    out.flow[c] = 10 * test::turbulence(at, finest, 0.7, 100 * c + 51);
  }
  out.cloud = std::clamp(cover + test::turbulence(at, finest, 0.7, 951), 0.0, 1.0);
  return out;
}

// Smoke that drifts over hills and rises; the levels follow the ground and thin out above it.
Values plume_over_hills(const Point& at) {
  const double ground = 400 * (1 + test::turbulence({at[0], at[1], 0}, 8, 0.5, 71));
  Values out;
  out.height = ground + 3000 * at[2] * (0.3 + 0.7 * at[2]);
  const double down_wind = std::max(at[0] - 0.1, 0.0);
  const double width = 0.03 + 0.25 * down_wind;
  const double y = (at[1] - 0.5) / width;
  const double z = (at[2] - 0.15 - 0.6 * down_wind) / width;
  const double core = at[0] > 0.1 ? std::exp(-y * y - z * z) : 0;
  out.cloud = std::clamp(core * (1 + 0.7 * test::turbulence(at, 32, 0.7, 72)), 0.0, 1.0);
  out.flow = {8 * (0.2 + at[2]), 2 * test::noise(at, 12, 73),
              4 * core + 1.5 * test::noise(at, 8, 74)};
  return out;
}

// Land and sea floor are masked; currents weaken with depth.
Values ocean(const Point& at) {
  if (at[2] < 0.4 + test::turbulence({at[0], at[1], 0}, 16, 0.6, 81)) {
    return {{no_value, no_value, no_value}, no_value};
  }
  const double depth = std::exp(3 * (at[2] - 1));
  Values out;
  out.flow = {depth * test::turbulence(at, 32, 0.8, 82), depth * test::turbulence(at, 32, 0.8, 83),
              0.01 * test::noise(at, 16, 84)};
  out.cloud = std::clamp(0.5 * depth * (1 + test::noise(at, 6, 85)), 0.0, 1.0);
  return out;
}

// Waves of different lengths along each axis, positive in most of the cube.
Values waves(const Point& at) {
  Values out;
  const double sum = std::sin(23 * at[0] + 3 * at[1]) + std::sin(31 * at[1] + 5 * at[2]) +
                     std::sin(41 * at[2] + 7 * at[0]);
  out.cloud = std::clamp(0.45 + 0.25 * sum, 0.0, 1.0);
  return out;
}

// Extinctions that begin at the quantile above which that share of the samples lies, so small that
// no sample hides another.
void cover(double share, data::Dataset& dataset, protocol::ScalarView& layer) {
  const auto volume = value_or_give_up(dataset.volume(layer.field, 0));
  std::vector<float> values(volume->component(0), volume->component(0) + volume->samples());
  std::erase_if(values, [](float v) { return std::isnan(v); });
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(
                                        (1 - share) * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  const double top = 0.1 * (*layer.extinction).back()[1];
  layer.extinction = {{{double{*nth}, 0.0}, {double{volume->range[1]}, top}}};
}

}  // namespace

std::vector<GeneratedScene> generated_scenes(int side) {
  const std::vector<Content> all{Content::lines, Content::medium, Content::both};
  protocol::GeometryView terrain;
  terrain.height_field = "height";
  protocol::GeometryView globe;
  globe.mapping = protocol::GeometryMapping::sphere;
  protocol::GeometryView raised;
  raised.scale[2] = 40;
  const bool small = side <= 128;
  std::vector<GeneratedScene> out;
  out.push_back({"cloudy climate", all, sample("climate", {320, 160, 19}), {}, true, 1.0 / 3});
  out.push_back({"turbulence 128^3", all,
                 formula("turbulence", {128, 128, 128}, {1e3, 1e3, 1e3},
                         [](const Point& at) { return eddies(at, 64, 0.2); })});
  out.push_back({"eddies in flat cells", all,
                 formula("eddies", {192, 192, 64}, {1.2e4, 1.2e4, 1e3},
                         [](const Point& at) { return eddies(at, 64, -0.2); })});
  out.push_back({"plume over terrain", all,
                 formula("plume", {128, 96, 40}, {2e4, 1.5e4, 3e3}, plume_over_hills, true),
                 terrain});
  out.push_back(
      {"masked ocean", all, formula("ocean", {256, 192, 30}, {1e6, 8e5, 4e3}, ocean), raised});
  out.push_back(
      {"sparse tornado", all, sample("tornado", {side, side, side}), {}, false, 0, small});
  out.push_back({"dense scalar",
                 {Content::medium},
                 formula("waves", {side, side, side}, {1e3, 1e3, 1e3}, waves),
                 {},
                 false,
                 0,
                 small});
  out.push_back({"globe", all, sample("climate", {320, 160, 19}), globe});
  return out;
}

scene::CompletedView completed_view_of(const GeneratedScene& scene, data::Dataset& dataset,
                                       Content content, const Size& size,
                                       protocol::MethodName method, protocol::Detail detail) {
  protocol::View view;
  view.dataset = dataset.info().id;
  view.geometry = scene.geometry;
  view.image.width = size.width;
  view.image.height = size.height;
  if (content == Content::medium) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view.scalars.emplace();
  if (content != Content::lines) view.scalars->emplace_back().field = "cloud";
  auto completed = value_or_give_up(scene::complete(view, dataset));
  view = completed.view();
  scene::orbit(view, completed.lattice(), 20, 35, 1);
  view.method.name = method;
  view.method.detail = detail;
  if (scene.every_line && view.vector.magnitude_range) {
    view.vector.min_magnitude = 1e-3 * (*view.vector.magnitude_range)[1];
  }
  if (scene.cloudy_share > 0) {
    for (protocol::ScalarView& layer : *view.scalars) cover(scene.cloudy_share, dataset, layer);
  }
  return value_or_give_up(scene::complete(view, dataset));
}

scene::Scene scene_of(const GeneratedScene& scene, data::Dataset& dataset, Content content,
                      const Size& size, protocol::MethodName method) {
  const auto completed =
      completed_view_of(scene, dataset, content, size, method, protocol::Detail::full);
  return value_or_give_up(scene::build_scene(completed, dataset));
}

}  // namespace windsplat::bench
