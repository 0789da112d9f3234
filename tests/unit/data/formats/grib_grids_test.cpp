// Reduced, rotated and projected grids of GRIB, whose values are closed forms of the position.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "server/data/formats/grib/rows.hpp"
#include "server/data/model/dataset_info.hpp"

#ifdef WINDSPLAT_GRIB
#include "tests/unit/data/formats/grib_maker.hpp"
#endif

namespace windsplat::data::test {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr double degree = M_PI / 180;

// Largest error of cos(longitude), known at `points` positions, at 1440 samples of the row.
double error_of_cosine(std::size_t points) {
  std::vector<float> values;
  for (std::size_t i = 0; i < points; ++i) {
    values.push_back(static_cast<float>(
        std::cos(2 * M_PI * static_cast<double>(i) / static_cast<double>(points))));
  }
  const auto row = grib::equal_rows(values, {points}, 1440);
  double worst = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    worst = std::max(worst, std::abs(row[i] - std::cos(static_cast<double>(i) * degree / 4)));
  }
  return worst;
}

TEST(EqualRows, ErrorIsOfSecondOrderAndZeroAtTheLongestRow) {
  for (const std::size_t points : {12U, 20U, 40U, 60U}) {
    const double spacing = 2 * M_PI / static_cast<double>(points);
    EXPECT_LE(error_of_cosine(points), spacing * spacing / 8);
    const double order = std::log2(error_of_cosine(points) / error_of_cosine(2 * points));
    EXPECT_NEAR(order, 2, 0.1) << points;
  }
  EXPECT_LT(error_of_cosine(1440), 1e-7);
}

TEST(EqualRows, KeepConstantsAndRowsOfFullLength) {
  const std::vector<float> values{0.1F, 0.1F, 0.1F, 1, 2, 3, 4, 5, 6, 7};
  const auto rows = grib::equal_rows(values, {3, 7}, 7);
  EXPECT_EQ(rows,
            (std::vector<float>{0.1F, 0.1F, 0.1F, 0.1F, 0.1F, 0.1F, 0.1F, 1, 2, 3, 4, 5, 6, 7}));
}

TEST(EqualRows, BesideAMaskedPointTakeTheOther) {
  const float missing = std::numeric_limits<float>::quiet_NaN();
  const auto row = grib::equal_rows({1, missing, missing, 4}, {4}, 8);
  EXPECT_EQ(row[0], 1);
  EXPECT_EQ(row[1], 1);
  EXPECT_TRUE(std::isnan(row[2]) && std::isnan(row[3]) && std::isnan(row[4]));
  EXPECT_EQ(row[5], 4);
  EXPECT_EQ(row[6], 4);
  EXPECT_EQ(row[7], 2.5F);
}

#ifdef WINDSPLAT_GRIB

std::vector<long> classic_32() {
  Maker maker("reduced_gg_pl_32_grib2");
  std::size_t count = 0;
  EXPECT_EQ(codes_get_size(maker.handle(), "pl", &count), CODES_SUCCESS);
  std::vector<long> out(count);
  EXPECT_EQ(codes_get_long_array(maker.handle(), "pl", out.data(), &count), CODES_SUCCESS);
  return out;
}

// O 16: from the pole, 20 points and 4 more in each row.
std::vector<long> octahedral_16() {
  std::vector<long> out;
  for (long row = 0; row < 32; ++row) out.push_back(20 + 4 * std::min(row, 31 - row));
  return out;
}

std::vector<double> gaussian(long number) {
  std::vector<double> out(static_cast<std::size_t>(2 * number));
  EXPECT_EQ(codes_get_gaussian_latitudes(number, out.data()), CODES_SUCCESS);
  return out;
}

double form(double lon, double lat, double level, double hour) {
  return (10 + level + hour) * std::cos(lat * degree) * std::sin(2 * lon * degree) + lat;
}

struct Reduced {
  int edition = 2;
  std::vector<long> row_lengths = octahedral_16();
  std::string level_type = "isobaricInhPa";
  std::string quantity = "t";
  long level = 500;
  long hour = 0;
  long masked = -1;  // index of a point
};

