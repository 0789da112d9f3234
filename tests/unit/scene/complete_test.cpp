// Defaults and errors: completion of a view for a dataset, and named errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>

#include "server/data/samples/samples.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/defaults.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::ColorBy;
using protocol::FieldChoice;
using protocol::View;

std::unique_ptr<data::Dataset> cloudy_weather(std::shared_ptr<FakeSource::Reads> reads = nullptr) {
  return dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(),
      std::vector<data::FieldInfo>{scalar_info("temperature", "K"), wind_info(),
                                   scalar_info("cloud", "g kg-1")},
      3, std::move(reads)));
}

View completed(const View& view, data::Dataset& dataset) {
  auto full = complete(view, dataset);
  EXPECT_TRUE(full);
  return full->view();
}

// Every optional member of a view as text, for comparison.
std::string told(const View& view) {
  const auto vec = [](const protocol::Vec3& v) {
    return std::to_string(v[0]) + " " + std::to_string(v[1]) + " " + std::to_string(v[2]) + ";";
  };
  std::string out = view.dataset + vec(view.camera.eye.value()) + vec(view.camera.target.value()) +
                    std::to_string(view.camera.height.value()) + view.vector.field.name +
                    std::to_string(view.vector.length.value()) + " " +
                    std::to_string(view.vector.stride.value()) + " " +
                    std::to_string(static_cast<int>(view.vector.color.by.value())) +
                    std::to_string(view.vector.color.range.value()[0]) + " " +
                    std::to_string(view.vector.color.range.value()[1]) +
                    std::to_string(view.vector.magnitude_range.value()[1]) +
                    std::to_string(view.vector.min_magnitude.value());
  for (const protocol::ScalarView& scalar : view.scalars.value()) {
    out += scalar.field + scalar.color.map.value() + std::to_string(scalar.color.range.value()[1]);
    for (const auto& point : scalar.extinction.value()) {
      out += std::to_string(point[0]) + ":" + std::to_string(point[1]);
    }
  }
  return out;
}

TEST(CompleteView, FillsEverythingAndIsIdempotent) {
  for (const std::string& name : data::sample_names()) {
    auto dataset = sample_dataset(name, {24, 16, 12});
    const View full = completed(View{}, *dataset);
    EXPECT_EQ(full.dataset, name);
    EXPECT_EQ(full.vector.field.kind, FieldChoice::Kind::named);
    EXPECT_FALSE(full.scalars->empty()) << name;
    const std::uint64_t loads = dataset->loads();
    EXPECT_EQ(told(completed(full, *dataset)), told(full));
    EXPECT_EQ(dataset->loads(), loads);
  }
}

TEST(CompleteView, DefaultsFitTheSchema) {
  for (const std::string& name : data::sample_names()) {
    auto dataset = sample_dataset(name, {24, 16, 12});
    const View full = complete({}, *dataset)->view();
    EXPECT_GT(*full.vector.length, 0.0);
    EXPECT_LE(*full.vector.length, 10.0);
    EXPECT_LT((*full.vector.magnitude_range)[0], (*full.vector.magnitude_range)[1]);
    EXPECT_GE(*full.vector.min_magnitude, 0.0);
    EXPECT_LT(*full.vector.min_magnitude, (*full.vector.magnitude_range)[1]);
    EXPECT_LT((*full.vector.color.range)[0], (*full.vector.color.range)[1]);
    for (const protocol::ScalarView& scalar : *full.scalars) {
      EXPECT_TRUE(has_color_map(*scalar.color.map));
      EXPECT_LT((*scalar.color.range)[0], (*scalar.color.range)[1]);
      EXPECT_LE(scalar.extinction->size(), 64U);
      EXPECT_EQ(scalar.extinction->front()[1], 0.0);
      EXPECT_GT(scalar.extinction->back()[1], 0.0);
    }
  }
}

