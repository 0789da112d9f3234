// Terrain-following levels and derived fields. Expected values are the formulas of CF (appendix D),
// tables of the standard atmosphere, and for vinth2p.nc the result of numpy: a*1e5 + b*PS of hyam,
// hybm and PS in double; PS[0].mean() is 96608.06500816345 Pa.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "server/data/cf/fields/atmosphere.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

std::string real_file(const std::string& name) {
  const char* folder = std::getenv("WINDSPLAT_TEST_DATA");
  return (folder != nullptr ? std::string(folder)
                            : std::string(WINDSPLAT_SOURCE_DIR) + "/build/test-data") +
         "/" + name;
}

TEST(StandardAtmosphere, MatchesTheTableOfTheStandard) {
  // ISO 2533: geopotential height, temperature, pressure.
  struct Row {
    double height, kelvin, pascals;
  };
  for (const Row& row :
       {Row{0, 288.15, 101325}, Row{5000, 255.65, 54019.9}, Row{11000, 216.65, 22632.1},
        Row{15000, 216.65, 12044.6}, Row{20000, 216.65, 5474.89}, Row{32000, 228.65, 868.019},
        Row{47000, 270.65, 110.906}, Row{51000, 270.65, 66.9389}, Row{71000, 214.65, 3.95642}}) {
    EXPECT_NEAR(cf::standard_height(row.pascals), row.height, 0.1) << row.pascals;
    EXPECT_NEAR(cf::standard_temperature(row.pascals), row.kelvin, 0.001) << row.pascals;
  }
  EXPECT_TRUE(std::isnan(cf::standard_height(0)));
  EXPECT_TRUE(std::isnan(cf::standard_height(-5)));
}

TEST(HybridLevels, Vinth2pHasThePressuresOfItsFormula) {
  auto source = open_file(real_file("vinth2p.nc"));
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  const Axis& z = info.grid.axes[2];
  EXPECT_EQ(z.kind, AxisKind::pressure);
  EXPECT_EQ(z.units, "Pa");
  ASSERT_EQ(z.coordinates.size(), 18U);
  // PS is float32, and its mean is over the read values: to 1e-7.
  EXPECT_NEAR(z.coordinates[0], 95886.22888248185, 0.01);
  EXPECT_NEAR(z.coordinates[1], 93757.4667948502, 0.01);
  EXPECT_NEAR(z.coordinates[17], 480.9299949556589, 1e-4);
  EXPECT_TRUE(has_note(info, "using 1000 hPa"));  // P0 is named, but missing in the file
  EXPECT_EQ(reason_of(info, "PS"), "surface pressure: gives the pressure of the levels");
  EXPECT_EQ(reason_of(info, "hyam"), "coefficient of the levels' pressure");
  ASSERT_NE(info.find("pressure"), nullptr);
  EXPECT_EQ(info.find("pressure")->units, "Pa");
  EXPECT_TRUE(info.find("pressure")->derived);
  const Volume pressure = volume_of(**source, "pressure", 1);
  // p[lev 17, lat 10, lon 20], p[9, 40, 100], p[0, 0, 0] in the order of the file, whose levels run
  // downward.
  const auto at = [](std::size_t x, std::size_t y, std::size_t z_up) {
    return x + 128 * (y + 64 * z_up);
  };
  EXPECT_NEAR(pressure.values[at(20, 10, 0)], 97753.21846229956, 0.02);
  EXPECT_NEAR(pressure.values[at(100, 40, 8)], 41508.1758695615, 0.02);
  EXPECT_NEAR(pressure.values[at(0, 0, 17)], 480.9299949556589, 1e-4);
  EXPECT_NEAR(pressure.range[1], 105637.21889178269, 0.02);
  EXPECT_EQ(volume_of(**source, "T", 1).values[at(100, 40, 8)], 255.93446F);
  const Volume height = volume_of(**source, "standard_height", 1);
  EXPECT_NEAR(height.values[at(100, 40, 8)], cf::standard_height(41508.1758695615), 0.1);
}