void fill(Maker& maker, const Reduced& made) {
  const long points = std::accumulate(made.row_lengths.begin(), made.row_lengths.end(), 0L);
  const auto rows = static_cast<long>(made.row_lengths.size());
  const auto latitudes = gaussian(rows / 2);
  const long longest = *std::max_element(made.row_lengths.begin(), made.row_lengths.end());
  maker.set("dataDate", 20200229L);
  maker.set("stepRange", std::to_string(made.hour));
  maker.set("typeOfLevel", made.level_type);
  maker.set("level", made.level);
  maker.set("shortName", made.quantity);
  maker.set("N", rows / 2);
  maker.set("Nj", rows);
  EXPECT_EQ(
      codes_set_long_array(maker.handle(), "pl", made.row_lengths.data(), made.row_lengths.size()),
      CODES_SUCCESS);
  if (made.edition == 2) maker.set("numberOfDataPoints", points);
  maker.set("latitudeOfFirstGridPointInDegrees", latitudes.front());
  maker.set("latitudeOfLastGridPointInDegrees", latitudes.back());
  maker.set("longitudeOfLastGridPointInDegrees", 360 - 360 / static_cast<double>(longest));
  maker.set("bitsPerValue", 24L);
  maker.set("missingValue", 9999999.0);
  maker.set("bitmapPresent", long{made.masked >= 0});
  std::vector<double> values;
  for (std::size_t row = 0; row < latitudes.size(); ++row) {
    for (long i = 0; i < made.row_lengths[row]; ++i) {
      const double lon = 360 * static_cast<double>(i) / static_cast<double>(made.row_lengths[row]);
      values.push_back(form(lon, latitudes[row], static_cast<double>(made.level),
                            static_cast<double>(made.hour)));
    }
  }
  if (made.masked >= 0) values.at(static_cast<std::size_t>(made.masked)) = 9999999.0;
  maker.values(values);
}

std::string message(const Reduced& made) {
  Maker maker(made.edition == 1 ? "reduced_gg_pl_32_grib1" : "reduced_gg_pl_32_grib2");
  fill(maker, made);
  return maker.bytes();
}

class GribGrids : public GribFiles {};

// Every sample is within the error of linear interpolation of the form; rows of full length and the
// first column are within the packing.
void expect_form(Source& source, std::size_t step, double hour, std::vector<long> row_lengths) {
  const auto& axes = source.info().grid.axes;
  const auto volume = source.read(0, step);
  ASSERT_TRUE(volume) << volume.error().message;
  const std::size_t columns = axes[0].coordinates.size();
  const std::size_t rows = axes[1].coordinates.size();
  const std::size_t levels = axes[2].coordinates.size();
  ASSERT_EQ(volume->values.size(), columns * rows * levels);
  std::size_t n = 0;
  for (const double level : axes[2].coordinates) {
    for (std::size_t row = 0; row < rows; ++row) {
      const double lat = axes[1].coordinates[row];
      const double spacing = 2 * M_PI / static_cast<double>(row_lengths[row]);
      const bool is_exact = row_lengths[row] == static_cast<long>(columns);
      const double bound = spacing * spacing / 8 * 4 * (10 + level + hour) * std::cos(lat * degree);
      for (std::size_t i = 0; i < columns; ++i) {
        const double lon = axes[0].coordinates[i];
        EXPECT_NEAR(lon, 360 * static_cast<double>(i) / static_cast<double>(columns), 1e-9);
        EXPECT_NEAR(volume->values[n++], form(lon, lat, level, hour),
                    1e-3 + (is_exact || i == 0 ? 0 : bound));
      }
    }
  }
}