TEST(CompleteView, KeepsGivenValues) {
  auto dataset = cloudy_weather();
  View view;
  view.vector.length = 0.7;
  view.vector.magnitude_range = protocol::Range{1, 2};
  view.vector.min_magnitude = 0.25;
  view.vector.color.by = ColorBy::rise;
  view.vector.color.range = protocol::Range{-0.1, 0.3};
  view.camera.eye = protocol::Vec3{3, 1, 1};
  protocol::ScalarView scalar;
  scalar.field = "temperature";
  scalar.color.map = "ice";
  scalar.color.range = protocol::Range{300, 200};  // reversed intentionally
  scalar.extinction = {{200, 0}, {300, 5}};
  view.scalars = {scalar};
  const View full = completed(view, *dataset);
  EXPECT_EQ(full.vector.length, 0.7);
  EXPECT_EQ(full.vector.magnitude_range, (protocol::Range{1, 2}));
  EXPECT_EQ(full.vector.min_magnitude, 0.25);
  EXPECT_EQ(full.vector.color.range, (protocol::Range{-0.1, 0.3}));
  EXPECT_EQ(full.camera.eye, (protocol::Vec3{3, 1, 1}));
  ASSERT_EQ(full.scalars->size(), 1U);
  EXPECT_EQ((*full.scalars)[0].color.range, (protocol::Range{300, 200}));
  EXPECT_EQ((*full.scalars)[0].color.map, "ice");
  EXPECT_EQ(dataset->loads(), 0U);  // all ranges were given
}

TEST(CompleteView, RangesComeFromTheFirstStep) {
  auto dataset = cloudy_weather();
  View later;
  later.step = 2;
  EXPECT_EQ(told(completed(later, *dataset)), told(completed(View{}, *dataset)));
}

TEST(CompleteView, FieldsThatAViewMayLoadAreKnownWithoutLoading) {
  const auto dataset = sample_dataset("tornado", {8, 8, 8});
  const data::DatasetInfo& info = dataset->info();
  protocol::View view;
  EXPECT_THAT(fields_of(view, info), testing::ElementsAre("wind", "cloud"));
  const auto completed = complete(view, *dataset);
  ASSERT_TRUE(completed);
  EXPECT_EQ(fields_of(completed->view(), info), fields_of(view, info));
  view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  view.scalars.emplace(2);
  (*view.scalars)[0].field = "vorticity";
  (*view.scalars)[1].field = "nothing";
  view.geometry.height_field = "cloud";
  EXPECT_THAT(fields_of(view, info), testing::ElementsAre("vorticity", "cloud"));
}

TEST(CompleteView, ShowsCloudsButNoTemperatureWithWind) {
  auto dataset = cloudy_weather();
  const View full = completed(View{}, *dataset);
  ASSERT_EQ(full.scalars->size(), 1U);
  EXPECT_EQ((*full.scalars)[0].field, "cloud");
  EXPECT_EQ(full.vector.field.name, "wind");
}

TEST(CompleteView, WithoutAVectorTheFirstScalarIsShown) {
  auto dataset = dataset_of(std::make_unique<FakeSource>(
      atmosphere_grid(),
      std::vector<data::FieldInfo>{scalar_info("temperature", "K"), scalar_info("z", "m")}, 1));
  const View full = completed(View{}, *dataset);
  EXPECT_EQ(full.vector.field.kind, FieldChoice::Kind::none);
  ASSERT_EQ(full.scalars->size(), 1U);
  EXPECT_EQ((*full.scalars)[0].field, "temperature");
}

TEST(CompleteView, ConstantFieldHasRanges) {
  for (const double value : {0.0, -3.0, 1e-35, 1e30}) {
    auto source = std::make_unique<FakeSource>(
        atmosphere_grid(), std::vector<data::FieldInfo>{wind_info(), scalar_info("cloud", "kg")},
        1);
    source->constant = std::make_unique<double>(value);
    auto dataset = dataset_of(std::move(source));
    const View full = completed(View{}, *dataset);
    EXPECT_LT((*full.vector.magnitude_range)[0], (*full.vector.magnitude_range)[1]) << value;
    const protocol::Range range = *(*full.scalars)[0].color.range;
    EXPECT_LT(range[0], range[1]) << value;
    EXPECT_TRUE(std::isfinite(range[0]) && std::isfinite(range[1])) << value;
  }
}

