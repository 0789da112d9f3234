// Grids of map projections: masked columns, winds, precedence of positions, and what is not
// computed.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "server/data/cf/fields/rotation.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/cf/projection_formulas.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::projected {
namespace {

// What a geostationary satellite sees is a disc; beside it there are neither positions nor values.
TEST(ProjectedGrids, ColumnsBesideTheDiscAreMaskedAndPlacedAtItsEdge) {
  const Folder folder;
  const Mapping mapping{"geostationary",
                        with(wgs84, at_origin(0, 0, {{"perspective_point_height", {35785831}}})),
                        {{"sweep_angle_axis", "y"}}};
  std::vector<double> angles;
  for (int i = -10; i <= 10; ++i) angles.push_back(0.018 * i);
  const auto source = on_sheet(folder, mapping, {angles, angles, "radian"});
  const auto& columns = source->info().grid.columns;
  ASSERT_NE(columns, nullptr) << source->info().notes.at(0);
  const Volume f = volume_of(*source, "f");
  // The disc has a radius of asin(a / (a + h)) = 0.1518 along the equator, of about 0.1513 to the
  // poles.
  std::size_t beside = 0;
  for (std::size_t n = 0; n < columns->longitude.size(); ++n) {
    const double x = angles[n % 21];
    const double y = angles[n / 21];
    const double radius = std::hypot(x, y);
    ASSERT_TRUE(radius < 0.1505 || radius > 0.1525) << "the grid has no point at the edge";
    const bool seen = radius < 0.1515;
    beside += seen ? 0 : 1;
    EXPECT_EQ(std::isnan(f.values[n]), !seen) << n;
    if (seen) continue;
    const Point at =
        satellite(wgs84, 35785831, 0, false)(columns->longitude[n], columns->latitude[n]);
    EXPECT_NEAR(std::hypot(at.x, at.y) / 35785831, 0.1515, 0.001) << n;
    EXPECT_NEAR(std::remainder(std::atan2(at.y, at.x) - std::atan2(y, x), 2 * M_PI), 0, 1e-3);
  }
  EXPECT_EQ(f.masked, static_cast<std::int64_t>(beside));
  EXPECT_TRUE(has_note(source->info(), std::to_string(beside) + " of 441 columns do not lie on"));
}

// A sinusoidal map of the globe is a lens: its rectangle has empty corners.
TEST(ProjectedGrids, CornersOfALensAreMasked) {
  const Folder folder;
  const double half = M_PI * sphere.a;
  const auto source = on_sheet(
      folder, {"sinusoidal", with(sphere, {{"longitude_of_projection_origin", {0}}}), {}},
      {{-0.9 * half, -0.4 * half, 0, 0.4 * half, 0.9 * half}, {-0.4 * half, 0, 0.4 * half}});
  ASSERT_NE(source->info().grid.columns, nullptr);
  const Volume f = volume_of(*source, "f");
  // cos(72 degrees) = 0.31
  for (std::size_t n = 0; n < 15; ++n) {
    const bool pole_row = n / 5 != 1;
    EXPECT_EQ(std::isnan(f.values[n]), pole_row && n % 5 != 2) << n;
  }
}

// A map around a centre near the date line: of its column through the centre the distances are arcs
// of the meridian, the others follow from the same map elsewhere.
TEST(ProjectedGrids, EquidistantMapsContinueAcrossTheDateLine) {
  const Sheet sheet{{-1e6, -4e5, 0, 3e5, 1e6}, {-9e5, 0, 1e6}};
  const auto columns_at = [&](double longitude) {
    const Folder folder;
    const auto source = on_sheet(
        folder, {"azimuthal_equidistant", with(wgs84, at_origin(-40, longitude)), {}}, sheet);
    EXPECT_EQ(volume_of(*source, "f").masked, 0) << longitude;
    return *source->info().grid.columns;
  };
  const auto here = columns_at(175);
  const auto elsewhere = columns_at(10);
  const Forward along = transverse(wgs84, 1, 175);
  for (std::size_t n = 0; n < 15; ++n) {
    EXPECT_NEAR(std::remainder(here.longitude[n] - elsewhere.longitude[n] - 165, 360), 0, 1e-9);
    EXPECT_NEAR(here.latitude[n], elsewhere.latitude[n], 1e-9) << n;
    if (n % 5 != 2) continue;
    EXPECT_NEAR(std::remainder(here.longitude[n] - 175, 360), 0, 1e-9) << n;
    EXPECT_NEAR(along(175, here.latitude[n]).y - along(175, -40).y, sheet.y[n / 5], 0.01) << n;
  }
}

// Albers' map of a sphere is a sector of a ring (Snyder, (14-1) to (14-6)).
TEST(ProjectedGrids, ColumnsBesideTheRingOfAlbersAreMasked) {
  Sheet sheet;
  for (int i = -10; i <= 10; ++i) sheet.x.push_back(1.6e6 * i + 1e4);
  for (int j = -6; j <= 9; ++j) sheet.y.push_back(1.6e6 * j + 2e4);
  const Folder folder;
  const auto source = on_sheet(
      folder, {"albers_conical_equal_area", with(sphere, conic({29.5, 45.5}, 23, -96)), {}}, sheet);
  const auto& columns = source->info().grid.columns;
  ASSERT_NE(columns, nullptr) << source->info().notes.at(0);
  const Volume f = volume_of(*source, "f");
  const double s_1 = std::sin(29.5 * degree);
  const double n = (s_1 + std::sin(45.5 * degree)) / 2;
  const double c = 1 - s_1 * s_1 + 2 * n * s_1;
  const double origin = std::sqrt(c - 2 * n * std::sin(23 * degree)) / n;
  std::size_t beside = 0;
  for (std::size_t at = 0; at < f.values.size(); ++at) {
    const double x = sheet.x[at % 21];
    const double y = sheet.y[at / 21];
    const double across = origin - y / sphere.a;
    const double rho = std::hypot(x / sphere.a, across);
    const double sine = (c - rho * rho * n * n) / (2 * n);
    const bool on_map =
        std::abs(sine) <= 1 && std::abs(std::atan2(x / sphere.a, across)) <= n * M_PI;
    beside += on_map ? 0 : 1;
    ASSERT_EQ(std::isnan(f.values[at]), !on_map) << x << ' ' << y;
    if (!on_map) continue;
    const Point again =
        albers(sphere, 29.5, 45.5, 23, -96)(columns->longitude[at], columns->latitude[at]);
    EXPECT_NEAR(again.x, x, 1e-3);
    EXPECT_NEAR(again.y, y, 1e-3);
  }
  EXPECT_GT(beside, 50U);
  EXPECT_EQ(f.masked, static_cast<std::int64_t>(beside));
}

// A map that runs more than once around the globe, as a Mercator grid from 0 to 360 degrees.
TEST(ProjectedGrids, CylindersMayRunBeyondTheirOpposite) {
  const Folder folder;
  const double quarter = M_PI / 2 * sphere.a;
  const auto source =
      on_sheet(folder,
               {"mercator",
                with(sphere, {{"standard_parallel", {0}}, {"longitude_of_projection_origin", {0}}}),
                {}},
               {{0, quarter, 2 * quarter, 3 * quarter, 3.9 * quarter}, {-1e6, 0, 1e6}});
  const auto& columns = source->info().grid.columns;
  ASSERT_NE(columns, nullptr);
  EXPECT_NEAR(columns->longitude[3], 270, 1e-9);
  EXPECT_NEAR(columns->longitude[4], 351, 1e-9);
  EXPECT_EQ(volume_of(*source, "f").masked, 0);
}

// An even wind from the west, by components along rows and columns: the meridian of longitude
// lambda is turned by n (lambda - lambda_0) on a cone of the constant n.
TEST(ProjectedGrids, AWindAlongTheRowsIsThatByEastAndNorth) {
  const double n = std::sin(38.5 * degree);
  const Folder folder;
  std::vector<double> x;
  std::vector<double> y;
  for (int i = 0; i < 24; ++i) x.push_back(-2e6 + 20e3 * i);
  for (int j = 0; j < 16; ++j) y.push_back(1e6 - 20e3 * j);
  const auto forward = conformal_conic(sphere, 38.5, 38.5, 38.5, -97.5);
  std::vector<double> along_x;
  std::vector<double> along_y;
  const double pole = forward(0, 90 - 1e-13).y;
  for (const double row : y) {
    for (const double column : x) {
      const double turn = std::atan2(column, pole - row);
      along_x.push_back(10 * std::cos(turn));
      along_y.push_back(10 * std::sin(turn));
    }
  }
  {
    NetcdfMaker file(folder / "w.nc");
    const int dim_y = file.axis("y", y, "m", "projection_y_coordinate");
    const int dim_x = file.axis("x", x, "m", "projection_x_coordinate");
    write_mapping(file, lambert);
    const auto add = [&](const char* name, const char* standard,
                         const std::vector<double>& values) {
      const int v = file.variable(name, NC_FLOAT, {dim_y, dim_x}, values);
      file.text(v, "standard_name", standard);
      file.text(v, "units", "m s-1");
      file.text(v, "grid_mapping", "crs");
    };
    add("ugrd", "x_wind", along_x);
    add("vgrd", "y_wind", along_y);
    add("ua", "eastward_wind", std::vector<double>(x.size() * y.size(), 10));
    add("va", "northward_wind", std::vector<double>(x.size() * y.size(), 0));
  }
  const auto source = opened(folder / "w.nc");
  std::vector<Volume> winds;
  for (const FieldInfo& field : source->info().fields) {
    if (field.kind == FieldKind::vector && !field.derived && field.components.size() == 2) {
      winds.push_back(volume_of(*source, field.name));
    }
  }
  ASSERT_EQ(winds.size(), 2U);
  const auto& columns = *source->info().grid.columns;
  const cf::GridBearing bearing = cf::bearing_of(columns, x.size());
  for (std::size_t c = 0; c < x.size() * y.size(); ++c) {
    for (const Volume& wind : winds) {
      // Directions by differences are of second order: (20 km / 6371 km)^2 of the wind.
      const double u = static_cast<double>(wind.component(0)[c]);
      const double v = static_cast<double>(wind.component(1)[c]);
      const double e = static_cast<double>(bearing.east[c]);
      const double p = static_cast<double>(bearing.north[c]);
      EXPECT_NEAR(u * e - v * p, 10, 1e-4);
      EXPECT_NEAR(u * p + v * e, 0, 1e-4);
    }
    const double turn = n * (columns.longitude[c] + 97.5) * degree;
    EXPECT_NEAR(winds[0].component(0)[c], 10 * std::cos(turn), 1e-4);
  }
}

// At the rim of a satellite's disc, where a cell is many degrees long and its neighbours are not
// seen, winds by east and north turn as the formula of the view says: t_x and t_y are the columns
// of the inverse of its Jacobian by east and north.
TEST(ProjectedGrids, WindsAtTheRimOfADiscTurnWithTheMap) {
  const Folder folder;
  const double height = 35785831;
  std::vector<double> angles;
  for (int i = -10; i <= 10; ++i) angles.push_back(0.015 * i);
  {
    NetcdfMaker file(folder / "g.nc");
    const int y = file.axis("y", angles, "radian", "projection_y_coordinate");
    const int x = file.axis("x", angles, "radian", "projection_x_coordinate");
    write_mapping(file, {"geostationary",
                         with(wgs84, at_origin(0, 0, {{"perspective_point_height", {height}}})),
                         {{"sweep_angle_axis", "y"}}});
    for (const bool is_east : {true, false}) {
      const int v = file.variable(is_east ? "ua" : "va", NC_FLOAT, {y, x},
                                  std::vector<double>(441, is_east ? 10 : 0));
      file.text(v, "standard_name", is_east ? "eastward_wind" : "northward_wind");
      file.text(v, "units", "m s-1");
      file.text(v, "grid_mapping", "crs");
    }
  }
  const auto source = opened(folder / "g.nc");
  const Volume wind = volume_of(*source, "wind");
  const auto& columns = *source->info().grid.columns;
  const auto view = satellite(wgs84, height, 0, false);
  std::size_t at_rim = 0;
  for (std::size_t n = 0; n < 441; ++n) {
    const double radius = std::hypot(angles[n % 21], angles[n / 21]);
    if (radius > 0.1513) continue;
    const double lon = columns.longitude[n];
    const double lat = columns.latitude[n];
    constexpr double step = 1e-4;
    const double shrink = std::cos(lat * degree);
    const Point east[] = {view(lon - step / shrink, lat), view(lon + step / shrink, lat)};
    const Point north[] = {view(lon, lat - step), view(lon, lat + step)};
    const double a = east[1].x - east[0].x;
    const double b = north[1].x - north[0].x;
    const double c = east[1].y - east[0].y;
    const double d = north[1].y - north[0].y;
    const double x_length = std::hypot(d, c);  // t_x = (d, -c), t_y = (-b, a)
    const double y_length = std::hypot(b, a);
    const double mean_east = d / x_length + a / y_length;
    const double mean_north = -c / x_length + b / y_length;
    const double turn = std::atan2(mean_north, mean_east);
    const double found = std::atan2(-static_cast<double>(wind.component(1)[n]),
                                    static_cast<double>(wind.component(0)[n]));
    EXPECT_NEAR(std::remainder(found - turn, 2 * M_PI), 0, 0.02) << n << ' ' << radius;
    EXPECT_NEAR(std::hypot(wind.component(0)[n], wind.component(1)[n]), 10, 1e-4);
    at_rim += radius > 0.1495 ? 1 : 0;
  }
  EXPECT_EQ(at_rim, 20U);
}

// A file's own positions are used, and compared with its projection.
TEST(ProjectedGrids, PositionsOfTheFileComeFirstAndContradictionsAreNoted) {
  for (const double shift : {0.0, 30.0}) {
    const Folder folder;
    const auto plain = on_sheet(folder, lambert);
    auto own = *plain->info().grid.columns;
    for (double& longitude : own.longitude) longitude += shift;
    {
      NetcdfMaker file(folder / "own.nc");
      const int y = file.axis("y", wide.y, "m", "projection_y_coordinate");
      const int x = file.axis("x", wide.x, "m", "projection_x_coordinate");
      write_mapping(file, lambert);
      file.text(file.variable("lon", NC_DOUBLE, {y, x}, own.longitude), "units", "degrees_east");
      file.text(file.variable("lat", NC_DOUBLE, {y, x}, own.latitude), "units", "degrees_north");
      file.text(file.variable("f", NC_FLOAT, {y, x}, counting(12)), "grid_mapping", "crs");
    }
    const auto source = opened(folder / "own.nc");
    ASSERT_NE(source->info().grid.columns, nullptr);
    EXPECT_EQ(source->info().grid.columns->longitude, own.longitude);
    EXPECT_EQ(has_note(source->info(), "differ from the map projection 'crs'"), shift > 0);
  }
}

TEST(ProjectedGrids, OneOfSeveralMappingsIsChosenByItsCoordinates) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "p.nc");
    const int y = file.axis("y", wide.y, "m", "projection_y_coordinate");
    const int x = file.axis("x", wide.x, "m", "projection_x_coordinate");
    write_mapping(file, lambert);
    file.text(file.variable("wgs", NC_INT, {}, {0}), "grid_mapping_name", "latitude_longitude");
    file.text(file.variable("f", NC_FLOAT, {y, x}, counting(12)), "grid_mapping",
              "wgs: lat lon crs: x y");
  }
  EXPECT_NE(opened(folder / "p.nc")->info().grid.columns, nullptr);
}