struct Levels {
  std::string formula;
  std::vector<double> a;
  std::string a_units;
  bool top_first = true;
  bool says_down = true;
  double reference = 1000;
  std::string reference_units = "hPa";
};

// Two levels, 2 x 2 columns, surface pressures 1000, 900, 800 hPa and missing.
void write_hybrid(const std::string& path, const Levels& levels) {
  NetcdfMaker file(path);
  const int z = file.dimension("lev", 2);
  const int lev = file.variable("lev", NC_DOUBLE, {z}, {1, 2});
  file.text(lev, "units", "1");
  if (levels.says_down) file.text(lev, "positive", levels.top_first ? "down" : "up");
  if (!levels.formula.empty()) file.text(lev, "formula_terms", levels.formula);
  const int y = file.axis("lat", {0, 10}, "degrees_north");
  const int x = file.axis("lon", {0, 10}, "degrees_east");
  std::vector<double> b{0.25, 1};
  std::vector<double> a = levels.a;
  if (!levels.top_first) {
    std::swap(a[0], a[1]);
    std::swap(b[0], b[1]);
  }
  const int av = file.variable("A", NC_DOUBLE, {z}, a);
  if (!levels.a_units.empty()) file.text(av, "units", levels.a_units);
  file.variable("B", NC_DOUBLE, {z}, b);
  const int p0 = file.variable("P0", NC_DOUBLE, {}, {levels.reference});
  file.text(p0, "units", levels.reference_units);
  const int ps = file.variable("PS", NC_FLOAT, {y, x}, {1000, 900, 800, -1});
  file.text(ps, "units", "hPa");
  file.number(ps, "_FillValue", NC_FLOAT, {-1});
  file.variable("f", NC_FLOAT, {z, y, x}, counting(8));
}

TEST(HybridLevels, FormsOfTheFormulaGiveTheSamePressures) {
  // p = 100 hPa + 0.25 ps above and ps below; their means over 900 hPa are 325 and 900.
  const std::vector<Levels> cases{
      {"a: A b: B p0: P0 ps: PS", {0.1, 0}, "", true, true},
      {"ap: A b: B ps: PS", {100, 0}, "hPa", true, true},
      {"ap: A b: B ps: PS", {10000, 0}, "Pa", false, true},
      {"a: A  b: B\tp0: P0 ps: PS", {0.1, 0}, "", true, false},  // no attribute says that the
                                                                 // levels run downward
      {"a: A b: B p0: P0 ps: PS", {0.1, 0}, "", true, true, 100, "kPa"}};
  for (const Levels& levels : cases) {
    const Folder folder;
    write_hybrid(folder / "h.nc", levels);
    auto source = open_file(folder / "h.nc");
    ASSERT_TRUE(source) << source.error().message;
    const Axis& z = (*source)->info().grid.axes[2];
    EXPECT_EQ(z.kind, AxisKind::pressure);
    EXPECT_EQ(z.units, "hPa");
    ASSERT_EQ(z.coordinates.size(), 2U);
    EXPECT_NEAR(z.coordinates[0], 900, 1e-9) << levels.formula;
    EXPECT_NEAR(z.coordinates[1], 325, 1e-9) << levels.formula;
    const Volume p = volume_of(**source, "pressure");
    EXPECT_FLOAT_EQ(p.values[0], 1000);
    EXPECT_FLOAT_EQ(p.values[2], 800);
    EXPECT_FLOAT_EQ(p.values[4], 350);
    EXPECT_FLOAT_EQ(p.values[6], 300);
    EXPECT_EQ(p.masked, 2);  // where the surface pressure is missing
    // The field is on the levels whose pressures are given.
    EXPECT_EQ(volume_of(**source, "f").values[0], levels.top_first ? 4 : 0);
  }
}