TEST(CompleteView, FullyMaskedFieldHasRanges) {
  auto source = std::make_unique<FakeSource>(
      atmosphere_grid(), std::vector<data::FieldInfo>{wind_info(), scalar_info("cloud", "1")}, 1);
  source->constant = std::make_unique<double>(std::nan(""));
  auto dataset = dataset_of(std::move(source));
  const View full = completed(View{}, *dataset);
  EXPECT_EQ(full.vector.magnitude_range, (protocol::Range{0, 1}));
  EXPECT_EQ((*full.scalars)[0].color.range, (protocol::Range{0, 1}));
}

TEST(CompleteView, FewLinesAreAboutFiveGridSpacingsLong) {
  auto dataset = sample_dataset("tornado", {8, 8, 8});
  View view;
  EXPECT_NEAR(*completed(view, *dataset).vector.length, 5 * 2.0 / 8, 0.06);
  EXPECT_EQ(*completed(view, *dataset).vector.stride, 1);
}

TEST(CompleteView, ChangedLineKeyKeepsTheOtherDefaults) {
  auto dataset = sample_dataset("tornado", {32, 32, 32});
  const protocol::VectorView plain = completed(View{}, *dataset).vector;
  View view;
  view.vector.stride = 3;
  EXPECT_EQ(completed(view, *dataset).vector.length, plain.length);
  view.vector.length = 0.01;
  view.vector.r2 = 5;
  const protocol::VectorView changed = completed(view, *dataset).vector;
  EXPECT_EQ(changed.min_magnitude, plain.min_magnitude);
  EXPECT_EQ(changed.color.range, plain.color.range);
}

TEST(CompleteView, AtmospheresAreColoredByHeightOthersByMagnitude) {
  auto climate = sample_dataset("climate", {24, 16, 12});
  auto tornado = sample_dataset("tornado", {24, 16, 12});
  EXPECT_EQ(completed(View{}, *climate).vector.color.by, ColorBy::world_z);
  EXPECT_EQ(completed(View{}, *tornado).vector.color.by, ColorBy::magnitude);
}

TEST(CompleteView, SlicesAndPlanesAreColoredByMagnitude) {
  auto climate = sample_dataset("climate", {24, 16, 12});
  View view;
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 4};
  EXPECT_EQ(completed(view, *climate).vector.color.by, ColorBy::magnitude)
      << "all lines of the layer have the same height";
  view.geometry.slice->axis = protocol::GridAxis::y;
  EXPECT_EQ(completed(view, *climate).vector.color.by, ColorBy::magnitude);
  view.geometry.slice.reset();
  view.geometry.plane = protocol::PlaneView{{0, 0, 0}, {1, 1, 0.2}};
  EXPECT_EQ(completed(view, *climate).vector.color.by, ColorBy::magnitude);
  view.vector.color.by = ColorBy::world_z;
  EXPECT_EQ(completed(view, *climate).vector.color.by, ColorBy::world_z) << "as given";
}

// Rises of the drawn lines of a scene in full detail, from tail to head.
std::vector<double> rises_in(const Scene& scene) {
  const VectorLayer& layer = scene.vector.value();
  const data::Volume& wind = *layer.field;
  const auto [nx, ny, nz] = wind.dims;
  std::vector<double> rises;
  for (std::size_t at = 0; at < wind.samples(); ++at) {
    const auto n = static_cast<int>(at);
    glm::dvec3 v(wind.component(0)[at], wind.component(1)[at], wind.component(2)[at]);
    const double magnitude = glm::length(v);
    if (!(magnitude > 0 && magnitude >= layer.min_magnitude)) continue;
    v *= layer.scale;
    if (!layer.rate_x.empty()) {
      v *= glm::dvec3(layer.rate_x[n / nx % ny], layer.rate_y, layer.rate_z[n / (nx * ny)]);
    }
    const double part = std::min(magnitude / layer.magnitude_range[1], 1.0);
    rises.push_back(v.z / glm::length(v) * part * layer.length);
  }
  return rises;
}