TEST_F(GribGrids, ReducedRowsBecomeRowsAsLongAsTheLongest) {
  for (const int edition : {1, 2}) {
    for (const auto& row_lengths : {classic_32(), octahedral_16()}) {
      for (const char* kind : {"isobaricInhPa", "hybrid"}) {
        std::string bytes;
        for (const long hour : {0, 6}) {
          for (const long level : {60, 20, 40}) {
            bytes += message({edition, row_lengths, kind, "t", level, hour, -1});
          }
        }
        const auto source = open(bytes);
        ASSERT_NE(source, nullptr);
        const int rows = static_cast<int>(row_lengths.size());
        const auto longest = *std::max_element(row_lengths.begin(), row_lengths.end());
        EXPECT_EQ(source->info().grid.dims(),
                  (std::array<int, 3>{static_cast<int>(longest), rows, 3}));
        EXPECT_EQ(source->info().steps.size(), 2U);
        EXPECT_THAT(source->info().notes,
                    Contains(HasSubstr("20 to " + std::to_string(longest) + " points")));
        expect_form(*source, 0, 0, row_lengths);
        expect_form(*source, 1, 6, row_lengths);
      }
    }
  }
}

TEST_F(GribGrids, ReducedWindsAreOneVectorAndBitmapsMask) {
  Reduced u;
  u.quantity = "u";
  u.masked = 0;
  Reduced v = u;
  v.quantity = "v";
  const auto source = open(message(u) + message(v));
  ASSERT_NE(source, nullptr);
  ASSERT_EQ(source->info().fields.front().kind, FieldKind::vector);
  const auto wind = source->read(0, 0);
  ASSERT_TRUE(wind);
  EXPECT_EQ(wind->masked, 1);  // the others take the second or the last point of the row
  EXPECT_TRUE(std::isnan(wind->component(0)[31U * 80]));
}

TEST_F(GribGrids, GaussianGridsWhoseLatitudesTakeLongAreRefused) {
  Maker maker("regular_gg_pl_grib2");
  maker.set("N", 8001L);
  EXPECT_THAT(fault(maker.bytes()),
              HasSubstr("on a Gaussian grid of more than 8000 rows between pole and equator"));
}

TEST_F(GribGrids, ReducedGridsThatCannotBeReadAreRefused) {
  const Reduced made;
  Maker part("reduced_gg_pl_32_grib2");
  fill(part, made);
  part.set("longitudeOfLastGridPointInDegrees", 90.0);
  EXPECT_THAT(fault(part.bytes()), HasSubstr("a part of a reduced Gaussian grid"));
  Maker back("reduced_gg_pl_32_grib2");
  fill(back, made);
  back.set("iScansNegatively", 1L);
  EXPECT_THAT(fault(back.bytes()), HasSubstr("not scanned row by row"));
  Maker other("reduced_gg_pl_32_grib2");
  fill(other, made);
  other.set("numberOfDataPoints", 5L);
  EXPECT_THAT(fault(other.bytes()), HasSubstr("inconsistent numbers"));
  Reduced uneven;
  uneven.row_lengths = std::vector<long>(32, 1);
  uneven.row_lengths[9] = 5000;
  EXPECT_THAT(fault(message(uneven)), HasSubstr("too different numbers of points"));
}

struct Place {
  double longitude = 0;
  double latitude = 0;
};

// The sphere turned so that its south pole comes to (pole_longitude, pole_latitude): about the axis
// through 90 E, then about the axis of the earth.
Place unrotated(double rlon, double rlat, double pole_longitude, double pole_latitude) {
  const double x = std::cos(rlat * degree) * std::cos(rlon * degree);
  const double y = std::cos(rlat * degree) * std::sin(rlon * degree);
  const double z = std::sin(rlat * degree);
  const double tilt = (90 + pole_latitude) * degree;
  const double east = x * std::cos(tilt) - z * std::sin(tilt);
  const double up = x * std::sin(tilt) + z * std::cos(tilt);
  return {std::atan2(y, east) / degree + pole_longitude, std::asin(up) / degree};
}