TEST(HybridLevels, SigmaUsesThePressureAtItsTop) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "s.nc");
    const int z = file.axis("sigma", {1, 0.5}, "1", "atmosphere_sigma_coordinate");
    file.text(file.variable_id("sigma"), "formula_terms", "sigma: sigma ps: ps ptop: PTOP");
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10}, "degrees_east");
    file.text(file.variable("PTOP", NC_DOUBLE, {}, {20}), "units", "hPa");
    file.text(file.variable("ps", NC_FLOAT, {y, x}, {100000, 100000, 90000, 90000}), "units", "Pa");
    file.variable("f", NC_FLOAT, {z, y, x}, counting(8));
  }
  auto source = open_file(folder / "s.nc");
  ASSERT_TRUE(source) << source.error().message;
  const Volume p = volume_of(**source, "pressure");
  EXPECT_FLOAT_EQ(p.values[0], 100000);  // ptop + 1 (ps - ptop)
  EXPECT_FLOAT_EQ(p.values[4], 51000);   // 2000 + 0.5 (100000 - 2000)
  EXPECT_FLOAT_EQ(p.values[7], 46000);
}

// p = ptop + sigma (ps - ptop) at sigma 0.5 and 100000 Pa, with ptop incomplete.
TEST(HybridLevels, MissingTopIsNotedAndATopWithoutUnitUsesThatOfTheSurface) {
  struct Case {
    const char* formula;
    const char* ptop_units;
    double ptop;
    const char* ps_units;
    double half;  // Pa
    const char* note;
  };
  for (const Case& c :
       {Case{"sigma: sigma ps: ps ptop: absent", "Pa", 2000, "Pa", 50000,
             "the pressure at the top, 'absent', is not in the file: using 0"},
        Case{"sigma: sigma ps: ps", "Pa", 2000, "Pa", 50000, "has no pressure at the top: using 0"},
        Case{"sigma: sigma ps: ps ptop: PTOP", "Pa", 1000, "Pa", 50500, ""},
        Case{"sigma: sigma ps: ps ptop: PTOP", "", 1000, "Pa", 50500, ""},
        Case{"sigma: sigma ps: ps ptop: PTOP", "", 10, "hPa", 50500, ""}}) {
    const Folder folder;
    {
      NetcdfMaker file(folder / "s.nc");
      const int z = file.axis("sigma", {1, 0.5}, "1", "atmosphere_sigma_coordinate");
      file.text(file.variable_id("sigma"), "formula_terms", c.formula);
      const int y = file.axis("lat", {0, 10}, "degrees_north");
      const int x = file.axis("lon", {0, 10}, "degrees_east");
      const int top = file.variable("PTOP", NC_DOUBLE, {}, {c.ptop});
      if (*c.ptop_units != '\0') file.text(top, "units", c.ptop_units);
      const bool hecto = *c.ps_units == 'h';
      file.text(file.variable("ps", NC_FLOAT, {y, x}, std::vector<double>(4, hecto ? 1000 : 1e5)),
                "units", c.ps_units);
      file.variable("f", NC_FLOAT, {z, y, x}, counting(8));
    }
    auto source = open_file(folder / "s.nc");
    ASSERT_TRUE(source) << source.error().message;
    const double unit = *c.ps_units == 'h' ? 100 : 1;
    EXPECT_FLOAT_EQ(volume_of(**source, "pressure").values[4] * unit, c.half) << c.ptop;
    EXPECT_EQ(has_note((*source)->info(), "using 0"), *c.note != '\0');
    EXPECT_TRUE(has_note((*source)->info(), c.note));
  }
}

