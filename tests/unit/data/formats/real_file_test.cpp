// A file that was not made for these tests: NCL's nc4uvt.nc (Debian package libncarg-data), fetched
// by scripts/fetch-test-data. The expected values were read by other programs; each can be
// verified:
//   ncdump -h nc4uvt.nc                    dimensions, units, fill
//   ncdump -p 9 -v lev,lat,lon nc4uvt.nc   coordinates
//   python3 -c 'import netCDF4; d = netCDF4.Dataset("nc4uvt.nc"); print(d["U"][0, 7, 42, 114])'
//   (indices in the file are time, lev from the ground up, lat from the south, lon from -180).
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/test_data.hpp"

namespace windsplat::data {
namespace {

std::string real_file() { return test::test_data("nc4uvt.nc"); }

class RealFile : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(std::filesystem::exists(real_file()))
        << real_file() << " is missing: run scripts/fetch-test-data";
    auto opened = open_file(real_file());
    ASSERT_TRUE(opened) << opened.error().message;
    source_ = std::move(*opened);
  }

  const DatasetInfo& info() { return source_->info(); }

  Volume volume(const std::string& field) {
    const auto index = static_cast<std::size_t>(info().find(field) - info().fields.data());
    auto volume = source_->read(index, 0);
    EXPECT_TRUE(volume) << volume.error().message;
    return volume ? std::move(*volume) : Volume();
  }

  std::unique_ptr<Source> source_;
};

// The sample nearest to a position, by axis coordinates.
float at(const DatasetInfo& info, const Volume& volume, int component, double lon, double lat,
         double hpa) {
  const std::array<double, 3> place{lon, lat, hpa};
  std::array<std::size_t, 3> index{};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& coordinates = info.grid.axes[a].coordinates;
    for (std::size_t i = 0; i < coordinates.size(); ++i) {
      if (std::abs(coordinates[i] - place[a]) < std::abs(coordinates[index[a]] - place[a])) {
        index[a] = i;
      }
    }
  }
  const auto dims = info.grid.dims();
  return volume.component(
      component)[index[0] + static_cast<std::size_t>(dims[0]) *
                                (index[1] + static_cast<std::size_t>(dims[1]) * index[2])];
}

TEST_F(RealFile, AxesRunEastNorthAndUp) {
  EXPECT_EQ(info().grid.dims(), (std::array<int, 3>{128, 64, 14}));
  const auto& [x, y, z] = info().grid.axes;
  EXPECT_EQ(x.kind, AxisKind::longitude);
  EXPECT_EQ(x.coordinates.front(), -180);
  EXPECT_EQ(x.coordinates.back(), 177.1875);
  EXPECT_EQ(y.kind, AxisKind::latitude);
  EXPECT_NEAR(y.coordinates.front(), -87.8638, 1e-4);
  EXPECT_NEAR(y.coordinates.back(), 87.8638, 1e-4);
  EXPECT_NEAR(y.coordinates[1], -85.09653, 1e-5);  // Gaussian: not evenly spaced
  EXPECT_EQ(z.kind, AxisKind::pressure);
  EXPECT_EQ(z.units, "hPa");
  EXPECT_EQ(z.coordinates, (std::vector<double>{1000, 850, 700, 500, 400, 300, 250, 200, 150, 100,
                                                70, 50, 30, 10}));
}

TEST_F(RealFile, NamesAndUnits) {
  EXPECT_EQ(info().format, "netCDF-4");
  EXPECT_EQ(info().source, "nc4uvt.nc");
  EXPECT_EQ(info().title, "NCL generated netCDF file");
  ASSERT_NE(info().find("wind"), nullptr);
  EXPECT_EQ(info().first(FieldKind::vector), info().find("wind"));
  EXPECT_EQ(info().find("wind")->components, (std::vector<std::string>{"U", "V"}));
  EXPECT_EQ(info().find("wind")->units, "m/s");
  // The file declares C although the numbers are in kelvin: the declared unit is shown.
  EXPECT_EQ(info().find("T")->units, "C");
  EXPECT_EQ(info().find("U")->dtype, "float32");
  EXPECT_EQ(info().steps.size(), 1U);
  EXPECT_EQ(info().steps[0].text, "0");  // "Month" is not a CF time unit
  EXPECT_EQ(info().time_units, "Month");
}

TEST_F(RealFile, ValuesAtPositions) {
  const Volume wind = volume("wind");
  const Volume temperature = volume("T");
  ASSERT_EQ(wind.components, 2);
  // d["U"][0, 0, 0, 0] and V, T: the southernmost, westernmost sample on the ground.
  EXPECT_EQ(at(info(), wind, 0, -180, -87.8638, 1000), -7.2001467F);
  EXPECT_EQ(at(info(), wind, 1, -180, -87.8638, 1000), 8.982589F);
  EXPECT_EQ(at(info(), temperature, 0, -180, -87.8638, 1000), 266.69336F);
  // d["U"][0, 7, 42, 114]: in the jet stream south of Japan.
  EXPECT_EQ(at(info(), wind, 0, 140.625, 29.30136, 200), 61.52214F);
  EXPECT_EQ(at(info(), wind, 1, 140.625, 29.30136, 200), 9.6152525F);
  // d["U"][0, 13, 63, 127]: the northernmost, easternmost sample at the top.
  EXPECT_EQ(at(info(), wind, 0, 177.1875, 87.8638, 10), 2.9679232F);
  EXPECT_EQ(at(info(), wind, 1, 177.1875, 87.8638, 10), 5.842277F);
  EXPECT_EQ(at(info(), temperature, 0, 177.1875, 87.8638, 10), 196.06975F);
  // d["V"][0, 5, 20, 3]
  EXPECT_EQ(at(info(), wind, 1, -171.5625, -32.091946, 300), 1.6326693F);
}

TEST_F(RealFile, RangesAndMask) {
  const Volume u = volume("U");
  EXPECT_EQ(u.range, (std::array<float, 2>{-23.37016F, 81.63902F}));
  EXPECT_EQ(u.masked, 0);
  const Volume temperature = volume("T");
  EXPECT_EQ(temperature.range, (std::array<float, 2>{190.02437F, 310.63705F}));
  const Volume wind = volume("wind");
  EXPECT_FLOAT_EQ(wind.range[0], 0.0220772383F);  // of sqrt(U^2 + V^2)
  EXPECT_FLOAT_EQ(wind.range[1], 81.9224669F);
  EXPECT_EQ(wind.masked, 0);
}

TEST_F(RealFile, JetBlowsEastWithItsMaximumAtTheKnownSample) {
  // d["U"][0].argmax() is (7, 44, 119): 200 hPa, 34.9 N, 154.7 E.
  const Volume u = volume("U");
  EXPECT_EQ(at(info(), u, 0, 154.6875, 34.882523, 200), 81.63902F);
  // The polar night at high altitude is colder than the tropics at the ground: the vertical
  // direction is right.
  const Volume temperature = volume("T");
  EXPECT_GT(at(info(), temperature, 0, 0, 0, 1000), at(info(), temperature, 0, 0, 0, 100) + 80);
}

}  // namespace
}  // namespace windsplat::data
