// Grid mappings that have well-known text only, against the formulas of their projections.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/cf/projection_formulas.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::projected {
namespace {

const std::string wgs84_base =
    R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],)"
    R"(PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";

std::string projcs(const std::string& method, const std::string& parameters) {
  return R"(PROJCS["p",)" + wgs84_base + R"(,PROJECTION[")" + method + R"("],)" + parameters +
         R"(UNIT["metre",1]])";
}

std::string parameter(const std::string& name, const std::string& value) {
  return R"(PARAMETER[")" + name + R"(",)" + value + "],";
}

// The UTM zone 33 in WKT 2.
const std::string utm33 =
    R"(PROJCRS["WGS 84 / UTM zone 33N",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)"
    R"(ELLIPSOID["WGS 84",6378137,298.257223563,LENGTHUNIT["metre",1]]]],)"
    R"(CONVERSION["UTM zone 33N",)"
    R"(METHOD["Transverse Mercator",ID["EPSG",9807]],)"
    R"(PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]],)"
    R"(PARAMETER["Longitude of natural origin",15,ANGLEUNIT["degree",0.0174532925199433]],)"
    R"(PARAMETER["Scale factor at natural origin",0.9996,SCALEUNIT["unity",1]],)"
    R"(PARAMETER["False easting",500000,LENGTHUNIT["metre",1]],)"
    R"(PARAMETER["False northing",0,LENGTHUNIT["metre",1]]],CS[Cartesian,2],)"
    R"(AXIS["x",east,ORDER[1],LENGTHUNIT["metre",1]],)"
    R"(AXIS["y",north,ORDER[2],LENGTHUNIT["metre",1]]])";

struct WktCase {
  std::string wkt;
  Forward forward;
  Sheet sheet;
  std::string kind;
};

TEST(CrsWkt, PositionsInvertTheFormulas) {
  const Sheet utm_sheet{{300000, 500000, 750000}, {3e6, 5.3e6, 6e6}};
  const Body web{6378137, 0};
  const std::vector<WktCase> cases{
      {projcs("Lambert_Conformal_Conic_2SP",
              parameter("standard_parallel_1", "30") + parameter("standard_parallel_2", "60") +
                  parameter("latitude_of_origin", "45") + parameter("central_meridian", "-100") +
                  parameter("false_easting", "0") + parameter("false_northing", "0")),
       conformal_conic(wgs84, 30, 60, 45, -100), wide, "lambert_conformal_conic"},
      {utm33,
       [](double lon, double lat) {
         const Point at = transverse(wgs84, 0.9996, 15)(lon, lat);
         return Point{at.x + 500000, at.y};
       },
       utm_sheet, "transverse_mercator"},
      {projcs("Polar_Stereographic",
              parameter("latitude_of_origin", "-71") + parameter("central_meridian", "30") +
                  parameter("scale_factor", "1") + parameter("false_easting", "0") +
                  parameter("false_northing", "0")),
       polar(wgs84, -90, -71, 30), wide, "polar_stereographic"},
      {projcs("Albers_Conic_Equal_Area",
              parameter("standard_parallel_1", "30") + parameter("standard_parallel_2", "50") +
                  parameter("latitude_of_center", "40") + parameter("longitude_of_center", "-96") +
                  parameter("false_easting", "0") + parameter("false_northing", "0")),
       albers(wgs84, 30, 50, 40, -96), Sheet{{-1e6, 5e5}, {-5e5, 1e6}},
       "albers_conical_equal_area"},
      {R"(BOUNDCRS[SOURCECRS[)" + utm33 +
           R"(],TARGETCRS[GEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)"
           R"(ELLIPSOID["WGS 84",6378137,298.257223563]],CS[ellipsoidal,2],)"
           R"(AXIS["latitude",north],AXIS["longitude",east],)"
           R"(ANGLEUNIT["degree",0.0174532925199433]]],)"
           R"(ABRIDGEDTRANSFORMATION["t",METHOD["Geocentric translations"],)"
           R"(PARAMETER["X-axis translation",0],PARAMETER["Y-axis translation",0],)"
           R"(PARAMETER["Z-axis translation",0]]])",
       [](double lon, double lat) {
         const Point at = transverse(wgs84, 0.9996, 15)(lon, lat);
         return Point{at.x + 500000, at.y};
       },
       utm_sheet, "transverse_mercator"},
      {R"(PROJCRS["web",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)"
       R"(ELLIPSOID["WGS 84",6378137,298.257223563]]],CONVERSION["c",)"
       R"(METHOD["Popular Visualisation Pseudo Mercator",ID["EPSG",1024]],)"
       R"(PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]],)"
       R"(PARAMETER["Longitude of natural origin",0,ANGLEUNIT["degree",0.0174532925199433]],)"
       R"(PARAMETER["False easting",0,LENGTHUNIT["metre",1]],)"
       R"(PARAMETER["False northing",0,LENGTHUNIT["metre",1]]],CS[Cartesian,2],)"
       R"(AXIS["x",east],AXIS["y",north],LENGTHUNIT["metre",1]])",
       mercator(web, 0, 0), wide, "mercator"},
  };
  for (const char* attribute : {"crs_wkt", "spatial_ref"}) {
    for (const WktCase& one : cases) {
      const Folder folder;
      const auto source = on_sheet(folder, {"", {}, {{attribute, one.wkt}}}, one.sheet);
      ASSERT_NE(source, nullptr);
      const auto& columns = source->info().grid.columns;
      ASSERT_NE(columns, nullptr) << one.kind << ": " << source->info().notes.at(0);
      const std::size_t width = one.sheet.x.size();
      for (std::size_t n = 0; n < columns->longitude.size(); ++n) {
        const Point at = one.forward(columns->longitude[n], columns->latitude[n]);
        EXPECT_NEAR(at.x, one.sheet.x[n % width], 0.02) << one.kind << n;
        EXPECT_NEAR(at.y, one.sheet.y[n / width], 0.02) << one.kind << n;
      }
      EXPECT_TRUE(has_note(source->info(), "map projection 'crs' (" + one.kind + ")"));
      EXPECT_EQ(has_note(source->info(), "has a datum shift"), one.wkt.starts_with("BOUNDCRS"));
    }
  }
}