struct Refused {
  const char* label;
  std::function<void(Mapping&, Sheet&)> spoil;
  const char* reason;
};

std::vector<Refused> refused_values() {
  return {
      {"name", [](Mapping& m, Sheet&) { m.name = "peirce_quincuncial"; },
       "is of the unknown kind 'peirce_quincuncial'"},
      {"parallel", [](Mapping& m, Sheet&) { m.numbers.erase("standard_parallel"); },
       "lacks its attribute standard_parallel"},
      {"meridian", [](Mapping& m, Sheet&) { m.numbers.erase("longitude_of_central_meridian"); },
       "lacks its attribute longitude_of_central_meridian"},
      {"nan", [](Mapping& m, Sheet&) { m.numbers["latitude_of_projection_origin"] = {nan}; },
       "has an impossible latitude_of_projection_origin: nan"},
      {"infinite",
       [](Mapping& m, Sheet&) { m.numbers["longitude_of_central_meridian"] = {infinite}; },
       "has an impossible longitude_of_central_meridian: inf"},
      {"steep", [](Mapping& m, Sheet&) { m.numbers["standard_parallel"] = {95}; },
       "has an impossible standard_parallel: 95"},
      {"opposite",
       [](Mapping& m, Sheet&) {
         m.numbers["standard_parallel"] = {30, -30};
       },
       "is refused by PROJ: "},
      {"three",
       [](Mapping& m, Sheet&) {
         m.numbers["standard_parallel"] = {30, 40, 50};
       },
       "lacks its attribute standard_parallel"},
      {"radius", [](Mapping& m, Sheet&) { m.numbers["earth_radius"] = {6371.229}; },
       "has an impossible earth_radius: 6371.229"},
      {"flat",
       [](Mapping& m, Sheet&) {
         m.numbers["semi_major_axis"] = {6378137};
         m.numbers["inverse_flattening"] = {0.5};
       },
       "has an impossible inverse_flattening: 0.5"},
      {"prolate",
       [](Mapping& m, Sheet&) {
         m.numbers["semi_major_axis"] = {6378137};
         m.numbers["semi_minor_axis"] = {6400000};
       },
       "has an impossible semi_minor_axis: 6400000"},
      {"ellipsoid",
       [](Mapping& m, Sheet&) {
         m.numbers.erase("earth_radius");
         m.texts["reference_ellipsoid_name"] = "Everest 1830";
       },
       "names an ellipsoid without its axes: 'everest 1830'"},
      {"easting", [](Mapping& m, Sheet&) { m.numbers["false_easting"] = {1e200}; },
       "has an impossible false_easting: 1e+200"},
      {"unit", [](Mapping&, Sheet& s) { s.units = "1"; }, "needs the unit of 'x', which is '1'"},
      {"far",
       [](Mapping&, Sheet& s) {
         s.x = {0, 1e250};
       },
       "has coordinates far beyond its map"},
  };
}

