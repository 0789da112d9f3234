// Positions of projected GRIB grids against those of ecCodes, whose formulas are independent of
// PROJ, in every order of scanning.
#include <eccodes.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/cf/projection_formulas.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/formats/grib_maker.hpp"

namespace windsplat::data::test::projected {
namespace {

constexpr long columns_made = 5;
constexpr long rows_made = 4;

struct MadeGrid {
  const char* type;
  std::function<void(Maker&)> describe;
  double tolerance = 3e-6;  // degrees: first points are rounded to a micro-degree
};

void put_first(Maker& maker, double latitude, double longitude) {
  maker.set("latitudeOfFirstGridPointInDegrees", latitude);
  maker.set("longitudeOfFirstGridPointInDegrees", longitude);
}

void put_steps(Maker& maker, double x, double y) {
  maker.set("DxInMetres", x);
  maker.set("DyInMetres", y);
}

// Shape of the Earth 6: a sphere of 6371229 m. ecCodes 2.28 places no Lambert grids on an
// ellipsoid.
std::vector<MadeGrid> made_grids() {
  const auto lambert = [](double parallel_1, double parallel_2, double latitude) {
    return [=](Maker& maker) {
      maker.set("shapeOfTheEarth", 6L);
      put_first(maker, latitude, 237.280472);
      maker.set("LaDInDegrees", parallel_1);
      maker.set("LoVInDegrees", 262.5);
      maker.set("Latin1InDegrees", parallel_1);
      maker.set("Latin2InDegrees", parallel_2);
      put_steps(maker, 300000, 200000);
    };
  };
  const auto polar = [](double pole) {
    return [=](Maker& maker) {
      maker.set("shapeOfTheEarth", 6L);
      put_first(maker, pole > 0 ? 40.0 : -40.0, 225);
      maker.set("orientationOfTheGridInDegrees", 265.0);
      maker.set("LaDInDegrees", pole > 0 ? 60.0 : -60.0);
      maker.set("projectionCentreFlag", pole > 0 ? 0L : 128L);
      put_steps(maker, 200000, 300000);
    };
  };
  return {{"lambert", lambert(38.5, 38.5, 21.138123)},
          {"lambert", lambert(30, 60, 21.138123)},
          {"polar_stereographic", polar(90)},
          {"polar_stereographic", polar(-90)},
          {"lambert_azimuthal_equal_area",
           [](Maker& maker) {
             maker.set("shapeOfTheEarth", 6L);
             put_first(maker, 45, 0);
             maker.set("standardParallelInDegrees", 52.0);
             maker.set("centralLongitudeInDegrees", 10.0);
             put_steps(maker, 300000, 200000);
           }},
          {"mercator", [](Maker& maker) {
             maker.set("shapeOfTheEarth", 6L);
             put_first(maker, -20, 170);
             maker.set("LaDInDegrees", 20.0);
             maker.set("longitudeOfLastGridPointInDegrees", 200.0);
             maker.set("latitudeOfLastGridPointInDegrees", 10.0);
             // Equal steps: ecCodes 2.28 takes the first for both.
             maker.set("DiInMetres", 300000.0);
             maker.set("DjInMetres", 300000.0);
           }}};
}

struct Point2 {
  double longitude;
  double latitude;
};

void scan(Maker& maker, bool westward, bool northward, bool by_columns) {
  maker.set("iScansNegatively", long{westward});
  maker.set("jScansPositively", long{northward});
  maker.set("jPointsAreConsecutive", long{by_columns});
}

class GribProjections : public GribFiles {
 protected:
  static std::vector<double> numbers(Maker& maker, const char* key) {
    std::vector<double> out(static_cast<std::size_t>(columns_made * rows_made));
    std::size_t count = out.size();
    EXPECT_EQ(codes_get_double_array(maker.handle(), key, out.data(), &count), CODES_SUCCESS);
    return out;
  }

  static void describe(Maker& maker, const MadeGrid& grid) {
    maker.set("gridType", std::string(grid.type));
    maker.set("Nx", columns_made);
    maker.set("Ny", rows_made);
    grid.describe(maker);
    maker.set("shortName", std::string("t"));
    maker.set("bitsPerValue", 16L);
    maker.values(counting(static_cast<std::size_t>(columns_made * rows_made)));
  }

  // Positions by ecCodes, eastward and northward row by row: other orders it places as if they were
  // that one.
  static std::vector<Point2> positions(const MadeGrid& grid) {
    Maker maker("GRIB2");
    describe(maker, grid);
    scan(maker, false, true, false);
    const std::vector<double> latitude = numbers(maker, "latitudes");
    const std::vector<double> longitude = numbers(maker, "longitudes");
    std::vector<Point2> out;
    for (std::size_t n = 0; n < latitude.size(); ++n) out.push_back({longitude[n], latitude[n]});
    return out;
  }

