// Derived fields of vectors on grids in units of length, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "server/data/cf/fields/atmosphere.hpp"
#include "tests/unit/data/derived/formula_source.hpp"

namespace windsplat::data::derived_test {
namespace {

const std::vector<std::string> metres_per_second(3, "m s-1");
constexpr double masked = std::numeric_limits<double>::quiet_NaN();

// Uneven in every direction, x in km.
Grid uneven() {
  Grid grid;
  grid.axes = {axis_of(AxisKind::cartesian, "km", {0, 0.1, 0.25, 0.3, 0.7}),
               axis_of(AxisKind::cartesian, "m", {-50, 0, 10, 90, 100, 180}),
               axis_of(AxisKind::height, "m", {5, 15, 40, 100})};
  return grid;
}

Vec metres(const Grid& grid, std::size_t i, std::size_t j, std::size_t k) {
  return {1000 * grid.axes[0].coordinates[i], grid.axes[1].coordinates[j],
          grid.axes[2].coordinates[k]};
}

// A formula of the position in metres.
Formula of_position(const Grid& grid, std::function<Vec(const Vec&)> formula) {
  return [grid, formula = std::move(formula)](std::size_t i, std::size_t j, std::size_t k) {
    return formula(metres(grid, i, j, k));
  };
}

TEST(DerivedOnAPlane, SolidRotationHasTwiceItsRateAsVorticityAndNoDivergence) {
  const Vec omega{0.01, -0.02, 0.03};
  const Grid grid = uneven();
  const auto turning = of_position(grid, [&](const Vec& r) { return cross(omega, r); });
  const auto of = [&](const char* name) {
    return derived_of(grid, metres_per_second, turning, name);
  };
  const auto constant = [](Vec value) {
    return [value](std::size_t, std::size_t, std::size_t) { return value; };
  };
  EXPECT_LT(greatest_error(of("v_vorticity"), constant({0.02, -0.04, 0.06})), 1e-7);
  EXPECT_LT(greatest_error(of("v_vertical_vorticity"), constant({0.06, 0, 0})), 1e-7);
  EXPECT_LT(greatest_error(of("v_divergence"), constant({0, 0, 0})), 1e-7);
  // No strain: Q = |W|^2 / 2 with |W|^2 = 2 omega^2.
  EXPECT_LT(greatest_error(of("v_q_criterion"), constant({dot(omega, omega), 0, 0})), 1e-8);
}

TEST(DerivedOnAPlane, PureStrainHasANegativeQCriterion) {
  const Grid grid = uneven();
  const double s = 0.02;
  const auto strain = of_position(grid, [&](const Vec& r) { return Vec{s * r[0], -s * r[1], 0}; });
  const Volume q = derived_of(grid, metres_per_second, strain, "v_q_criterion");
  // |S|^2 = 2 s^2.
  EXPECT_LT(greatest_error(q, [&](auto, auto, auto) { return Vec{-s * s, 0, 0}; }), 1e-9);
}

TEST(DerivedOnAPlane, QuadraticFieldsAreExactUpToTheEndsOfUnevenAxes) {
  const Grid grid = uneven();
  const auto squares = of_position(grid, [](const Vec& r) {
    return Vec{1e-4 * r[0] * r[0], 1e-3 * r[1] * r[1], 1e-2 * r[2] * r[2]};
  });
  const auto divergence = of_position(grid, [](const Vec& r) {
    return Vec{2e-4 * r[0] + 2e-3 * r[1] + 2e-2 * r[2], 0, 0};
  });
  EXPECT_LT(
      greatest_error(derived_of(grid, metres_per_second, squares, "v_divergence"), divergence),
      2e-6);
  const auto shears = of_position(grid, [](const Vec& r) {
    return Vec{1e-3 * r[1] * r[1], 1e-2 * r[2] * r[2], 1e-4 * r[0] * r[0]};
  });
  const auto curl = of_position(grid, [](const Vec& r) {
    return Vec{-2e-2 * r[2], -2e-4 * r[0], -2e-3 * r[1]};
  });
  EXPECT_LT(greatest_error(derived_of(grid, metres_per_second, shears, "v_vorticity"), curl), 2e-6);
}

// The Arnold-Beltrami-Childress flow: its curl is itself.
Vec abc(const Vec& r) {
  return {1.0 * std::sin(r[2]) + 0.5 * std::cos(r[1]), 0.8 * std::sin(r[0]) + std::cos(r[2]),
          0.5 * std::sin(r[1]) + 0.8 * std::cos(r[0])};
}

TEST(DerivedOnAPlane, AbcFlowIsItsOwnCurlToSecondOrder) {
  double error[2][2];
  for (std::size_t fine = 0; fine < 2; ++fine) {
    const std::size_t count = fine == 0 ? 17 : 33;
    std::vector<double> at(count);
    for (std::size_t n = 0; n < count; ++n) {  // spacings differ by a factor of three
      const double t = static_cast<double>(n) / static_cast<double>(count - 1);
      at[n] = 3 * (t + 0.5 * t * t * t);
    }
    Grid grid;
    for (Axis& axis : grid.axes) axis = axis_of(AxisKind::cartesian, "m", at);
    const auto flow = [&](std::size_t i, std::size_t j, std::size_t k) {
      return abc({at[i], at[j], at[k]});
    };
    error[0][fine] = greatest_error(derived_of(grid, metres_per_second, flow, "v_vorticity"), flow);
    error[1][fine] = greatest_error(derived_of(grid, metres_per_second, flow, "v_helicity"),
                                    [&](auto i, auto j, auto k) {
                                      const Vec u = flow(i, j, k);
                                      return Vec{dot(u, u), 0, 0};
                                    });
  }
  for (const auto& [coarse, fine] : error) {
    const double order = std::log2(coarse / fine);
    EXPECT_GT(order, 1.8) << coarse << ' ' << fine;
    EXPECT_LT(order, 2.3) << coarse << ' ' << fine;
  }
}

TEST(DerivedOnAPlane, BesideMaskedSamplesDifferencesAreOneSided) {
  const Grid grid = uneven();
  // A masked block leaves samples with neighbours on one side only; one sample is enclosed.
  const auto is_masked = [](std::size_t i, std::size_t j, std::size_t k) {
    return (i == 2 && j == 2) || (k == 3 && (i + j) % 2 == 1);
  };
  const auto linear = of_position(grid, [](const Vec& r) {
    return Vec{0.01 * r[0] + 0.03 * r[1], 0.02 * r[0], 0};
  });
  const Volume curl = derived_of(
      grid, metres_per_second,
      [&](std::size_t i, std::size_t j, std::size_t k) {
        return is_masked(i, j, k) ? Vec{masked, masked, masked} : linear(i, j, k);
      },
      "v_vertical_vorticity");
  std::size_t n = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t i = 0; i < 5; ++i, ++n) {
        const float is = curl.values.data()[n];
        if (is_masked(i, j, k) || k == 3) {  // in the top level no sample has a neighbour
          EXPECT_TRUE(std::isnan(is)) << i << ' ' << j << ' ' << k;
        } else {
          EXPECT_NEAR(static_cast<double>(is), -0.01, 1e-7) << i << ' ' << j << ' ' << k;
        }
      }
    }
  }
}

