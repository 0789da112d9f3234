// A dataset that is written as a level of a store is read as the same dataset.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/written/attributes.hpp"
#include "server/data/formats/zarr/write/shard_writer.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::Pair;
using zarr::WrittenArray;

constexpr std::array<int, 3> grid_dims{5, 4, 3};

Axis written_axis(const char* name, AxisKind kind, const char* units, const char* standard_name,
                  std::vector<double> coordinates) {
  Axis out;
  out.name = name;
  out.kind = kind;
  out.units = units;
  out.standard_name = standard_name;
  out.coordinates = std::move(coordinates);
  return out;
}

FieldInfo written_field(const char* name, FieldKind kind, std::vector<std::string> components,
                        std::vector<std::string> units) {
  FieldInfo out;
  out.name = name;
  out.kind = kind;
  out.components = std::move(components);
  out.units = units.front();
  out.component_units = std::move(units);
  return out;
}

// Two steps of a wind with a rate of pressure, a vector of another name, and a scalar, on a map
// that is turned against the meridians.
DatasetInfo map_info(const char* x = "xc", const char* y = "yc") {
  DatasetInfo info;
  info.title = "A map";
  info.source = "map.nc";
  info.grid.axes = {
      written_axis(x, AxisKind::cartesian, "m", "projection_x_coordinate", {0, 1e5, 2e5, 3e5, 4e5}),
      written_axis(y, AxisKind::cartesian, "m", "projection_y_coordinate", {0, 1e5, 2e5, 3e5}),
      written_axis("plev", AxisKind::pressure, "hPa", "", {1000, 500, 250.5})};
  auto columns = std::make_shared<Columns>();
  auto ground = std::make_shared<Ground>();
  for (int j = 0; j < grid_dims[1]; ++j) {
    for (int i = 0; i < grid_dims[0]; ++i) {
      columns->longitude.push_back(178 + 1.1 * i - 0.3 * j);
      columns->latitude.push_back(50 + 0.2 * i + 0.9 * j);
      ground->heights.push_back(static_cast<float>(10 * i - 7 * j));
    }
  }
  ground->name = "surface_height";
  info.grid.columns = columns;
  info.grid.ground = ground;
  info.fields = {
      written_field("wind", FieldKind::vector, {"u", "v", "omega"}, {"m s-1", "m s-1", "Pa s-1"}),
      written_field("flux", FieldKind::vector, {"fa", "fb"}, {"W m-2", "W m-2"}),
      written_field("cloud", FieldKind::scalar, {"cloud"}, {"kg kg-1"})};
  info.fields[2].standard_name = "mass_fraction_of_cloud_liquid_water_in_air";
  info.fields[2].long_name = "cloud water";
  info.fields.push_back(written_field("speed", FieldKind::scalar, {"speed"}, {"m s-1"}));
  info.fields.back().derived = true;
  info.time_units = "hours since 2001-01-01 00:00:00";
  info.time_calendar = "noleap";
  info.steps = {{6, "2001-01-01T06:00:00Z"}, {7.5, "2001-01-01T07:30:00Z"}};
  return info;
}

float written_value(std::size_t variable, std::size_t n) {
  return n % 7 == 3 ? std::nanf("") : static_cast<float>(std::sin(0.1 + 3.0 * variable + 0.7 * n));
}

class StoreMaker {
 public:
  StoreMaker(std::string path, zarr::StoreFormat format)
      : path_(std::move(path)), format_(format) {}

  template <class T>
  void put(const std::string& name, const std::vector<std::string>& dimensions,
           const std::vector<std::size_t>& shape, const cf::WrittenAttributes& attributes,
           const std::vector<T>& items) {
    WrittenArray array;
    array.path = "0/" + name;
    array.shape = array.chunk = shape;
    if (shape.size() == 4) array.chunk = {1, 2, 3, 4};
    if (shape.size() == 4) array.shard = {1, 4, 6, 4};
    array.dtype = {'f', sizeof(T)};
    array.dimensions = dimensions;
    for (const auto& [key, text] : attributes) array.attributes[key] = text;
    array.format = format_;
    ASSERT_TRUE(zarr::check_array(array));
    const auto done = zarr::write_array(path_, array, std::span<const T>(items));
    ASSERT_TRUE(done) << done.error().message;
    arrays_.push_back(array);
  }

  void write_level(const DatasetInfo& info) {
    const auto dims = info.grid.dims();
    const std::vector<std::size_t> shape{info.steps.size(), static_cast<std::size_t>(dims[2]),
                                         static_cast<std::size_t>(dims[1]),
                                         static_cast<std::size_t>(dims[0])};
    std::vector<std::string> names{"time"};
    for (std::size_t a = 3; a-- > 0;) {
      const Axis& axis = info.grid.axes[a];
      names.push_back(cf::axis_name(info, a));
      put(names.back(), {names.back()}, {axis.coordinates.size()}, cf::axis_attributes(axis, a),
          axis.coordinates);
    }
    std::vector<double> times;
    for (const TimeStep& step : info.steps) times.push_back(step.value);
    put("time", {"time"}, {times.size()}, cf::time_attributes(info), times);
    const std::vector<std::string> plane{names[2], names[3]};
    const auto positions = cf::position_names(info);
    put(positions[0], plane, {shape[2], shape[3]}, cf::longitude_attributes(),
        info.grid.columns->longitude);
    put(positions[1], plane, {shape[2], shape[3]}, cf::latitude_attributes(),
        info.grid.columns->latitude);
    put(info.grid.ground->name, plane, {shape[2], shape[3]},
        cf::ground_attributes(*info.grid.ground), info.grid.ground->heights);
    const auto variables = cf::written_variables(info);
    for (std::size_t v = 0; v < variables.size(); ++v) {
      std::vector<float> items;
      for (std::size_t n = 0; n < 2 * info.grid.samples(); ++n)
        items.push_back(written_value(v, n));
      put(variables[v].name, names, shape, cf::placed_attributes(info, variables[v]), items);
    }
    zarr::OrderedJson attributes;
    for (const auto& [key, text] : cf::dataset_attributes(info)) attributes[key] = text;
    ASSERT_TRUE(zarr::write_metadata(path_, arrays_, {{"0", attributes}}));
  }

