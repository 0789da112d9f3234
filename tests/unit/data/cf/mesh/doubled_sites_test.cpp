// Lists of positions with the same sites twice: equal, or slightly apart.
#include <gtest/gtest.h>

#include <cstddef>
#include <random>
#include <vector>

#include "server/data/cf/mesh/delaunay.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::doubled_sites {
namespace {

struct Sites {
  std::vector<double> x;
  std::vector<double> y;
};

// A second position of each, `apart` degrees east or west.
void add_second(Sites& sites, double apart) {
  const std::size_t count = sites.x.size();
  for (std::size_t n = 0; n < count; ++n) {
    sites.x.push_back(sites.x[n] + (n % 2 == 0 ? apart : -apart));
    sites.y.push_back(sites.y[n]);
  }
}

double linear(double x, double y) { return 100 + x - 2 * y; }

// 500 random sites in a degree: 0.04 degrees apart.
TEST(DoubledSites, ThoseOfASmallRegionAreOneUpToAHundredthOfTheSpacing) {
  for (const double apart : {1e-4, 4e-4}) {
    Sites sites;
    std::mt19937 random(7);
    const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
    for (std::size_t n = 0; n < 500; ++n) {
      sites.x.push_back(10 + part());
      sites.y.push_back(40 + part());
    }
    add_second(sites, apart);
    const auto found = cf::triangulate(sites.x, sites.y);
    ASSERT_TRUE(found) << found.error().message;
    // Random sites may lie nearly as close to others as to their second positions.
    EXPECT_GT(found->near, 450U) << apart;
    EXPECT_LE(found->near, 502U) << apart;
    EXPECT_LT(found->near_degrees, 2 * apart);
  }
}

// Of each site one of both positions has no value, at every other site the first.
TEST(DoubledSites, AreDrawnWithTheValueThatIsThere) {
  for (const double apart : {0.0, 1e-4, 2e-3}) {
    const Folder folder;
    Sites sites;
    std::mt19937 random(3);
    for (int n = 0; n < 30 * 30; ++n) {
      sites.x.push_back(20 + 0.1 * (n % 30) + 4e-12 * static_cast<double>(random()));
      sites.y.push_back(10 + 0.1 * (n / 30) + 4e-12 * static_cast<double>(random()));
    }
    add_second(sites, apart);
    std::vector<double> values;
    for (std::size_t n = 0; n < 1800; ++n) {
      const bool is_missing = (n < 900) == (n % 2 == 0);
      values.push_back(is_missing ? -9 : linear(sites.x[n], sites.y[n]));
    }
    {
      NetcdfMaker file(folder / "c.nc");
      const int column = file.dimension("ncol", sites.x.size());
      file.text(file.variable("lon", NC_DOUBLE, {column}, sites.x), "units", "degrees_east");
      file.text(file.variable("lat", NC_DOUBLE, {column}, sites.y), "units", "degrees_north");
      file.number(file.variable("T", NC_FLOAT, {column}, values), "_FillValue", NC_FLOAT, {-9});
    }
    const auto source = opened(folder / "c.nc");
    ASSERT_NE(source, nullptr);
    const Volume volume = volume_of(*source, "T");
    const auto& axes = source->info().grid.axes;
    const std::size_t width = axes[0].coordinates.size();
    std::size_t compared = 0;
    for (std::size_t n = 0; n < volume.values.size(); ++n) {
      const double x = axes[0].coordinates[n % width];
      const double y = axes[1].coordinates[n / width];
      if (x < 20.1 || x > 22.8 || y < 10.1 || y > 12.8) continue;
      ASSERT_NEAR(volume.values[n], linear(x, y), 1e-3 + 2 * apart) << x << ' ' << y;
      ++compared;
    }
    EXPECT_GT(compared, 500U);
  }
}

}  // namespace
}  // namespace windsplat::data::test::doubled_sites
