// Derived fields on longitudes and latitudes, of axes and of columns, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "server/data/derived/lengths.hpp"
#include "tests/unit/data/derived/formula_source.hpp"

namespace windsplat::data::derived_test {
namespace {

using derived::earth_radius_m;
const std::vector<std::string> horizontal(2, "m s-1");
const std::vector<std::string> in_space(3, "m s-1");

Grid globe(std::size_t longitudes, std::size_t latitudes, double first, double last) {
  Grid grid;
  grid.axes = {
      axis_of(AxisKind::longitude, "degrees_east",
              evenly(0, 360 / static_cast<double>(longitudes), longitudes)),
      axis_of(AxisKind::latitude, "degrees_north",
              evenly(first, (last - first) / static_cast<double>(latitudes - 1), latitudes)),
      axis_of(AxisKind::height, "m", {0})};
  return grid;
}

OnSphere place(const Grid& grid, std::size_t i, std::size_t j) {
  if (grid.columns) {
    const std::size_t n = j * grid.axes[0].coordinates.size() + i;
    return {grid.columns->longitude[n], grid.columns->latitude[n]};
  }
  return {grid.axes[0].coordinates[i], grid.axes[1].coordinates[j]};
}

// The angular velocity of a rotation about an axis that is not that of the longitudes.
const Vec omega{2e-6, 3e-6, 5e-6};

TEST(DerivedOnASphere, RotationAboutThePoleHasTheVorticityOfTwiceTheSineOfTheLatitude) {
  const Grid grid = globe(36, 18, -85, 85);
  const double rate = 1e-5;
  const auto flow = [&](std::size_t, std::size_t j, std::size_t) {
    return Vec{rate * earth_radius_m * std::cos(grid.axes[1].coordinates[j] * degree), 0, 0};
  };
  const auto sine = [&](std::size_t, std::size_t j, std::size_t) {
    return Vec{2 * rate * std::sin(grid.axes[1].coordinates[j] * degree), 0, 0};
  };
  // Rows at the ends have differences on one side: second order.
  const Volume curl = derived_of(grid, horizontal, flow, "v_vertical_vorticity");
  EXPECT_LT(greatest_error(curl, sine, 1), 1e-11);
  EXPECT_LT(greatest_error(curl, sine), 2e-7);
  EXPECT_LT(greatest_error(derived_of(grid, horizontal, flow, "v_divergence"),
                           [](auto, auto, auto) { return Vec{}; }),
            1e-11);
}

TEST(DerivedOnASphere, RotationAboutAnyAxisIsExactInSpace) {
  Grid grid = globe(24, 12, -80, 80);
  grid.axes[2] = axis_of(AxisKind::height, "km", {0, 5, 20, 30});
  const auto flow = [&](std::size_t i, std::size_t j, std::size_t k) {
    const OnSphere at = place(grid, i, j);
    const double r = earth_radius_m + 1000 * grid.axes[2].coordinates[k];
    const Vec v = cross(omega, {r * at.up[0], r * at.up[1], r * at.up[2]});
    return Vec{dot(v, at.east), dot(v, at.north), dot(v, at.up)};
  };
  const auto twice = [&](std::size_t i, std::size_t j, std::size_t) {
    const OnSphere at = place(grid, i, j);
    return Vec{2 * dot(omega, at.east), 2 * dot(omega, at.north), 2 * dot(omega, at.up)};
  };
  // The values are floats: 3e-6 m/s of 50 over 5 km are 6e-10.
  EXPECT_LT(greatest_error(derived_of(grid, in_space, flow, "v_vorticity"), twice), 2e-9);
  EXPECT_LT(greatest_error(derived_of(grid, in_space, flow, "v_divergence"),
                           [](auto, auto, auto) { return Vec{}; }),
            2e-9);
}

TEST(DerivedOnASphere, RisingAirDivergesByTheGrowthOfTheSphere) {
  Grid grid = globe(24, 12, -80, 80);
  grid.axes[2] = axis_of(AxisKind::height, "m", evenly(0, 1000, 3));
  const Volume divergence = derived_of(
      grid, in_space,
      [](auto, auto, auto) {
        return Vec{0, 0, 10};
      },
      "v_divergence");
  const double expected = 2 * 10 / (earth_radius_m + 1000);  // of a radial flow: 2 w / r
  EXPECT_NEAR(static_cast<double>(divergence.values.data()[24 * 12 + 24 * 5 + 3]), expected, 1e-9);
}

// The stream function sin(latitude) cos^2(latitude) cos(2 longitude), a spherical harmonic of
// degree 3: its vorticity is -12 times itself, for a unit sphere. Velocity: up x gradient.
struct Wave {
  Vec velocity;  // Cartesian, m/s
  double vorticity = 0;
  explicit Wave(const Vec& n) {
    // As a polynomial: z (x^2 - y^2).
    const Vec gradient{2 * n[0] * n[2], -2 * n[1] * n[2], n[0] * n[0] - n[1] * n[1]};
    velocity = cross(n, gradient);
    for (double& part : velocity) part *= 10;
    vorticity = -12 * n[2] * (n[0] * n[0] - n[1] * n[1]) * 10 / earth_radius_m;
  }
};

// Columns of a grid of longitudes and latitudes about a pole that is turned by 40 degrees, whose
// rows are spaced unevenly.
struct Turned {
  Grid grid;
  std::vector<OnSphere> axes;  // true directions of x and y at each column
};

Turned turned(std::size_t count) {
  Turned out;
  Columns columns;
  for (std::size_t j = 0; j < count; ++j) {
    for (std::size_t i = 0; i < count; ++i) {
      const double s = static_cast<double>(i) / static_cast<double>(count - 1);
      const double t = static_cast<double>(j) / static_cast<double>(count - 1);
      OnSphere at(-30 + 60 * s, -20 + 30 * t + 20 * t * t);
      const auto turn = [](Vec& v) {
        const double c = std::cos(40 * degree);
        const double q = std::sin(40 * degree);
        v = {c * v[0] - q * v[2], v[1], q * v[0] + c * v[2]};
      };
      turn(at.east);
      turn(at.north);
      turn(at.up);
      columns.longitude.push_back(std::atan2(at.up[1], at.up[0]) / degree);
      columns.latitude.push_back(std::asin(at.up[2]) / degree);
      out.axes.push_back(at);
    }
  }
  out.grid.axes = {axis_of(AxisKind::cartesian, "", evenly(0, 1, count)),
                   axis_of(AxisKind::cartesian, "", evenly(0, 1, count)),
                   axis_of(AxisKind::height, "m", {0})};
  out.grid.columns = std::make_shared<const Columns>(std::move(columns));
  return out;
}

TEST(DerivedOnASphere, ConvergesToSecondOrderOnLongitudesAndLatitudes) {
  double error[2];
  for (std::size_t fine = 0; fine < 2; ++fine) {
    const Grid grid = globe(fine == 0 ? 72 : 144, fine == 0 ? 33 : 65, -80, 80);
    const Volume curl = derived_of(
        grid, horizontal,
        [&](std::size_t i, std::size_t j, std::size_t) {
          const OnSphere at = place(grid, i, j);
          const Wave wave(at.up);
          return Vec{dot(wave.velocity, at.east), dot(wave.velocity, at.north), 0};
        },
        "v_vertical_vorticity");
    error[fine] = greatest_error(curl, [&](std::size_t i, std::size_t j, std::size_t) {
      return Vec{Wave(place(grid, i, j).up).vorticity, 0, 0};
    });
  }
  EXPECT_GT(std::log2(error[0] / error[1]), 1.8) << error[0] << ' ' << error[1];
  EXPECT_LT(std::log2(error[0] / error[1]), 2.3) << error[0] << ' ' << error[1];
}

TEST(DerivedOnASphere, ConvergesToSecondOrderOnTurnedColumns) {
  double inner[2];
  double whole[2];
  for (std::size_t fine = 0; fine < 2; ++fine) {
    const Turned here = turned(fine == 0 ? 31 : 61);
    const std::size_t width = here.grid.axes[0].coordinates.size();
    const Volume curl = derived_of(
        here.grid, horizontal,
        [&](std::size_t i, std::size_t j, std::size_t) {
          const OnSphere& at = here.axes[j * width + i];
          const Wave wave(at.up);
          return Vec{dot(wave.velocity, at.east), dot(wave.velocity, at.north), 0};
        },
        "v_vertical_vorticity");
    const auto expected = [&](std::size_t i, std::size_t j, std::size_t) {
      return Vec{Wave(here.axes[j * width + i].up).vorticity, 0, 0};
    };
    inner[fine] = greatest_error(curl, expected, fine == 0 ? 3 : 6);
    whole[fine] = greatest_error(curl, expected);
  }
  EXPECT_GT(std::log2(inner[0] / inner[1]), 1.8) << inner[0] << ' ' << inner[1];
  EXPECT_LT(std::log2(inner[0] / inner[1]), 2.3) << inner[0] << ' ' << inner[1];
  // At the rim the directions of the axes are those of differences on one side.
  EXPECT_GT(std::log2(whole[0] / whole[1]), 0.8) << whole[0] << ' ' << whole[1];
}

TEST(DerivedOnASphere, AMirroredGridHasTheSameVorticity) {
  Grid grid = globe(12, 9, -40, 40);
  Columns columns;
  for (std::size_t j = 0; j < 9; ++j) {
    for (std::size_t i = 0; i < 12; ++i) {
      columns.longitude.push_back(5.0 * static_cast<double>(i));
      columns.latitude.push_back(40 - 10.0 * static_cast<double>(j));  // y runs south
    }
  }
  grid.axes[0] = axis_of(AxisKind::cartesian, "", evenly(0, 1, 12));
  grid.axes[1] = axis_of(AxisKind::cartesian, "", evenly(0, 1, 9));
  grid.columns = std::make_shared<const Columns>(std::move(columns));
  const auto flow = [&](std::size_t i, std::size_t j, std::size_t) {
    const OnSphere at = place(grid, i, j);
    const Vec v = cross(omega, at.up);
    return Vec{earth_radius_m * dot(v, at.east), -earth_radius_m * dot(v, at.north), 0};
  };
  const Volume curl = derived_of(grid, horizontal, flow, "v_vertical_vorticity");
  const auto expected = [&](std::size_t i, std::size_t j, std::size_t) {
    return Vec{2 * dot(omega, place(grid, i, j).up), 0, 0};
  };
  EXPECT_LT(greatest_error(curl, expected, 2), 1e-8);  // of about 1e-5
}

// The divergence of a zonal wave that is `shift` samples further east, at sample i of row 4; twelve
// samples go around the globe.
double divergence_at(const Grid& grid, std::size_t i, std::size_t shift) {
  const auto wave = [&](std::size_t at, std::size_t, std::size_t) {
    const std::size_t phase = (at + 12 - shift) % 12;
    return Vec{static_cast<double>(phase * phase), 0, 0};
  };
  const Volume divergence = derived_of(grid, horizontal, wave, "v_divergence");
  return static_cast<double>(
      divergence.values.data()[4 * static_cast<std::size_t>(divergence.dims[0]) + i]);
}

TEST(DerivedOnASphere, LongitudesThatCloseACircleHaveNoSeam) {
  Grid grid = globe(12, 9, -60, 60);
  Grid closed = grid;
  closed.axes[0].coordinates.push_back(360);  // the first meridian again
  for (const std::size_t shift : {0U, 3U}) {
    const double inside = divergence_at(grid, 5, 5 + shift);
    EXPECT_NE(inside, 0);
    for (const Grid& one : {grid, closed}) {
      EXPECT_NEAR(divergence_at(one, 0, shift) / inside, 1, 1e-6);
      EXPECT_NEAR(divergence_at(one, 11, (11 + shift) % 12) / inside, 1, 1e-6);
    }
    EXPECT_NEAR(divergence_at(closed, 12, shift) / inside, 1, 1e-6);
  }
}

TEST(DerivedOnASphere, ColumnsThatCloseACircleHaveNoSeam) {
  Grid grid = globe(12, 9, -60, 60);
  Columns columns;
  for (const double latitude : grid.axes[1].coordinates) {
    for (const double longitude : grid.axes[0].coordinates) {
      columns.longitude.push_back(longitude);
      columns.latitude.push_back(latitude);
    }
  }
  grid.columns = std::make_shared<const Columns>(std::move(columns));
  const double inside = divergence_at(grid, 5, 7);
  // The directions of columns are one-sided there: 30 degrees are 0.27 squared radians.
  EXPECT_NEAR(divergence_at(grid, 0, 2) / inside, 1, 0.1);
}

TEST(DerivedOnASphere, APartOfACircleHasEnds) {
  Grid grid = globe(36, 9, -60, 60);
  grid.axes[0].coordinates.resize(24);
  // Growing with longitude: around the globe the ends would differ by all of it.
  const Volume divergence = derived_of(
      grid, horizontal,
      [&](std::size_t i, std::size_t, std::size_t) {
        return Vec{static_cast<double>(i), 0, 0};
      },
      "v_divergence");
  const double expected = 1 / (earth_radius_m * 10 * degree);  // at the equator, row 4
  for (std::size_t i = 0; i < 24; ++i) {
    const double is = static_cast<double>(divergence.values.data()[24 * 4 + i]);
    EXPECT_NEAR(is / expected, 1, 0.1) << i;
  }
}

TEST(DerivedOnASphere, OnlyRowsAtThePolesAreMasked) {
  const Grid grid = globe(12, 7, -90, 90);
  const Volume curl = derived_of(
      grid, horizontal,
      [](auto, auto, auto) {
        return Vec{1, 2, 0};
      },
      "v_vertical_vorticity");
  for (std::size_t n = 0; n < curl.samples(); ++n) {
    const bool at_pole = n < 12 || n >= 72;
    EXPECT_EQ(std::isnan(curl.values.data()[n]), at_pole) << n;
  }
}

}  // namespace
}  // namespace windsplat::data::derived_test