// 5 columns from 10 W to 10 E and 4 rows from 6 N to 6 S of a grid about the south pole 40 S, 10 E.
std::string rotated_wind(int edition, const std::string& component, bool along_rows,
                         double angle = 0) {
  Maker maker(edition == 1 ? "rotated_ll_pl_grib1" : "rotated_ll_pl_grib2");
  maker.set("Ni", 5L);
  maker.set("Nj", 4L);
  maker.set("longitudeOfFirstGridPointInDegrees", -10.0);
  maker.set("longitudeOfLastGridPointInDegrees", 10.0);
  maker.set("latitudeOfFirstGridPointInDegrees", 6.0);
  maker.set("latitudeOfLastGridPointInDegrees", -6.0);
  maker.set("iDirectionIncrementInDegrees", 5.0);
  maker.set("jDirectionIncrementInDegrees", 4.0);
  maker.set("latitudeOfSouthernPoleInDegrees", -40.0);
  maker.set("longitudeOfSouthernPoleInDegrees", 10.0);
  maker.set("angleOfRotationInDegrees", angle);
  maker.set("resolutionAndComponentFlags", along_rows ? 8L : 0L);
  maker.set("level", 500L);
  maker.set("shortName", component);
  maker.set("bitsPerValue", 16L);
  maker.values(std::vector<double>(20, component == "u" ? 10 : 0));
  return maker.bytes();
}

TEST_F(GribGrids, RotatedGridsHavePositionsAndWindsFollowTheFlag) {
  for (const int edition : {1, 2}) {
    for (const bool along_rows : {true, false}) {
      SCOPED_TRACE(std::to_string(edition) + (along_rows ? " along rows" : " by east and north"));
      const auto source =
          open(rotated_wind(edition, "u", along_rows) + rotated_wind(edition, "v", along_rows));
      ASSERT_NE(source, nullptr);
      const Grid& grid = source->info().grid;
      ASSERT_EQ(source->info().fields.front().kind, FieldKind::vector);
      ASSERT_NE(grid.columns, nullptr);
      const auto wind = source->read(0, 0);
      ASSERT_TRUE(wind);
      std::size_t n = 0;
      for (const double rlat : {-6.0, -2.0, 2.0, 6.0}) {
        for (const double rlon : {-10.0, -5.0, 0.0, 5.0, 10.0}) {
          const Place at = unrotated(rlon, rlat, 10, -40);
          EXPECT_NEAR(std::remainder(grid.columns->longitude[n] - at.longitude, 360), 0, 1e-6);
          EXPECT_NEAR(grid.columns->latitude[n], at.latitude, 1e-6);
          // The direction of the row, from its neighbours.
          const Place west = unrotated(rlon - 1e-3, rlat, 10, -40);
          const Place east = unrotated(rlon + 1e-3, rlat, 10, -40);
          const double turned =
              along_rows
                  ? 0
                  : std::atan2(east.latitude - west.latitude,
                               (east.longitude - west.longitude) * std::cos(at.latitude * degree));
          // Rotation takes the directions of rows from neighbouring columns, 5 degrees apart.
          EXPECT_NEAR(wind->component(0)[n], 10 * std::cos(turned), 0.05);
          EXPECT_NEAR(wind->component(1)[n], -10 * std::sin(turned), 0.3);
          ++n;
        }
      }
    }
  }
}

TEST_F(GribGrids, RotatedGridsTurnedAboutTheirPoleAreRefused) {
  EXPECT_EQ(fault(rotated_wind(2, "u", true)), "");
  EXPECT_THAT(fault(rotated_wind(2, "u", true, 15)), HasSubstr("turned about its pole"));
}

TEST_F(GribGrids, ReducedRowsMayBeRotated) {
  for (const int edition : {1, 2}) {
    Maker maker("reduced_rotated_gg_pl_32_grib" + std::to_string(edition));
    Reduced made;
    made.edition = edition;
    fill(maker, made);
    maker.set("latitudeOfSouthernPoleInDegrees", -40.0);
    maker.set("longitudeOfSouthernPoleInDegrees", 10.0);
    const auto source = open(maker.bytes());
    ASSERT_NE(source, nullptr);
    const Grid& grid = source->info().grid;
    ASSERT_NE(grid.columns, nullptr);
    for (const std::size_t n : {0U, 79U, 80U * 15 + 33, 80U * 31}) {
      const Place at =
          unrotated(grid.axes[0].coordinates[n % 80], grid.axes[1].coordinates[n / 80], 10, -40);
      EXPECT_NEAR(std::remainder(grid.columns->longitude[n] - at.longitude, 360), 0, 1e-6);
      EXPECT_NEAR(grid.columns->latitude[n], at.latitude, 1e-6);
    }
  }
}