  // Values are the indices of the points in the message.
  void compare(const MadeGrid& grid, bool westward, bool northward, bool by_columns) {
    const std::vector<Point2> expected = positions(grid);
    const auto at_corner = [&](long i, long j) {
      return expected.at(static_cast<std::size_t>(j * columns_made + i));
    };
    const auto across = [](bool reversed, long i, long count) {
      return reversed ? count - 1 - i : i;
    };
    Maker maker("GRIB2");
    describe(maker, grid);
    scan(maker, westward, northward, by_columns);
    const Point2 first =
        at_corner(across(westward, 0, columns_made), across(!northward, 0, rows_made));
    put_first(maker, first.latitude, first.longitude);
    const auto source = open(maker.bytes());
    ASSERT_NE(source, nullptr);
    const auto& columns = source->info().grid.columns;
    ASSERT_NE(columns, nullptr) << source->info().notes.at(0);
    const auto field = source->read(0, 0);
    ASSERT_TRUE(field);
    for (std::size_t n = 0; n < columns->latitude.size(); ++n) {
      const long at = std::lround(field->values[n]);
      const long i =
          across(westward, by_columns ? at / rows_made : at % columns_made, columns_made);
      const long j = across(!northward, by_columns ? at % rows_made : at / columns_made, rows_made);
      const Point2 wanted = at_corner(i, j);
      EXPECT_NEAR(columns->latitude[n], wanted.latitude, grid.tolerance) << n;
      EXPECT_NEAR(std::remainder(columns->longitude[n] - wanted.longitude, 360), 0,
                  grid.tolerance / std::cos(wanted.latitude * degree))
          << n;
    }
  }
};

TEST_F(GribProjections, PositionsAreThoseOfEcCodesInEveryOrderOfScanning) {
  for (const MadeGrid& grid : made_grids()) {
    for (int flags = 0; flags < 8; ++flags) {
      SCOPED_TRACE(std::string(grid.type) + " " + std::to_string(flags));
      compare(grid, (flags & 1) != 0, (flags & 2) != 0, (flags & 4) != 0);
      if (HasFatalFailure()) return;
    }
  }
}

// Templates for which ecCodes computes no positions, against Snyder's formulas on WGS 84.
TEST_F(GribProjections, AlbersAndTransverseMercatorInvertTheirFormulas) {
  for (const bool albers : {true, false}) {
    SCOPED_TRACE(albers ? "albers" : "transverse mercator");
    Maker maker("GRIB2");
    maker.set("gridDefinitionTemplateNumber", albers ? 31L : 12L);
    maker.set("shapeOfTheEarth", 5L);
    maker.set("Nx", columns_made);
    maker.set("Ny", rows_made);
    maker.set("jScansPositively", 0L);
    const auto micro = [&](const char* key, double degrees) {
      maker.set(key, std::lround(degrees * 1e6));
    };
    if (albers) {
      micro("latitudeOfFirstGridPoint", 40);
      micro("longitudeOfFirstGridPoint", 250);
      micro("LaD", 29.5);
      micro("LoV", 264);
      maker.set("Dx", 300000000L);
      maker.set("Dy", 200000000L);
      micro("Latin1", 29.5);
      micro("Latin2", 45.5);
    } else {
      micro("latitudeOfReferencePoint", 0);
      micro("longitudeOfReferencePoint", 9);
      maker.set("scaleFactorAtReferencePoint", 0.9996);
      maker.set("XR", 50000000L);
      maker.set("YR", 0L);
      maker.set("Di", 10000000L);
      maker.set("Dj", 20000000L);
      maker.set("X1", 30000000L);
      maker.set("Y1", 550000000L);
    }
    maker.set("shortName", std::string("t"));
    maker.set("bitsPerValue", 16L);
    maker.values(counting(static_cast<std::size_t>(columns_made * rows_made)));
    const auto source = open(maker.bytes());
    ASSERT_NE(source, nullptr);
    const auto& columns = source->info().grid.columns;
    ASSERT_NE(columns, nullptr) << source->info().notes.at(0);
    const auto field = source->read(0, 0);
    ASSERT_TRUE(field);
    const auto forward =
        albers ? projected::albers(wgs84, 29.5, 45.5, 29.5, 264) : transverse(wgs84, 0.9996, 9);
    const auto first = albers ? forward(250, 40) : Point{-200000, 5500000};
    const double step_x = albers ? 300000 : 100000;
    for (std::size_t n = 0; n < columns->latitude.size(); ++n) {
      const auto at = std::lround(field->values[n]);
      const double turn = std::round((columns->longitude[n] - (albers ? 264 : 9)) / 360);
      const auto point = forward(columns->longitude[n] - 360 * turn, columns->latitude[n]);
      // Scale factors are stored in single precision.
      EXPECT_NEAR(point.x, first.x + step_x * static_cast<double>(at % columns_made), 0.5) << n;
      EXPECT_NEAR(point.y, first.y - 200000 * static_cast<double>(at / columns_made), 0.5) << n;
    }
  }
}

}  // namespace
}  // namespace windsplat::data::test::projected
