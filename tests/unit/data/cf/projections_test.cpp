// Longitudes and latitudes of every map projection against its forward formula, and against
// coordinates that data centres publish.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/cf/projection_formulas.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::projected {
namespace {

const Sheet near{{-2e5, -1e5, 3e5}, {3e6, 5.3e6, 6e6}};

struct Kind {
  std::string label;
  Mapping mapping;
  Forward forward;
  Sheet sheet;
  double tolerance_m = 1e-3;
};
void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.label; }

class EveryKind : public testing::TestWithParam<Kind> {};

TEST_P(EveryKind, PositionsInvertTheFormulas) {
  const Kind& kind = GetParam();
  const Folder folder;
  write_sheet(folder / "p.nc", kind.mapping, kind.sheet);
  const auto source = opened(folder / "p.nc");
  ASSERT_NE(source, nullptr);
  const auto& columns = source->info().grid.columns;
  ASSERT_NE(columns, nullptr) << source->info().notes.at(0);
  const std::size_t width = kind.sheet.x.size();
  ASSERT_EQ(columns->longitude.size(), width * kind.sheet.y.size());
  for (std::size_t n = 0; n < columns->longitude.size(); ++n) {
    const Point point = kind.forward(columns->longitude[n], columns->latitude[n]);
    EXPECT_NEAR(point.x, kind.sheet.x[n % width], kind.tolerance_m) << n;
    EXPECT_NEAR(point.y, kind.sheet.y[n / width], kind.tolerance_m) << n;
  }
  EXPECT_TRUE(has_note(source->info(),
                       "computed from the map projection 'crs' (" + kind.mapping.name + ')'));
}

const double earth_from_satellite = (35786023.0 + sphere.a) / sphere.a;  // P of (23-1)

std::vector<Kind> kinds() {
  std::vector<Kind> out;
  const auto add = [&](std::string label, const char* name, Numbers numbers, Forward forward,
                       Sheet sheet = wide, std::map<std::string, std::string> texts = {},
                       double tolerance_m = 1e-3) {
    out.push_back({std::move(label),
                   {name, std::move(numbers), std::move(texts)},
                   std::move(forward),
                   std::move(sheet),
                   tolerance_m});
  };
  add("albers", "albers_conical_equal_area", with(wgs84, conic({29.5, 45.5}, 23, -96)),
      albers(wgs84, 29.5, 45.5, 23, -96));
  add("equidistant", "azimuthal_equidistant", with(sphere, at_origin(40, -100)),
      azimuthal(40, -100, [](double c) { return std::acos(c) / std::sin(std::acos(c)); }));
  const Sheet disc{{-3.5e6, -1e6, 2e6, 3e6}, {-3e6, 1e6, 4e6}};
  add("satellite swept along x", "geostationary",
      with(wgs84, at_origin(0, -75, {{"perspective_point_height", {35786023}}})),
      satellite(wgs84, 35786023, -75, true), disc, {{"sweep_angle_axis", "x"}});
  add("satellite swept along y", "geostationary",
      with(wgs84, at_origin(0, 9.5, {{"perspective_point_height", {35785831}}})),
      satellite(wgs84, 35785831, 9.5, false), disc, {{"fixed_angle_axis", "x"}});
  add("equal area", "lambert_azimuthal_equal_area", with(wgs84, at_origin(52, 10)),
      equal_area(wgs84, 52, 10), wide, {}, 0.005);
  add("conformal conic, one parallel", "lambert_conformal_conic",
      with(sphere, conic({38.5}, 38.5, -97.5)), conformal_conic(sphere, 38.5, 38.5, 38.5, -97.5));
  add("conformal conic, two parallels", "lambert_conformal_conic",
      with(wgs84, conic({33, 45}, 23, -96)), conformal_conic(wgs84, 33, 45, 23, -96));
  add("conformal conic of the south", "lambert_conformal_conic",
      with(wgs84, conic({-30, -60}, -45, 20)), conformal_conic(wgs84, -30, -60, -45, 20));
  add("cylindrical", "lambert_cylindrical_equal_area",
      with(sphere, {{"standard_parallel", {30}}, {"longitude_of_central_meridian", {20}}}),
      [](double lon, double lat) {  // (10-1), (10-2)
        return Point{sphere.a * (lon - 20) * degree * std::cos(30 * degree),
                     sphere.a * std::sin(lat * degree) / std::cos(30 * degree)};
      });
  add("mercator", "mercator",
      with(wgs84, {{"standard_parallel", {20}}, {"longitude_of_projection_origin", {-60}}}),
      mercator(wgs84, 20, -60));
  add("orthographic", "orthographic", with(sphere, at_origin(40, -100)),
      azimuthal(40, -100, [](double) { return 1; }));
  add("north pole", "polar_stereographic",
      with(hughes, {{"latitude_of_projection_origin", {90}},
                    {"straight_vertical_longitude_from_pole", {-45}},
                    {"standard_parallel", {70}}}),
      polar(hughes, 90, 70, -45));
  add("south pole", "polar_stereographic",
      with(hughes, {{"latitude_of_projection_origin", {-90}},
                    {"straight_vertical_longitude_from_pole", {0}},
                    {"standard_parallel", {-70}}}),
      polar(hughes, -90, -70, 0));
  add("sinusoidal", "sinusoidal", with(sphere, {{"longitude_of_projection_origin", {15}}}),
      [](double lon, double lat) {  // (30-1), (30-2)
        return Point{sphere.a * (lon - 15) * degree * std::cos(lat * degree),
                     sphere.a * lat * degree};
      });
  add("stereographic", "stereographic",
      with(sphere, at_origin(40, -100, {{"scale_factor_at_projection_origin", {0.9}}})),
      azimuthal(40, -100, [](double c) { return 2 * 0.9 / (1 + c); }));
  add("transverse mercator", "transverse_mercator",
      with(wgs84, {{"latitude_of_projection_origin", {0}},
                   {"longitude_of_central_meridian", {9}},
                   {"scale_factor_at_central_meridian", {0.9996}}}),
      transverse(wgs84, 0.9996, 9), near, {}, 0.01);
  add("perspective", "vertical_perspective",
      with(sphere, at_origin(40, -100, {{"perspective_point_height", {35786023}}})),
      azimuthal(40, -100,
                [](double c) { return (earth_from_satellite - 1) / (earth_from_satellite - c); }));
  return out;
}
INSTANTIATE_TEST_SUITE_P(Projections, EveryKind, testing::ValuesIn(kinds()));