TEST(HybridLevels, WithoutSurfacePressureLevelsStayLevels) {
  const Folder folder;
  write_hybrid(folder / "h.nc", {"a: A b: B p0: P0 ps: absent", {0.1, 0}, "", true, true});
  auto source = open_file(folder / "h.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().grid.axes[2].kind, AxisKind::level);
  EXPECT_EQ((*source)->info().find("pressure"), nullptr);
}

// A chunk of 256 MiB in a file of less than 1 MiB: more than opening may decode.
std::vector<std::size_t> chunk_beyond_the_limit(std::size_t values_a_step, std::size_t rank) {
  std::vector<std::size_t> chunk(rank, 2);
  chunk[0] = (std::size_t{64} << 20) / values_a_step;
  return chunk;
}

TEST(HybridLevels, WithOversizeSurfacePressureLevelsStayLevels) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "h.nc");
    const int t = file.dimension("time", NC_UNLIMITED);
    const int z = file.dimension("lev", 2);
    const int lev = file.variable("lev", NC_DOUBLE, {z}, {1, 2});
    file.text(lev, "formula_terms", "ap: A b: B ps: PS");
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10}, "degrees_east");
    file.text(file.variable("A", NC_DOUBLE, {z}, {100, 0}), "units", "hPa");
    file.variable("B", NC_DOUBLE, {z}, {0.25, 1});
    const int ps = file.variable("PS", NC_FLOAT, {t, y, x}, {1000, 900, 800, 700});
    file.text(ps, "units", "hPa");
    file.deflate(ps);
    file.chunk(ps, chunk_beyond_the_limit(4, 3));
    file.variable("f", NC_FLOAT, {t, z, y, x}, counting(8));
  }
  auto source = open_file(folder / "h.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().grid.axes[2].kind, AxisKind::level);
  EXPECT_TRUE(has_note((*source)->info(), "terrain-following levels of unknown pressure"));
  EXPECT_TRUE(has_note((*source)->info(), "'PS' is too large"));
  EXPECT_EQ(volume_of(**source, "f").masked, 0);
}

// u, v, omega and perhaps a temperature on two pressure levels.
void write_omega(const std::string& path, const std::string& temperature_units,
                 const std::vector<double>& temperature, const char* omega_units = "Pa s-1") {
  NetcdfMaker file(path);
  const int z = file.axis("plev", {50000, 100000}, "Pa", "air_pressure");
  const int y = file.axis("lat", {0, 10}, "degrees_north");
  const int x = file.axis("lon", {0, 10}, "degrees_east");
  const auto add = [&](const char* name, const char* standard, const char* units,
                       const std::vector<double>& values) {
    const int v = file.variable(name, NC_FLOAT, {z, y, x}, values);
    file.text(v, "standard_name", standard);
    file.text(v, "units", units);
    file.number(v, "_FillValue", NC_FLOAT, {-999});
  };
  add("ua", "eastward_wind", "m s-1", counting(8));
  add("va", "northward_wind", "m s-1", counting(8, 10));
  add("wap", "lagrangian_tendency_of_air_pressure", omega_units, {1, 1, 1, -999, -2, -2, -2, -2});
  if (!temperature.empty()) add("ta", "air_temperature", temperature_units.c_str(), temperature);
  file.text(file.variable("ps", NC_FLOAT, {y, x}, counting(4, 99000)), "units", "Pa");
}

