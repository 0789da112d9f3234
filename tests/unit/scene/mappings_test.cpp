// The geometries that a dataset offers, for real layouts of files.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/resident/store.hpp"
#include "server/scene/describe.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::scene {
namespace {

using data::test::counting;
using data::test::Folder;
using data::test::NetcdfMaker;
using protocol::GeometryMapping;
using Words = std::vector<std::string>;

std::shared_ptr<data::Dataset> opened(const std::string& path) {
  data::Store store(1U << 20U);
  auto dataset = store.add(path);
  EXPECT_TRUE(dataset) << dataset.error().message;
  return dataset ? *dataset : nullptr;
}

// 2-D longitudes and latitudes of three rows and four columns, rotated relative to the compass.
void write_curvilinear(const std::string& path, double gap_or_one) {
  NetcdfMaker file(path);
  const int y = file.dimension("eta", 3);
  const int x = file.dimension("xi", 4);
  std::vector<double> lon;
  std::vector<double> lat;
  for (int j = 0; j < 3; ++j) {
    for (int i = 0; i < 4; ++i) {
      lon.push_back(10 + 2.0 * i - 0.5 * j);
      lat.push_back(40 + 1.5 * j + 0.25 * i);
    }
  }
  lon[5] *= gap_or_one;
  file.text(file.variable("lon", NC_DOUBLE, {y, x}, lon), "units", "degrees_east");
  file.text(file.variable("lat", NC_DOUBLE, {y, x}, lat), "units", "degrees_north");
  file.text(file.variable("f", NC_FLOAT, {y, x}, counting(12)), "coordinates", "lon lat");
}

void write_axes(const std::string& path, const std::array<const char*, 2>& names,
                const std::array<const char*, 2>& units) {
  NetcdfMaker file(path);
  const int y = file.axis(names[1], {0, 1, 2}, units[1]);
  const int x = file.axis(names[0], {0, 1, 2, 3}, units[0]);
  file.variable("f", NC_FLOAT, {y, x}, counting(12));
}

// Compares the list with the placement of the grid for every entry.
Words mappings(data::Dataset& dataset) {
  Words out = describe(dataset, RangesOf::none)->mappings;
  for (const auto& [mapping, name] :
       {std::pair{GeometryMapping::flat, "flat"}, std::pair{GeometryMapping::sphere, "sphere"},
        std::pair{GeometryMapping::curvilinear, "curvilinear"}}) {
    protocol::GeometryView geometry;
    geometry.mapping = mapping;
    const bool told = std::find(out.begin(), out.end(), name) != out.end();
    EXPECT_EQ(place_lattice(dataset.info().grid, geometry).has_value(), told) << name;
  }
  return out;
}

TEST(Mappings, FollowTheCoordinatesOfTheFile) {
  const Folder folder;
  write_curvilinear(folder / "ocean.nc", 1);
  EXPECT_EQ(mappings(*opened(folder / "ocean.nc")), (Words{"flat", "sphere", "curvilinear"}));
  write_curvilinear(folder / "gaps.nc", std::nan(""));
  EXPECT_EQ(mappings(*opened(folder / "gaps.nc")), Words{"flat"});
  write_axes(folder / "globe.nc", {"lon", "lat"}, {"degrees_east", "degrees_north"});
  EXPECT_EQ(mappings(*opened(folder / "globe.nc")), (Words{"flat", "sphere"}));
  write_axes(folder / "box.nc", {"x", "y"}, {"m", "m"});
  EXPECT_EQ(mappings(*opened(folder / "box.nc")), Words{"flat"});
}

}  // namespace
}  // namespace windsplat::scene