TEST(CrsWkt, WhatIsNotKnownIsNoted) {
  for (const auto& [wkt, reason] : std::vector<std::pair<std::string, std::string>>{
           {"PROJCS[", "has well-known text that PROJ does not understand"},
           {R"(GEOGCRS["rotated",BASEGEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)"
            R"(ELLIPSOID["WGS 84",6378137,298.257223563]]],DERIVINGCONVERSION["pole",)"
            R"(METHOD["PROJ ob_tran o_proj=longlat"],)"
            R"(PARAMETER["o_lat_p",39.25,ANGLEUNIT["degree",0.0174532925199433]],)"
            R"(PARAMETER["lon_0",18,ANGLEUNIT["degree",0.0174532925199433]]],)"
            R"(CS[ellipsoidal,2],AXIS["latitude",north],AXIS["longitude",east],)"
            R"(ANGLEUNIT["degree",0.0174532925199433]])",
            "a derived geographic system"},
           {R"(LOCAL_CS["l",UNIT["metre",1]])", "neither geographic nor projected"},
           {projcs("Cassini_Soldner",
                   parameter("latitude_of_origin", "45") + parameter("central_meridian", "0")),
            "of the unknown conversion 'Cassini-Soldner'"},
           {projcs("Lambert_Conformal_Conic_1SP", parameter("latitude_of_origin", "45") +
                                                      parameter("central_meridian", "0") +
                                                      parameter("scale_factor", "0.9")),
            "a cone with a scale factor other than 1"}}) {
    const Folder folder;
    const auto source = on_sheet(folder, {"", {}, {{"crs_wkt", wkt}}});
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().grid.columns, nullptr);
    EXPECT_TRUE(has_note(source->info(),
                         "longitudes and latitudes are not computed: the map "
                         "projection 'crs' "));
    EXPECT_TRUE(has_note(source->info(), reason)) << source->info().notes.at(0);
  }
}

}  // namespace
}  // namespace windsplat::data::test::projected