TEST(Omega, BecomesMetersPerSecondByTheTemperatureOfTheFile) {
  struct Case {
    std::string units;
    double value;
  };
  for (const Case& c : {Case{"K", 250}, Case{"degC", -23.15}, Case{"C", 250}}) {
    const Folder folder;
    write_omega(folder / "o.nc", c.units, std::vector<double>(8, c.value));
    auto source = open_file(folder / "o.nc");
    ASSERT_TRUE(source) << source.error().message;
    const DatasetInfo& info = (*source)->info();
    ASSERT_NE(info.find("wind_m"), nullptr);
    EXPECT_EQ(info.first(FieldKind::vector)->name, "wind");  // the vector of the file precedes the
                                                             // derived one
    EXPECT_EQ(info.find("wind_m")->component_units,
              (std::vector<std::string>{"m s-1", "m s-1", "m s-1"}));
    const Volume wind = volume_of(**source, "wind_m");
    // w = -omega R T / (p g) with R = 287.05, T = 250, g = 9.80665; levels are numbered upward.
    EXPECT_NEAR(wind.component(2)[0], 2 * 287.05 * 250 / (100000 * 9.80665), 1e-6);
    EXPECT_NEAR(wind.component(2)[4], -1 * 287.05 * 250 / (50000 * 9.80665), 1e-6);
    EXPECT_EQ(wind.component(0)[0], 4);
    EXPECT_EQ(wind.component(1)[4], 10);
    EXPECT_EQ(wind.masked, 1);
    EXPECT_TRUE(std::isnan(wind.component(0)[7]));
    EXPECT_TRUE(has_note(info, "the temperature 'ta'"));
    EXPECT_TRUE(has_note(info, "'wind' is in 'Pa s-1': its lines point up where air rises"));
    EXPECT_EQ(has_note(info, "values in kelvin"), c.units == "C");
    EXPECT_TRUE(has_note(info, "'ps' is the surface pressure"));
    // No sample is masked for being below the surface pressure.
    EXPECT_EQ(volume_of(**source, "ua").masked, 0);
  }
}

// A missing unit follows from the standard name: Pa s-1. Rendering converts by the unit.
TEST(Omega, StaysWhenReadingTheTemperatureExceedsTheLimit) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "o.nc");
    const int t = file.dimension("time", NC_UNLIMITED);
    const int z = file.axis("plev", {50000, 100000}, "Pa", "air_pressure");
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10}, "degrees_east");
    for (const char* name : {"u", "v", "omega", "T"}) {
      const int v = file.variable(name, NC_FLOAT, {t, z, y, x}, counting(8));
      file.text(v, "units", *name == 'T' ? "degC" : *name == 'o' ? "Pa s-1" : "m s-1");
      if (*name != 'T') continue;
      file.text(v, "standard_name", "air_temperature");
      file.deflate(v);
      file.chunk(v, chunk_beyond_the_limit(8, 4));
    }
  }
  auto source = open_file(folder / "o.nc");
  ASSERT_TRUE(source) << source.error().message;
  const DatasetInfo& info = (*source)->info();
  EXPECT_NE(info.find("wind"), nullptr);
  EXPECT_NE(info.find("T"), nullptr);
  EXPECT_EQ(info.find("wind_m"), nullptr);
  EXPECT_TRUE(has_note(info, "the vertical part of 'wind' is not converted to metres per second"));
  EXPECT_TRUE(has_note(info, "'T' is too large"));
}

TEST(Omega, IsRecognizedByUnitOrStandardName) {
  for (const auto& [written, told] : {std::pair("", "Pa s-1"), {"Pa/sec", "Pa/sec"}}) {
    const Folder folder;
    write_omega(folder / "o.nc", "", {}, written);
    auto source = open_file(folder / "o.nc");
    ASSERT_TRUE(source) << source.error().message;
    const DatasetInfo& info = (*source)->info();
    EXPECT_EQ(info.find("wind")->component_units.at(2), told);
    EXPECT_TRUE(has_note(info, "'wind' is in '" + std::string(told) + "': its lines point up"));
    EXPECT_NE(info.find("wind_m"), nullptr);
  }
}

TEST(Omega, WithoutATemperatureUsesTheStandardAtmosphere) {
  const Folder folder;
  write_omega(folder / "o.nc", "", {});
  auto source = open_file(folder / "o.nc");
  ASSERT_TRUE(source) << source.error().message;
  const Volume wind = volume_of(**source, "wind_m");
  // ISO 2533: at 500 hPa 251.92 K (5574 m), at 1000 hPa 287.43 K.
  EXPECT_NEAR(wind.component(2)[4], -1 * 287.05 * 251.92 / (50000 * 9.80665), 2e-4);
  EXPECT_NEAR(wind.component(2)[0], 2 * 287.05 * 287.43 / (100000 * 9.80665), 1e-4);
  EXPECT_TRUE(has_note((*source)->info(), "the ICAO standard atmosphere's temperature"));
}