// Every parameter in turn gets values at the ends of what is accepted, and beyond.
TEST(Projections, AbsurdParametersNeitherHangNorYieldPositionsThatAreNoNumbers) {
  const auto start = std::chrono::steady_clock::now();
  std::size_t placed = 0;
  for (const Kind& kind : kinds()) {
    for (const auto& [name, values] : kind.mapping.numbers) {
      for (const double absurd : {nan, infinite, -1e308, 1e308, 1e-308, 0.0, -90.0, 90.0, 89.999999,
                                  1e-7, 179.9999, 1e9}) {
        const Folder folder;
        Mapping mapping = kind.mapping;
        mapping.numbers[name] = {absurd};
        const auto source = on_sheet(folder, mapping, kind.sheet);
        ASSERT_NE(source, nullptr);
        const auto& columns = source->info().grid.columns;
        if (!columns) continue;
        ++placed;
        for (std::size_t n = 0; n < columns->latitude.size(); ++n) {
          ASSERT_TRUE(std::isfinite(columns->longitude[n])) << kind.label << ' ' << name << absurd;
          ASSERT_LE(std::abs(columns->latitude[n]), 90 + 1e-6) << kind.label << ' ' << name;
        }
      }
    }
  }
  EXPECT_GT(placed, 100U);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

// The central line of an oblique Mercator projection is a great circle at the scale of its origin.
TEST(Projections, ObliqueMercatorKeepsLengthsAlongItsCentralLine) {
  const Folder folder;
  const std::vector<double> line{-6e5, 0, 4e5, 1e6};
  const auto source =
      on_sheet(folder,
               {"oblique_mercator",
                with(sphere, at_origin(20, 50,
                                       {{"azimuth_of_central_line", {45}},
                                        {"scale_factor_at_projection_origin", {0.8}}})),
                {}},
               {line, line});
  ASSERT_NE(source->info().grid.columns, nullptr) << source->info().notes.at(0);
  for (std::size_t i = 0; i < line.size(); ++i) {
    const double way = line[i] * std::sqrt(2) / 0.8 / sphere.a;
    const double s = std::sin(20 * degree);
    const double c = std::cos(20 * degree);
    const double sine = s * std::cos(way) + c * std::sin(way) * std::sqrt(0.5);
    const double lon =
        50 + std::atan2(std::sin(way) * std::sqrt(0.5) * c, std::cos(way) - s * sine) / degree;
    EXPECT_NEAR(source->info().grid.columns->latitude[5 * i], std::asin(sine) / degree, 1e-8);
    EXPECT_NEAR(source->info().grid.columns->longitude[5 * i], lon, 1e-8);
  }
}

struct Landmark {
  const char* label;
  Mapping mapping;
  Sheet sheet;
  double longitude;  // of the first column
  double latitude;
};

// The first point of NOAA's HRRR grid (GRIB: 21.138123, 237.280472); a corner of the northern grid
// of NSIDC's sea ice data; the example of the GOES-R guide, whose angles are in radians.
TEST(Projections, PublishedPointsLieWhereTheyShould) {
  const Landmark known[] = {
      {"HRRR", lambert, {{-2697520.14, 0}, {-1587306.15, 0}}, -122.719528, 21.138123},
      {"NSIDC",
       {"polar_stereographic",
        with(hughes, {{"latitude_of_projection_origin", {90}},
                      {"straight_vertical_longitude_from_pole", {-45}},
                      {"standard_parallel", {70}}}),
        {}},
       {{-3850, 0}, {5850, 0}, "km"},
       168.35,
       30.98},
      {"GOES-16",
       {"geostationary",
        with(ellipsoid(6378137, 298.257222096),
             at_origin(0, -75, {{"perspective_point_height", {35786023}}})),
        {{"sweep_angle_axis", "x"}}},
       {{-0.024052, 0}, {0.095340, 0}, "rad"},
       -84.690932,
       33.846162}};
  for (const Landmark& one : known) {
    SCOPED_TRACE(one.label);
    const Folder folder;
    const auto source = on_sheet(folder, one.mapping, one.sheet);
    ASSERT_NE(source->info().grid.columns, nullptr) << source->info().notes.at(0);
    // y is drawn upward: the file's first row is the last one if y descends.
    const std::size_t first = one.sheet.y[0] > one.sheet.y[1] ? 2 : 0;
    const double rounding = std::string(one.label) == "NSIDC" ? 5e-3 : 2e-6;
    EXPECT_NEAR(std::remainder(source->info().grid.columns->longitude[first] - one.longitude, 360),
                0, rounding);
    EXPECT_NEAR(source->info().grid.columns->latitude[first], one.latitude, rounding);
  }
}

TEST(Projections, FalseOriginUnitsAndPrimeMeridianShiftThePositions) {
  const Folder folder;
  const auto plain = on_sheet(folder, lambert, {{1e5, 2e5}, {3e5, 4e5}});
  Mapping moved = lambert;
  moved.numbers["false_easting"] = {5e5};
  moved.numbers["false_northing"] = {-2e5};
  moved.numbers["longitude_of_prime_meridian"] = {2.5};
  const auto other = on_sheet(folder, moved, {{600, 700}, {100, 200}, "km"});
  const auto& a = plain->info().grid.columns;
  const auto& b = other->info().grid.columns;
  ASSERT_TRUE(a && b);
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_NEAR(b->longitude[n], a->longitude[n] + 2.5, 1e-9);
    EXPECT_NEAR(b->latitude[n], a->latitude[n], 1e-9);
  }
}