TEST(CompleteView, ColorsByRiseCoverTheRisesOfTheDrawnLines) {
  for (const char* sample : {"climate", "tornado", "efield"}) {
    for (const auto space : {protocol::VectorSpace::components, protocol::VectorSpace::world}) {
      if (space == protocol::VectorSpace::world && sample == std::string("efield")) continue;
      auto dataset = sample_dataset(sample, {40, 24, 16});
      View view;
      view.vector.color.by = ColorBy::rise;
      view.vector.space = space;
      view.method.detail = protocol::Detail::full;
      const auto scene = build_scene(view, *dataset);
      ASSERT_TRUE(scene) << scene.error().message;
      const auto [low, high] = scene->vector->color.range;
      EXPECT_EQ(low, -high) << "level lines have the colour of the middle";
      std::vector<double> rises = rises_in(*scene);
      for (double& rise : rises) rise = std::abs(rise);
      std::sort(rises.begin(), rises.end());
      const auto quantile = [&](double q) {
        return rises[static_cast<std::size_t>(q * static_cast<double>(rises.size() - 1))];
      };
      EXPECT_GE(high, 0.95 * quantile(0.98)) << sample;
      EXPECT_LE(high, 1.35 * quantile(0.98)) << sample << ": no wider than they need";
    }
  }
}

TEST(CompleteView, RiseRangeOfLevelWindIsTheLengthOfItsLines) {
  data::FieldInfo flat = wind_info();
  flat.components = {"u", "v"};
  flat.component_units = {"m s-1", "m s-1"};
  auto dataset = dataset_of(
      std::make_unique<FakeSource>(atmosphere_grid(), std::vector<data::FieldInfo>{flat}, 1));
  View view;
  view.vector.color.by = ColorBy::rise;
  view.vector.length = 0.4;
  EXPECT_EQ(completed(view, *dataset).vector.color.range, (protocol::Range{-0.4, 0.4}));
}

TEST(CompleteView, RefusesByPointer) {
  auto dataset = cloudy_weather();
  const auto scalar = [](const std::string& field) {
    protocol::ScalarView out;
    out.field = field;
    return out;
  };
  using Spoil = std::function<void(View&)>;
  const std::vector<std::pair<std::string, Spoil>> cases = {
      {"/step", [](View& v) { v.step = 3; }},
      {"/step", [](View& v) { v.step = -1; }},
      {"/vector/field",
       [](View& v) {
         v.vector.field = {FieldChoice::Kind::named, "gale"};
       }},
      {"/vector/field",
       [](View& v) {
         v.vector.field = {FieldChoice::Kind::named, "cloud"};
       }},
      {"/vector/color/map", [](View& v) { v.vector.color.map = "jet"; }},
      {"/vector/color/constant", [](View& v) { v.vector.color.constant = "blue"; }},
      {"/vector/color/range",
       [](View& v) {
         v.vector.color.range = protocol::Range{2, 2};
       }},
      {"/vector/magnitudeRange",
       [](View& v) {
         v.vector.magnitude_range = protocol::Range{2, 1};
       }},
      {"/vector/r1", [](View& v) { v.vector.r1 = 3; }},
      {"/image/background", [](View& v) { v.image.background = "#12"; }},
      {"/depthCue/near", [](View& v) { v.depth_cue.near = 1; }},
      {"/scalars/0/field", [&](View& v) { v.scalars = {scalar("wind")}; }},
      {"/scalars/1/field",
       [&](View& v) {
         v.scalars = {scalar("cloud"), scalar("fog")};
       }},
      {"/scalars/0/color/map",
       [&](View& v) {
         v.scalars = {scalar("cloud")};
         (*v.scalars)[0].color.map = "rainbow";
       }},
      {"/scalars/0/color/range",
       [&](View& v) {
         v.scalars = {scalar("cloud")};
         (*v.scalars)[0].color.range = protocol::Range{1, 1};
       }},
      {"/scalars/0/extinction/1",
       [&](View& v) {
         v.scalars = {scalar("cloud")};
         (*v.scalars)[0].extinction = {{1, 0}, {0, 2}};
       }},
      {"/scalars/0/extinction/2",
       [&](View& v) {
         v.scalars = {scalar("cloud")};
         (*v.scalars)[0].extinction = {{0, 0}, {0, 1}, {9e-31, 2}};
       }},
  };
  for (const auto& [pointer, spoil] : cases) {
    View view;
    spoil(view);
    const auto refused = complete(view, *dataset);
    ASSERT_FALSE(refused) << pointer;
    EXPECT_EQ(refused.error().kind, ErrorKind::invalid) << pointer;
    ASSERT_FALSE(refused.error().at.empty()) << pointer;
    EXPECT_EQ(refused.error().at[0].pointer, pointer);
  }
}

