// Heights and pressures of parametric levels against the formulas of CF 1.11, appendix D, evaluated
// here with other groupings of terms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

struct Basin {
  std::vector<double> depth{20, 80, 300, 1500, 60, 4000};
  std::vector<double> level;
  std::vector<double> eta{0.5, -0.25, 0, 1, 0.125, -0.5};
};

// Levels of a standard name over a basin of 2 x 3 columns; terms with single values are variables.
void write_basin(const std::string& path, const Basin& basin, const std::string& standard_name,
                 const std::string& terms,
                 const std::vector<std::pair<std::string, double>>& single, const char* positive) {
  NetcdfMaker file(path);
  const int z = file.axis("lev", basin.level, "1", standard_name);
  file.text(file.variable_id("lev"), "formula_terms", terms);
  file.text(file.variable_id("lev"), "positive", positive);
  const int y = file.axis("lat", {10, 20}, "degrees_north");
  const int x = file.axis("lon", {30, 40, 50}, "degrees_east");
  file.variable("depth", NC_DOUBLE, {y, x}, basin.depth);
  file.variable("eta", NC_DOUBLE, {y, x}, basin.eta);
  for (const auto& [name, value] : single) file.variable(name, NC_DOUBLE, {}, {value});
  file.variable("f", NC_FLOAT, {z, y, x}, counting(6 * basin.level.size()));
}

TEST(LevelFormulas, StretchedLevelsOfTheOceanHaveTheirHeights) {
  const Folder folder;
  Basin basin;
  basin.level = {-1, -0.7, -0.4, 0};
  const double a = 5;
  const double b = 0.4;
  const double critical = 10;
  write_basin(folder / "s.nc", basin, "ocean_s_coordinate",
              "s: lev eta: eta depth: depth a: theta b: bottom depth_c: hc",
              {{"theta", a}, {"bottom", b}, {"hc", critical}}, "up");
  const auto source = opened(folder / "s.nc");
  const Volume height = volume_of(*source, "height");
  ASSERT_EQ(height.samples(), 24U);
  for (std::size_t k = 0; k < 4; ++k) {
    const double s = basin.level[k];
    // sinh(as)/sinh(a) by exponentials; tanh(a(s + 1/2)) likewise.
    const double sine = (std::exp(a * s) - std::exp(-a * s)) / (std::exp(a) - std::exp(-a));
    const double tangent = 1 - 2 / (1 + std::exp(2 * a * (s + 0.5)));
    const double half = 1 - 2 / (1 + std::exp(a));
    const double c = sine - b * sine + 0.5 * b * tangent / half - 0.5 * b;
    for (std::size_t n = 0; n < 6; ++n) {
      const double z =
          basin.eta[n] + s * (basin.eta[n] + critical - critical * c / s) + basin.depth[n] * c;
      const double expected = s == 0 ? basin.eta[n] + (basin.depth[n] - critical) * c : z;
      EXPECT_NEAR(height.values[k * 6 + n], expected, 2e-4 * (1 + std::abs(expected))) << k << n;
    }
  }
  // The floor and the surface, whatever the stretching.
  EXPECT_NEAR(height.values[5], -4000, 0.01);
  EXPECT_NEAR(height.values[18], 0.5, 1e-5);
  EXPECT_EQ(source->info().grid.axes[2].kind, AxisKind::height);
}

TEST(LevelFormulas, DoubleSigmaLevelsRunFromTheSurfaceThroughTheInterfaceToTheFloor) {
  const Folder folder;
  Basin basin;
  basin.level = {0, 0.5, 1, 1.5, 2};
  const double z1 = 10;
  const double z2 = 30;
  const double a = 2;
  const double reference = 100;
  write_basin(folder / "d.nc", basin, "ocean_double_sigma_coordinate",
              "sigma: lev depth: depth z1: z1 z2: z2 a: a href: href k_c: kc",
              {{"z1", z1}, {"z2", z2}, {"a", a}, {"href", reference}, {"kc", 3}}, "down");
  const auto source = opened(folder / "d.nc");
  const Volume height = volume_of(*source, "height");
  for (std::size_t n = 0; n < 6; ++n) {
    const double e = std::exp(4 * a / (z1 - z2) * (basin.depth[n] - reference));
    const double interface = 0.5 * (z1 + z2 + (z1 - z2) * (e - 1) / (e + 1));
    const double depth[] = {basin.depth[n], 0.5 * (basin.depth[n] + interface), interface,
                            0.5 * interface, 0};
    for (std::size_t k = 0; k < 5; ++k) {  // lowest first
      EXPECT_NEAR(height.values[k * 6 + n], -depth[k], 1e-3) << k << n;
    }
  }
}