TEST(Heights, FromGeopotentialAndFromTheStandardAtmosphere) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "z.nc");
    const int z = file.axis("plev", {1000, 500}, "hPa", "air_pressure");
    const int y = file.axis("lat", {0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10}, "degrees_east");
    const int v = file.variable("z", NC_DOUBLE, {z, y, x},
                                {0, 9.80665, 98.0665, 980.665, 49033.25, 49033.25, 49033.25, 0});
    file.text(v, "units", "m**2 s**-2");
    file.text(v, "standard_name", "geopotential");
  }
  auto source = open_file(folder / "z.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().find("height")->units, "m");
  const Volume height = volume_of(**source, "height");
  const std::vector<float> expected{0, 1, 10, 100, 5000, 5000, 5000, 0};
  for (std::size_t i = 0; i < 8; ++i) EXPECT_FLOAT_EQ(height.values[i], expected[i]);
  const Volume standard = volume_of(**source, "standard_height");
  EXPECT_NEAR(standard.values[0], 110.9, 0.1);   // ISO 2533: 1000 hPa is at 111 m
  EXPECT_NEAR(standard.values[7], 5574.4, 0.2);  // 500 hPa at 5574 m
}

TEST(Heights, MissingLevelsOfARealFileAreMasked) {
  // contour.cdf: valid_range and fill value mask 8988 samples of Z at the first step: 224 on each
  // of the lowest three levels, and all 33 x 36 = 1188 on each higher level except one (by
  // netCDF4's masks).
  auto source = open_file(real_file("contour.cdf"));
  ASSERT_TRUE(source) << source.error().message;
  const Volume z = volume_of(**source, "Z", 0);
  EXPECT_EQ(z.masked, 8988);
  EXPECT_EQ(volume_of(**source, "Z", 1).masked, 9952);
  for (std::size_t level = 0; level < 10; ++level) {
    int masked = 0;
    for (std::size_t n = 0; n < 1188; ++n) masked += std::isnan(z.values[level * 1188 + n]) ? 1 : 0;
    EXPECT_EQ(masked, level < 3 ? 224 : 1188) << level;
  }
  const Volume height = volume_of(**source, "height", 0);
  EXPECT_EQ(height.masked, 8988);
  EXPECT_FLOAT_EQ(height.range[1], z.range[1]);
}

TEST(Heights, OceanDepthsRunDownAndLandIsMasked) {
  // levitus_climatology.cdf: netCDF4 counts 577275 masked values of TEMP, 57917 of them at the
  // deepest of 20 levels and 22636 at the surface; TEMP[0, 90, 180] is 26.794998.
  auto source = open_file(real_file("levitus_climatology.cdf"));
  ASSERT_TRUE(source) << source.error().message;
  const Axis& z = (*source)->info().grid.axes[2];
  EXPECT_EQ(z.kind, AxisKind::depth);
  EXPECT_EQ(z.coordinates.front(), 5000);
  EXPECT_EQ(z.coordinates.back(), 0);
  EXPECT_EQ((*source)->info().find("standard_height"), nullptr);
  const Volume temperature = volume_of(**source, "TEMP");
  EXPECT_EQ(temperature.masked, 577275);
  EXPECT_EQ(temperature.range, (std::array<float, 2>{-2.02F, 29.740002F}));
  constexpr std::size_t layer = 360 * 180;
  const auto masked_at = [&](std::size_t level) {
    int masked = 0;
    for (std::size_t n = 0; n < layer; ++n) {
      masked += std::isnan(temperature.values[level * layer + n]) ? 1 : 0;
    }
    return masked;
  };
  EXPECT_EQ(masked_at(0), 57917);
  EXPECT_EQ(masked_at(19), 22636);
  EXPECT_EQ(temperature.values[19 * layer + 90 * 360 + 180], 26.794998F);
}

}  // namespace
}  // namespace windsplat::data::test