TEST(Projections, LongitudesOfAnotherPrimeMeridianBecomeThoseOfGreenwich) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "p.nc");
    const int y = file.axis("lat", {10, 20}, "degrees_north");
    const int x = file.axis("lon", {0, 1}, "degrees_east");
    write_mapping(file, {"latitude_longitude", {{"longitude_of_prime_meridian", {2.5}}}, {}});
    file.text(file.variable("f", NC_FLOAT, {y, x}, counting(4)), "grid_mapping", "crs");
  }
  const auto source = opened(folder / "p.nc");
  EXPECT_EQ(source->info().grid.axes[0].coordinates, (std::vector<double>{2.5, 3.5}));
  EXPECT_TRUE(has_note(source->info(), "relative to the prime meridian of 'crs'"));
}

TEST(Projections, ShapesOfTheEarthAreReadInAllTheirForms) {
  const Folder folder;
  const Numbers place = conic({33, 45}, 23, -96);
  const auto first = [&](Numbers shape, std::map<std::string, std::string> texts = {}) {
    shape.insert(place.begin(), place.end());
    const auto source =
        on_sheet(folder, {"lambert_conformal_conic", std::move(shape), std::move(texts)});
    EXPECT_NE(source->info().grid.columns, nullptr) << source->info().notes.at(0);
    return source->info().grid.columns->latitude[0];
  };
  const double on_wgs84 =
      first({{"semi_major_axis", {6378137}}, {"inverse_flattening", {298.257223563}}});
  EXPECT_NEAR(first({{"semi_major_axis", {6378137}}, {"semi_minor_axis", {6356752.314245179}}}),
              on_wgs84, 1e-9);
  EXPECT_NEAR(first({}, {{"reference_ellipsoid_name", "WGS 84"}}), on_wgs84, 1e-9);
  const double on_sphere = first({{"earth_radius", {6371229}}});
  EXPECT_GT(std::abs(on_sphere - on_wgs84), 0.01);
  EXPECT_NEAR(first({{"semi_major_axis", {6371229}}, {"inverse_flattening", {0}}}), on_sphere,
              1e-9);
  EXPECT_NEAR(first({}), on_sphere, 1e-9);
  const auto assumed = on_sheet(folder, {"lambert_conformal_conic", place, {}});
  EXPECT_TRUE(has_note(assumed->info(), "gives no shape of the Earth: a sphere of 6371229 m"));
}

}  // namespace
}  // namespace windsplat::data::test::projected