TEST(LevelFormulas, LevelsOfSigmaAboveDepthsHaveNoHeightOnLand) {
  const Folder folder;
  const double none = -9999;
  const double critical = 50;
  const Basin basin;
  const std::vector<double> deep{-100, -60, none, none};
  const std::vector<double> sigma{none, none, -0.5, 0};
  {
    NetcdfMaker file(folder / "z.nc");
    const int z = file.axis("lev", {0, 1, 2, 3}, "1", "ocean_sigma_z_coordinate");
    file.text(file.variable_id("lev"), "formula_terms",
              "sigma: sigma eta: eta depth: depth depth_c: hc nsigma: count zlev: deep");
    file.text(file.variable_id("lev"), "positive", "up");
    const int y = file.axis("lat", {10, 20}, "degrees_north");
    const int x = file.axis("lon", {30, 40, 50}, "degrees_east");
    std::vector<double> depth = basin.depth;
    depth[4] = none;
    const std::vector<int> filled{file.variable("depth", NC_DOUBLE, {y, x}, depth),
                                  file.variable("deep", NC_DOUBLE, {z}, deep),
                                  file.variable("sigma", NC_DOUBLE, {z}, sigma)};
    for (const int v : filled) file.number(v, "_FillValue", NC_DOUBLE, {none});
    file.variable("eta", NC_DOUBLE, {y, x}, basin.eta);
    file.variable("hc", NC_DOUBLE, {}, {critical});
    file.variable("count", NC_DOUBLE, {}, {2});
    file.variable("f", NC_FLOAT, {z, y, x}, counting(24));
  }
  const auto source = opened(folder / "z.nc");
  const Volume height = volume_of(*source, "height");
  ASSERT_EQ(height.samples(), 24U);
  EXPECT_EQ(height.masked, 4 + 3);  // a column without a depth; levels below the floor
  for (std::size_t n = 0; n < 24; ++n) {
    const std::size_t column = n % 6;
    const std::size_t k = n / 6;
    const double eta = basin.eta[column];
    const double up = std::min(critical, basin.depth[column]) + eta;
    if (column == 4 || (k < 2 && deep[k] < -basin.depth[column])) {
      EXPECT_TRUE(std::isnan(height.values[n])) << k;
    } else {
      EXPECT_NEAR(height.values[n], k < 2 ? deep[k] : eta + sigma[k] * up, 1e-3) << n;
    }
  }
}

TEST(LevelFormulas, LevelsWithoutTheirTermsAreNoted) {
  const Folder folder;
  Basin basin;
  basin.level = {-1, 0};
  write_basin(folder / "s.nc", basin, "ocean_s_coordinate",
              "s: lev eta: eta depth: depth a: theta depth_c: hc", {{"theta", 5}, {"hc", 10}},
              "up");
  const auto source = opened(folder / "s.nc");
  EXPECT_EQ(source->info().find("height"), nullptr);
  EXPECT_TRUE(has_note(source->info(), "ocean_s_coordinate lacks its term 'b'"));
}

TEST(LevelFormulas, LogarithmsOfPressureBecomeAPressureAxis) {
  const Folder folder;
  {
    NetcdfMaker file(folder / "p.nc");
    const int z =
        file.axis("lev", {0, std::log(2), std::log(10)}, "1", "atmosphere_ln_pressure_coordinate");
    file.text(file.variable_id("lev"), "formula_terms", "p0: P0 lev: lev");
    file.text(file.variable("P0", NC_DOUBLE, {}, {1013.25}), "units", "hPa");
    const int y = file.axis("lat", {10, 20}, "degrees_north");
    const int x = file.axis("lon", {30, 40, 50}, "degrees_east");
    file.variable("f", NC_FLOAT, {z, y, x}, counting(18));
  }
  const auto source = opened(folder / "p.nc");
  const Axis& axis = source->info().grid.axes[2];
  EXPECT_EQ(axis.kind, AxisKind::pressure);
  EXPECT_EQ(axis.units, "Pa");
  ASSERT_EQ(axis.coordinates.size(), 3U);
  EXPECT_NEAR(axis.coordinates[0], 101325, 1e-6);
  EXPECT_NEAR(axis.coordinates[1], 50662.5, 1e-6);
  EXPECT_NEAR(axis.coordinates[2], 10132.5, 1e-6);
  EXPECT_EQ(volume_of(*source, "f").values[17], 17);
}

}  // namespace
}  // namespace windsplat::data::test