std::vector<Refused> refused_kinds() {
  return {
      {"nowhere",
       [](Mapping& m, Sheet& s) {
         m = {"orthographic", with(sphere, at_origin(0, 0)), {}};
         s = {{7e6, 8e6}, {7e6, 8e6}};
       },
       "has no column on the Earth"},
      {"sweep",
       [](Mapping& m, Sheet&) {
         m = {"geostationary",
              with(wgs84, at_origin(0, 0, {{"perspective_point_height", {35785831}}})),
              {}};
       },
       "lacks its attribute sweep_angle_axis"},
      {"pole",
       [](Mapping& m, Sheet&) {
         m = {"polar_stereographic",
              with(sphere, at_origin(45, 0, {{"standard_parallel", {60}}})),
              {}};
       },
       "has its latitude_of_projection_origin not at a pole"},
      {"hemisphere",
       [](Mapping& m, Sheet&) {
         m = {"polar_stereographic",
              with(sphere, at_origin(90, 0, {{"standard_parallel", {-60}}})),
              {}};
       },
       "has its standard_parallel in the other hemisphere"},
      {"perspective",
       [](Mapping& m, Sheet&) {
         m = {"vertical_perspective",
              with(wgs84, at_origin(0, 0, {{"perspective_point_height", {35785831}}})),
              {}};
       },
       "is on an ellipsoid"},
  };
}

TEST(ProjectedGrids, WhatCannotBeComputedIsNotedAndShownAsAPlane) {
  std::vector<Refused> all = refused_values();
  for (const Refused& one : refused_kinds()) all.push_back(one);
  for (const Refused& one : all) {
    SCOPED_TRACE(one.label);
    const Folder folder;
    Mapping mapping = lambert;
    Sheet sheet = wide;
    one.spoil(mapping, sheet);
    const auto source = on_sheet(folder, mapping, sheet);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().grid.columns, nullptr);
    EXPECT_TRUE(has_note(source->info(),
                         "longitudes and latitudes are not computed: the map projection 'crs' " +
                             std::string(one.reason)))
        << testing::PrintToString(source->info().notes);
    EXPECT_EQ(volume_of(*source, "f").masked, 0);
  }
}

}  // namespace
}  // namespace windsplat::data::test::projected
