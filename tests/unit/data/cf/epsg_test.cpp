// Grids whose map projection is an EPSG code alone, against the formulas of their projections.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/grid/crs_wkt.hpp"
#include "tests/unit/data/cf/projection_formulas.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::projected {
namespace {

// In zone 33 of UTM, or on a map of the web.
const Sheet sheet{{2e5, 5e5, 7e5}, {4.9e6, 5.1e6, 5.3e6, 5.5e6}};

// How far the columns lie from the sheet in metres, at most.
double offset(const Source& source, const Forward& forward, double false_easting) {
  const auto& columns = source.info().grid.columns;
  if (columns == nullptr) return infinite;
  double worst = 0;
  for (std::size_t n = 0; n < columns->longitude.size(); ++n) {
    const Point at = forward(columns->longitude[n], columns->latitude[n]);
    const std::size_t width = sheet.x.size();
    worst = std::max({worst, std::abs(at.x + false_easting - sheet.x[n % width]),
                      std::abs(at.y - sheet.y[n / width])});
  }
  return worst;
}

TEST(EpsgCodes, OfAGridMappingPlaceTheColumns) {
  const Forward zone = transverse(wgs84, 0.9996, 15);
  const Mapping as_text{"", {}, {{"epsg_code", "EPSG:32633"}}};
  const Mapping as_urn{"", {}, {{"crs_wkt", "urn:ogc:def:crs:EPSG::32633"}}};
  const Mapping as_number{"", {{"epsg", {32633}}}, {}};
  for (const Mapping& mapping : {as_text, as_urn, as_number}) {
    const Folder folder;
    const auto source = on_sheet(folder, mapping, sheet);
    ASSERT_NE(source, nullptr);
    EXPECT_LT(offset(*source, zone, 5e5), 0.02);
    EXPECT_TRUE(has_note(source->info(), "map projection 'crs' (transverse_mercator)"));
  }
}

TEST(EpsgCodes, OfAFieldWithoutAGridMappingPlaceItsColumns) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "f.nc");
    const int y = file.axis("y", sheet.y, "m", "projection_y_coordinate");
    const int x = file.axis("x", sheet.x, "m", "projection_x_coordinate");
    const int f = file.variable("f", NC_FLOAT, {y, x}, std::vector<double>(12, 1));
    file.text(f, "crs", "EPSG:3857");
  }
  const auto source = opened(folder / "f.nc");
  ASSERT_NE(source, nullptr);
  // EPSG guidance note 7-2, method 1024: the formulas of a sphere.
  const Forward web = [](double longitude, double latitude) {
    return Point{6378137 * longitude * degree, 6378137 * std::asinh(std::tan(latitude * degree))};
  };
  EXPECT_LT(offset(*source, web, 0), 0.02);
}

TEST(EpsgCodes, ThatAreUnknownOrOfOtherProjectionsAreNoted) {
  for (const auto& [code, reason] :
       {std::pair("EPSG:999999",
                  "has the EPSG code 999999 which the database of PROJ does not have"),
        std::pair("EPSG:28992",
                  "has the EPSG code 28992 of the unknown conversion 'Oblique Stereographic'"),
        std::pair("EPSG:5714", "neither geographic nor projected")}) {
    const Folder folder;
    const auto source = on_sheet(folder, {"", {}, {{"epsg_code", code}}}, sheet);
    ASSERT_NE(source, nullptr);
    EXPECT_EQ(source->info().grid.columns, nullptr);
    EXPECT_TRUE(has_note(source->info(), reason)) << code;
  }
}

TEST(EpsgCodes, AreNumbersWithOrWithoutAPrefix) {
  EXPECT_EQ(cf::epsg_code_of("EPSG:3857"), 3857);
  EXPECT_EQ(cf::epsg_code_of("epsg:32633"), 32633);
  EXPECT_EQ(cf::epsg_code_of("urn:ogc:def:crs:EPSG::4326"), 4326);
  EXPECT_EQ(cf::epsg_code_of("2154"), 2154);
  for (const char* text : {"", "EPSG:", "EPSG:3857+5714", "WGS84", "-1", "99999999999", "0"}) {
    EXPECT_EQ(cf::epsg_code_of(text), std::nullopt) << text;
  }
}

// Variables of the environment, restored at the end of a test.
class Environment {
 public:
  explicit Environment(const std::vector<std::pair<const char*, std::string>>& values) {
    for (const auto& [name, value] : values) {
      const char* const old = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
      before_.emplace_back(name, old == nullptr ? std::nullopt : std::optional<std::string>(old));
      set(name, value);
    }
  }
  ~Environment() {
    for (const auto& [name, value] : before_) set(name, value);
  }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  static void set(const char* name, const std::optional<std::string>& value) {
    if (value) {
      ::setenv(name, value->c_str(), 1);  // NOLINT(concurrency-mt-unsafe)
    } else {
      ::unsetenv(name);  // NOLINT(concurrency-mt-unsafe)
    }
  }

  std::vector<std::pair<const char*, std::optional<std::string>>> before_;
};

TEST(EpsgCodes, TheDatabaseIsInTheFirstFolderOfTheEnvironmentThatHasOne) {
  const Folder folder;
  for (const char* name : {"first", "second", "home/.local/share/proj"}) {
    std::filesystem::create_directories(folder / name);
    write_bytes(folder / (name + std::string("/proj.db")), "a database");
  }
  const std::string none = folder / "none";
  const std::string first = folder / "first";
  const std::string second = folder / "second";
  const std::string home = folder / "home";
  const auto found = [](const std::string& data, const std::string& lib, const std::string& at) {
    const Environment environment({{"PROJ_DATA", data}, {"PROJ_LIB", lib}, {"HOME", at}});
    return cf::projection_database_folder();
  };
  EXPECT_EQ(found(first, second, home), first);
  EXPECT_EQ(found(none + "::" + second + ":" + first, "", home), second);
  EXPECT_EQ(found(none, second, home), second);
  EXPECT_EQ(found("", "", home), home + "/.local/share/proj");
  EXPECT_EQ(found(std::filesystem::relative(first).string(), second, home),
            std::filesystem::absolute(std::filesystem::relative(first)).string());
}

}  // namespace
}  // namespace windsplat::data::test::projected