TEST(CompleteView, StepEdgesInAnOpacityFunctionAreAllowed) {
  auto dataset = cloudy_weather();
  View view;
  protocol::ScalarView scalar;
  scalar.field = "cloud";
  scalar.extinction = {{0, 0}, {5, 0}, {5, 9}};
  view.scalars = {scalar};
  EXPECT_TRUE(complete(view, *dataset));
}

TEST(Defaults, NiceNumbersRoundUp) {
  EXPECT_DOUBLE_EQ(nice_above(0.9), 1.0);
  EXPECT_DOUBLE_EQ(nice_above(1.0), 1.0);
  EXPECT_DOUBLE_EQ(nice_above(1.01), 1.2);
  EXPECT_DOUBLE_EQ(nice_above(61.0), 80.0);
  EXPECT_DOUBLE_EQ(nice_above(81.0), 100.0);
  EXPECT_NEAR(nice_above(3.3e-8), 4e-8, 1e-20);
}

TEST(Defaults, QuantilesAreThoseOfUnmaskedMagnitudes) {
  data::Volume volume;
  volume.dims = {5, 1, 1};
  volume.components = 2;
  volume.values = {3, 0, 6, std::nanf(""), 9, 4, 0, 8, std::nanf(""), 12};
  data::finish_volume(volume);
  EXPECT_EQ(quantiles(volume, 0.0, 1.0), (protocol::Range{0, 15}));
  EXPECT_EQ(quantiles(volume, 0.34, 0.67), (protocol::Range{5, 10}));
}

TEST(Defaults, AnOceanHasNoMediumOfCurrentsOrSalinity) {
  data::FieldInfo current = scalar_info("water_u", "m/s");
  current.standard_name = "eastward_sea_water_velocity";
  data::FieldInfo salinity = scalar_info("so", "1e-3");
  salinity.standard_name = "sea_water_salinity";
  data::DatasetInfo info;
  info.grid = atmosphere_grid();
  for (const char* name : {"so", "sea_water_salinity"}) {
    salinity.name = name;
    info.fields = {wind_info(), current, salinity};
    EXPECT_TRUE(default_scalars(info).empty()) << name;
  }
  info.fields.push_back(scalar_info("q", "kg kg-1"));
  EXPECT_EQ(default_scalars(info), std::vector<std::string>{"q"});
}

TEST(Defaults, CloudWaterIsAMediumByItsUsualNames) {
  data::DatasetInfo info;
  info.grid = atmosphere_grid();
  for (const char* name : {"ql", "QCL", "LWC", "iwc", "clwc", "CLDLIQ", "clwmr"}) {
    info.fields = {wind_info(), scalar_info("hus", "1"), scalar_info(name, "kg kg-1")};
    EXPECT_EQ(default_scalars(info), std::vector<std::string>{name});
  }
  data::FieldInfo plain = scalar_info("x1", "kg m-3");
  plain.long_name = "Liquid water content";
  info.fields = {wind_info(), scalar_info("hus", "1"), plain};
  EXPECT_EQ(default_scalars(info), std::vector<std::string>{"x1"});
  plain.long_name = "Liquid water content of soil layers";
  info.fields = {wind_info(), scalar_info("cc", "1"), plain};
  EXPECT_EQ(default_scalars(info), std::vector<std::string>{"cc"});
}