TEST(DerivedOnAPlane, VerticalDerivativesOnPressureLevelsAreByTheStandardAtmosphere) {
  Grid grid;
  grid.axes = {axis_of(AxisKind::cartesian, "km", evenly(0, 1, 3)),
               axis_of(AxisKind::cartesian, "km", evenly(0, 1, 3)),
               axis_of(AxisKind::pressure, "hPa", {1000, 850, 500, 300, 50})};
  const auto sheared = [&](std::size_t, std::size_t, std::size_t k) {
    return Vec{0.002 * cf::standard_height(100 * grid.axes[2].coordinates[k]), 0, 0};
  };
  EXPECT_LT(greatest_error(derived_of(grid, metres_per_second, sheared, "v_vorticity"),
                           [](auto, auto, auto) {
                             return Vec{0, 0.002, 0};
                           }),
            1e-8);
}

TEST(DerivedOnAPlane, DepthIsDownward) {
  Grid grid;
  grid.axes = {axis_of(AxisKind::cartesian, "m", evenly(0, 1, 3)),
               axis_of(AxisKind::cartesian, "m", evenly(0, 1, 3)),
               axis_of(AxisKind::depth, "m", {300, 100, 10})};
  const auto sheared = [&](std::size_t, std::size_t, std::size_t k) {
    return Vec{-0.01 * grid.axes[2].coordinates[k], 0, 0};  // growing upward
  };
  EXPECT_LT(greatest_error(derived_of(grid, metres_per_second, sheared, "v_vorticity"),
                           [](auto, auto, auto) {
                             return Vec{0, 0.01, 0};
                           }),
            1e-8);
}