 private:
  std::string path_;
  zarr::StoreFormat format_;
  std::vector<WrittenArray> arrays_;
};

void expect_same_description(const DatasetInfo& after, const DatasetInfo& before) {
  EXPECT_EQ(after.title, before.title);
  EXPECT_EQ(after.time_calendar, before.time_calendar);
  ASSERT_EQ(after.steps.size(), before.steps.size());
  EXPECT_EQ(after.steps[1].text, before.steps[1].text);
  for (std::size_t a = 0; a < 3; ++a) {
    EXPECT_EQ(after.grid.axes[a].name, before.grid.axes[a].name);
    EXPECT_EQ(after.grid.axes[a].kind, before.grid.axes[a].kind);
    EXPECT_EQ(after.grid.axes[a].units, before.grid.axes[a].units);
    EXPECT_EQ(after.grid.axes[a].coordinates, before.grid.axes[a].coordinates);
  }
  ASSERT_TRUE(after.grid.columns);
  EXPECT_EQ(after.grid.columns->longitude, before.grid.columns->longitude);
  EXPECT_EQ(after.grid.columns->latitude, before.grid.columns->latitude);
  ASSERT_TRUE(after.grid.ground);
  EXPECT_EQ(after.grid.ground->kind, before.grid.ground->kind);
  EXPECT_EQ(after.grid.ground->heights, before.grid.ground->heights);
  for (std::size_t f = 0; f < 3; ++f) {
    const FieldInfo& wanted = before.fields[f];
    const FieldInfo* found = after.find(wanted.name);
    ASSERT_NE(found, nullptr) << wanted.name;
    EXPECT_EQ(found->kind, wanted.kind);
    EXPECT_EQ(found->components, wanted.components);
    EXPECT_EQ(found->component_units, wanted.component_units);
    EXPECT_EQ(found->standard_name, wanted.standard_name);
  }
}

TEST(WrittenLevels, AreReadAsTheSameDataset) {
  for (const auto format : {zarr::StoreFormat::v3, zarr::StoreFormat::v2}) {
    // The names of the positions are free, or taken by axes.
    const DatasetInfo info =
        format == zarr::StoreFormat::v3 ? map_info() : map_info("longitude", "latitude");
    const Folder folder;
    StoreMaker(folder / "map.zarr", format).write_level(info);
    const auto back = open_file(folder / "map.zarr/0");
    ASSERT_TRUE(back) << back.error().message;
    const DatasetInfo& after = (*back)->info();
    expect_same_description(after, info);
    // Components along the axes stay what they are.
    const auto* wind = after.find("wind");
    const auto volume = (*back)->read(static_cast<std::size_t>(wind - after.fields.data()), 1);
    ASSERT_TRUE(volume) << volume.error().message;
    for (std::size_t n = 0; n < volume->samples(); ++n) {
      const float wanted = written_value(1, volume->samples() + n);
      const float found = volume->component(1)[n];
      EXPECT_TRUE(found == wanted || (std::isnan(found) && std::isnan(wanted)));
    }
  }
}

TEST(WrittenAttributes, OfMeansNameTheirMethod) {
  const DatasetInfo info = map_info();
  const auto variables = cf::written_variables(info);
  ASSERT_EQ(variables.size(), 6U);
  EXPECT_THAT(
      cf::mean_attributes(info, variables[5]),
      ElementsAre(Pair("units", "kg kg-1"),
                  Pair("standard_name", "mass_fraction_of_cloud_liquid_water_in_air"),
                  Pair("long_name", "cloud water"), Pair("coordinates", "longitude latitude"),
                  Pair("cell_methods", "area: mean")));
  EXPECT_THAT(
      cf::mean_attributes(info, variables[0]),
      ElementsAre(Pair("units", "m s-1"), Pair("standard_name", "wind_speed"),
                  Pair("long_name", "magnitude of wind"), Pair("coordinates", "longitude latitude"),
                  Pair("cell_methods", "area: mean")));
  EXPECT_THAT(cf::variable_attributes(info, variables[2]),
              ElementsAre(Pair("units", "Pa s-1"),
                          Pair("standard_name", "lagrangian_tendency_of_air_pressure"),
                          Pair("windsplat_vector", "wind 2")));
}

TEST(WrittenAttributes, OfPositionsAreThoseOfCf) {
  EXPECT_THAT(cf::longitude_attributes(),
              ElementsAre(Pair("standard_name", "longitude"), Pair("units", "degrees_east")));
  EXPECT_THAT(cf::latitude_attributes(),
              ElementsAre(Pair("standard_name", "latitude"), Pair("units", "degrees_north")));
}

TEST(WrittenAttributes, OfASeaFloorAreOfItsDepth) {
  Ground floor;
  floor.kind = GroundKind::sea_floor;
  EXPECT_THAT(cf::ground_attributes(floor), Contains(Pair("positive", "down")));
  EXPECT_THAT(cf::ground_attributes(floor),
              Contains(Pair("standard_name", "sea_floor_depth_below_geoid")));
}

}  // namespace
}  // namespace windsplat::data::test