TEST(Defaults, WaterOnTheGroundIsNoCloud) {
  data::DatasetInfo info;
  info.grid = atmosphere_grid();
  for (const char* name : {"liquid_water_content_of_surface_snow",
                           "Liquid Water Content of Snow Layer", "canopy liquid water content",
                           "ice water content of sea ice", "liquid_water_content_of_soil_layer"}) {
    data::FieldInfo ground = scalar_info("x1", "kg m-2");
    ground.long_name = name;
    info.fields = {wind_info(), ground, scalar_info("clw", "kg kg-1")};
    EXPECT_EQ(default_scalars(info), std::vector<std::string>{"clw"}) << name;
  }
  data::FieldInfo snow = scalar_info("lwsnl", "kg m-2");
  snow.standard_name = "liquid_water_content_of_surface_snow";
  info.fields = {wind_info(), snow};
  EXPECT_TRUE(default_scalars(info).empty());
  snow.standard_name = "mass_fraction_of_snow_in_air";
  info.fields = {wind_info(), snow};
  EXPECT_EQ(default_scalars(info), std::vector<std::string>{"lwsnl"}) << "falling snow is a medium";
}

TEST(Defaults, AMapShowsItsFirstFieldAndIsOpaqueEverywhere) {
  data::Grid grid = atmosphere_grid();
  grid.axes[2].coordinates = {0};
  data::FieldInfo time = scalar_info("time_of_pass", "s");
  time.standard_name = "time";
  const auto map = dataset_of(std::make_unique<FakeSource>(
      grid,
      std::vector<data::FieldInfo>{time, scalar_info("sst", "K"), scalar_info("ice_fraction", "1")},
      1));
  const View view = completed(View{}, *map);
  ASSERT_EQ(view.scalars->size(), 1U);
  const protocol::ScalarView& shown = view.scalars->front();
  EXPECT_EQ(shown.field, "sst");
  EXPECT_EQ(shown.color.map, "viridis") << "the low end of the usual map is black";
  // exp(-12) of the light from behind passes one layer.
  const Scene scene = built(View{}, *map);
  const double thickness = scene.lattice.spacing[2][0];
  for (const auto& [value, extinction] : *shown.extinction) {
    EXPECT_GE(extinction * thickness, 12) << value;
  }
}

// The range of a field "cloud" of which a quarter of the samples has the largest value.
protocol::Range range_of_cloud(const std::string& units, float most,
                               const std::string& long_name = "") {
  data::Volume volume;
  volume.dims = {4, 1, 1};
  volume.values = {0, 0, 0, most};
  data::finish_volume(volume);
  data::FieldInfo field = scalar_info("cloud", units);
  field.long_name = long_name;
  return default_scalar_range(field, volume);
}

// Clouds begin at 0.12 of their range.
TEST(Defaults, SharesHaveTheWholeRangeAndMixingRatiosTheirOwn) {
  EXPECT_EQ(range_of_cloud("1", 0.3F), (protocol::Range{0, 1}));
  EXPECT_EQ(range_of_cloud("%", 30), (protocol::Range{0, 100}));
  EXPECT_EQ(range_of_cloud("1", 0), (protocol::Range{0, 1}));
  EXPECT_NEAR(range_of_cloud("1", 9e-4F)[1], 1e-3, 1e-9);
  EXPECT_NEAR(range_of_cloud("%", 3)[1], 3, 1e-6);
}

// An almost clear first step must not decide on the range of the steps after it.
TEST(Defaults, NamesTellSharesFromMixingRatios) {
  EXPECT_EQ(range_of_cloud("1", 0.01F, "cloud area fraction"), (protocol::Range{0, 1}));
  EXPECT_EQ(range_of_cloud("%", 3, "Total cloud cover"), (protocol::Range{0, 100}));
  EXPECT_LT(range_of_cloud("1", 0.3F, "mass fraction of cloud water")[1], 0.5);
}

TEST(Defaults, HiddenVectorsAreCounted) {
  const auto dataset = cloudy_weather();
  View view = completed(View{}, *dataset);
  view.vector.min_magnitude = 0;
  EXPECT_EQ(hidden_vectors(view, *dataset).value(), "");
  view.vector.min_magnitude = 1e6;
  EXPECT_THAT(hidden_vectors(view, *dataset).value(),
              testing::HasSubstr("shorter than 1e+06 m s-1 (/vector/minMagnitude): about 100 %"));
  // Sample n has the components n, n + 100 and n + 200: a magnitude below 255 at n = 0 to 22 of 36.
  view.vector.min_magnitude = 255;
  EXPECT_THAT(hidden_vectors(view, *dataset).value(), testing::HasSubstr("about 64 %"));
}

}  // namespace
}  // namespace windsplat::scene