// Levels without lengths beside the field of their heights, and levels placed at their mean
// heights.
TEST(DerivedOnAPlane, SlopingLevelsOfAHeightFieldAreTakenIntoAccount) {
  const auto height = [](std::size_t i, std::size_t j, std::size_t k) {
    const auto [x, y, z] = std::array{100.0 * static_cast<double>(i),
                                      100.0 * static_cast<double>(j), static_cast<double>(k)};
    return 200 * z + 0.3 * x - 0.2 * y + 1e-4 * x * y;
  };
  for (const bool placed : {false, true}) {
    Grid grid;
    grid.axes = {axis_of(AxisKind::cartesian, "m", evenly(0, 100, 5)),
                 axis_of(AxisKind::cartesian, "m", evenly(0, 100, 4)),
                 placed ? axis_of(AxisKind::height, "m", evenly(30, 200, 4))
                        : axis_of(AxisKind::level, "", evenly(1, 1, 4))};
    const Vec omega{0.01, -0.02, 0.03};
    auto source = std::make_unique<FormulaSource>(grid);
    source->add("v", metres_per_second, [&](std::size_t i, std::size_t j, std::size_t k) {
      return cross(
          omega, {100.0 * static_cast<double>(i), 100.0 * static_cast<double>(j), height(i, j, k)});
    });
    source->add(
        placed ? "height" : "z", {"km"},
        [&](std::size_t i, std::size_t j, std::size_t k) {
          return Vec{height(i, j, k) / 1000, 0, 0};
        },
        placed ? "" : "geopotential_height");
    source->change().fields.back().derived = placed;
    const Volume vorticity = volume_of(*derive(std::move(source)), "v_vorticity");
    EXPECT_LT(greatest_error(vorticity,
                             [](auto, auto, auto) {
                               return Vec{0.02, -0.04, 0.06};
                             }),
              1e-6)
        << placed;
  }
}

TEST(DerivedOnAPlane, SpeedsAreLengthsOfTheVectorAndOfItsHorizontalPart) {
  const Grid grid = uneven();
  const auto constant = [](std::size_t, std::size_t, std::size_t) { return Vec{3, 4, 12}; };
  const std::vector<std::string> knots(3, "knots");
  EXPECT_EQ(greatest_error(derived_of(grid, knots, constant, "v_speed"),
                           [](auto, auto, auto) {
                             return Vec{13, 0, 0};
                           }),
            0);
  EXPECT_EQ(greatest_error(derived_of(grid, knots, constant, "v_horizontal_speed"),
                           [](auto, auto, auto) {
                             return Vec{5, 0, 0};
                           }),
            0);
  // Components in different units: 12 cm/s upward.
  EXPECT_LT(greatest_error(derived_of(grid, {"m/s", "m/s", "cm/s"}, constant, "v_speed"),
                           [](auto, auto, auto) {
                             return Vec{std::hypot(5, 0.12), 0, 0};
                           }),
            1e-6);
}

TEST(DerivedOnAPlane, UnitsOfVelocityAreConverted) {
  const Grid grid = uneven();
  const auto turning = of_position(grid, [](const Vec& r) { return Vec{-r[1], r[0], 0}; });
  struct Unit {
    const char* text;
    double metres_per_second;
  };
  for (const Unit& unit : {Unit{"m/s", 1}, Unit{"m s**-1", 1}, Unit{"m.s-1", 1}, Unit{"ms-1", 1},
                           Unit{"cm s-1", 0.01}, Unit{"km/h", 1 / 3.6}, Unit{"km s-1", 1000},
                           Unit{"kt", 1852.0 / 3600}, Unit{"Meter/Sec", 1}}) {
    const Volume curl = derived_of(grid, {unit.text, unit.text}, turning, "v_vertical_vorticity");
    const double expected = 2 * unit.metres_per_second;
    EXPECT_LT(greatest_error(curl,
                             [&](auto, auto, auto) {
                               return Vec{expected, 0, 0};
                             }),
              1e-6 * expected)
        << unit.text;
  }
}

}  // namespace
}  // namespace windsplat::data::derived_test