// Snyder, Map Projections (1987): inverse Lambert conformal conic on a sphere of radius 1 with one
// standard parallel, (14-1) to (15-5) and (15-11).
class SphericalLambert {
 public:
  SphericalLambert(double parallel, double meridian)
      : n_(std::sin(parallel * degree)),
        f_(std::cos(parallel * degree) * std::pow(half(parallel), n_) / n_),
        meridian_(meridian) {}
  [[nodiscard]] std::array<double, 2> forward(const Place& place) const {
    const double rho = f_ / std::pow(half(place.latitude), n_);
    const double theta = n_ * (place.longitude - meridian_) * degree;
    return {rho * std::sin(theta), -rho * std::cos(theta)};
  }
  [[nodiscard]] Place inverse(double x, double y) const {
    const double rho = std::hypot(x, y);
    return {std::atan2(x, -y) / n_ / degree + meridian_,
            2 * std::atan(std::pow(f_ / rho, 1 / n_)) / degree - 90};
  }

 private:
  static double half(double latitude) { return std::tan((45 + latitude / 2) * degree); }
  double n_;
  double f_;
  double meridian_;
};

TEST_F(GribGrids, LambertColumnsAreThoseOfSnyder) {
  Maker maker("GRIB2");
  maker.set("gridType", std::string("lambert"));
  maker.set("shapeOfTheEarth", 6L);  // a sphere of radius 6371229 m
  maker.set("Nx", 7L);
  maker.set("Ny", 5L);
  maker.set("latitudeOfFirstGridPointInDegrees", 30.0);
  maker.set("longitudeOfFirstGridPointInDegrees", 230.0);
  maker.set("LaDInDegrees", 25.0);
  maker.set("LoVInDegrees", 265.0);
  maker.set("Latin1InDegrees", 25.0);
  maker.set("Latin2InDegrees", 25.0);
  maker.set("DxInMetres", 400000.0);
  maker.set("DyInMetres", 300000.0);
  maker.set("jScansPositively", 1L);
  maker.set("typeOfLevel", std::string("isobaricInhPa"));
  maker.set("level", 500L);
  maker.values(std::vector<double>(35, 1));
  const auto source = open(maker.bytes());
  ASSERT_NE(source, nullptr);
  const auto& columns = source->info().grid.columns;
  ASSERT_NE(columns, nullptr);
  const SphericalLambert map(25, 265);
  const auto first = map.forward({230, 30});
  for (std::size_t n = 0; n < 35; ++n) {
    const Place at = map.inverse(first[0] + static_cast<double>(n % 7) * 400000 / 6371229,
                                 first[1] + static_cast<double>(n / 7) * 300000 / 6371229);
    EXPECT_NEAR(std::remainder(columns->longitude[n] - at.longitude, 360), 0, 1e-5);
    EXPECT_NEAR(columns->latitude[n], at.latitude, 1e-5);
  }
}

TEST_F(GribGrids, UnsupportedGridsAreRefusedWithAdvice) {
  EXPECT_THAT(
      fault(Maker("sh_pl_grib2").bytes()),
      testing::AllOf(HasSubstr("'sh'"), HasSubstr("spherical harmonics"), HasSubstr("cdo sp2gp")));
  EXPECT_THAT(fault(Maker("reduced_ll_sfc_grib1").bytes()),
              testing::AllOf(HasSubstr("'reduced_ll'"), HasSubstr("interpolate it")));
}

#endif

}  // namespace
}  // namespace windsplat::data::test
