// The built-in samples: sizes, determinism, and the physics of their formulas.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::data {
namespace {

std::unique_ptr<Source> sample(const std::string& name, std::array<int, 3> dims = {0, 0, 0},
                               int steps = 0) {
  auto source = open_sample(name, dims, steps);
  EXPECT_TRUE(source) << name;
  return std::move(*source);
}

std::size_t field_index(const DatasetInfo& info, const std::string& name) {
  for (std::size_t n = 0; n < info.fields.size(); ++n) {
    if (info.fields[n].name == name) return n;
  }
  ADD_FAILURE() << "no field " << name;
  return 0;
}

Volume read(Source& source, const std::string& field, std::size_t step = 0) {
  auto volume = source.read(field_index(source.info(), field), step);
  EXPECT_TRUE(volume);
  return std::move(*volume);
}

// Value of a component at a grid point.
double at(const Volume& v, int c, int i, int j, int k) {
  const auto nx = static_cast<std::size_t>(v.dims[0]);
  const auto ny = static_cast<std::size_t>(v.dims[1]);
  const std::size_t n = static_cast<std::size_t>(i) +
                        nx * (static_cast<std::size_t>(j) + ny * static_cast<std::size_t>(k));
  return static_cast<double>(v.component(c)[n]);
}

int nearest(const Axis& axis, double coordinate) {
  int best = 0;
  for (std::size_t n = 0; n < axis.coordinates.size(); ++n) {
    const auto b = static_cast<std::size_t>(best);
    if (std::abs(axis.coordinates[n] - coordinate) < std::abs(axis.coordinates[b] - coordinate)) {
      best = static_cast<int>(n);
    }
  }
  return best;
}

TEST(Samples, AreTheThreeOfTheInterface) {
  EXPECT_THAT(sample_names(), testing::ElementsAre("tornado", "climate", "efield"));
  for (const std::string& name : sample_names()) EXPECT_EQ(sample(name)->info().id, name);
}

TEST(Samples, RefuseUnknownNamesAndSizes) {
  EXPECT_EQ(open_sample("hurricane").error().kind, ErrorKind::not_found);
  EXPECT_EQ(open_sample("tornado", {-1, 8, 8}).error().kind, ErrorKind::invalid);
  EXPECT_EQ(open_sample("tornado", {5000, 8, 8}).error().kind, ErrorKind::invalid);
  const Error large = open_sample("climate", {4096, 4096, 17}).error();
  EXPECT_EQ(large.kind, ErrorKind::too_large);
  EXPECT_EQ(large.message, "the sample climate has at most 268435456 grid points, not 285212672");
  EXPECT_EQ(open_sample("tornado", {8, 8, 8}, -2).error().kind, ErrorKind::invalid);
}

TEST(Samples, AcceptAnyDimensionsAndSteps) {
  const std::array<int, 3> dims = {7, 5, 3};
  const std::array<int, 3> single = {1, 1, 1};
  for (const std::string& name : sample_names()) {
    for (const auto& size : {dims, single}) {
      auto source = sample(name, size, 2);
      EXPECT_EQ(source->info().grid.dims(), size);
      ASSERT_EQ(source->info().steps.size(), 2U);
      for (std::size_t f = 0; f < source->info().fields.size(); ++f) {
        auto volume = source->read(f, 1);
        ASSERT_TRUE(volume);
        EXPECT_EQ(volume->dims, size);
        EXPECT_EQ(volume->masked, 0) << name << " field " << f;
      }
    }
  }
  EXPECT_EQ(sample("climate")->info().grid.dims(), (std::array<int, 3>{320, 160, 19}));
}

TEST(Samples, AreReproducibleAndChangeWithTheStep) {
  for (const std::string& name : sample_names()) {
    auto first = sample(name, {24, 20, 16});
    auto second = sample(name, {24, 20, 16});
    EXPECT_EQ(first->info().digest, second->info().digest);
    EXPECT_NE(first->info().digest, sample(name, {24, 20, 15})->info().digest);
    // Read in a different order, to detect dependence on earlier reads.
    const Volume later = *second->read(1, 1);
    const Volume a = *first->read(0, 0);
    const Volume b = *second->read(0, 0);
    EXPECT_EQ(a.values, b.values) << name;
    EXPECT_EQ(first->read(1, 1)->values, later.values) << name;
    EXPECT_NE(a.values, first->read(0, 1)->values) << name;
  }
}

TEST(Samples, PartsHaveTheValuesOfTheWhole) {
  const Box box{{3, 1, 5}, {4, 7, 2}};
  for (const std::string& name : sample_names()) {
    auto source = sample(name, {9, 8, 7});
    for (std::size_t f = 0; f < source->info().fields.size(); ++f) {
      const auto part = source->read_part(f, 1, {box});
      ASSERT_TRUE(part);
      EXPECT_EQ(part->values, cut(*source->read(f, 1), box).values) << name << " field " << f;
      EXPECT_EQ(source->read_part(f, 1, {{{3, 1, 6}, {4, 7, 2}}}).error().kind, ErrorKind::invalid);
    }
  }
}

// 768 GiB for each step of the wind.
TEST(Tornado, PartsOfAnySizeAreComputedWithoutTheWhole) {
  auto large = sample("tornado", {4096, 4096, 4096});
  ASSERT_TRUE(large->info().fields[0].is_read_by_boxes());
  const auto corner = large->read_part(0, 0, {{{4092, 4090, 4095}, {4, 6, 1}}});
  ASSERT_TRUE(corner);
  EXPECT_EQ(corner->dims, (std::array<int, 3>{4, 6, 1}));
  // Every third of 4095 cells has the centre of one of 1365.
  auto third = sample("tornado", {1365, 1365, 1365});
  auto all = sample("tornado", {4095, 4095, 4095});
  const auto coarse = third->read_part(0, 0, {{{700, 701, 702}, {1, 1, 1}}});
  const auto fine = all->read_part(0, 0, {{{2101, 2104, 2107}, {1, 1, 1}}});
  ASSERT_TRUE(coarse && fine);
  for (const int c : {0, 1, 2}) EXPECT_FLOAT_EQ(*fine->component(c), *coarse->component(c));
}

TEST(Tornado, AirTurnsCounterClockwiseAndRisesEverywhere) {
  auto source = sample("tornado");
  const Volume wind = read(*source, "wind", 5);
  const Volume vorticity = read(*source, "vorticity", 5);
  const double spacing = 1500.0 / 64;
  for (int k = 2; k < 62; k += 12) {
    // The axis is where the documented vorticity peaks.
    int ai = 2;
    int aj = 2;
    for (int j = 2; j < 62; ++j) {
      for (int i = 2; i < 62; ++i) {
        if (at(vorticity, 0, i, j, k) > at(vorticity, 0, ai, aj, k)) {
          ai = i;
          aj = j;
        }
      }
    }
    // The circulation around a square of four cells about it is positive: counter-clockwise.
    double circulation = 0;
    for (int s = -2; s < 2; ++s) {
      circulation += at(wind, 0, ai + s, aj - 2, k) - at(wind, 0, ai + s, aj + 2, k);
      circulation += at(wind, 1, ai + 2, aj + s, k) - at(wind, 1, ai - 2, aj + s, k);
    }
    const double mean_vorticity = circulation * spacing / (16.0 * spacing * spacing);
    EXPECT_GT(mean_vorticity, 0.2) << "level " << k;
  }
  const std::size_t samples = wind.samples();
  EXPECT_TRUE(
      std::all_of(wind.component(2), wind.component(2) + samples, [](float w) { return w >= 0; }));
  const float top = *std::max_element(wind.component(2), wind.component(2) + samples);
  EXPECT_GT(top, 30.0F);
  double low = 0;
  double high = 0;
  for (int j = 0; j < 64; ++j) {
    for (int i = 0; i < 64; ++i) {
      low += at(wind, 2, i, j, 4);
      high += at(wind, 2, i, j, 50);
    }
  }
  EXPECT_GT(high, 1.5 * low);  // the updraft grows with height
}

TEST(Tornado, WindConservesMass) {
  auto source = sample("tornado", {96, 96, 96}, 3);
  const Volume wind = read(*source, "wind", 2);
  double divergence = 0;
  double shear = 0;
  for (int k = 1; k < 95; k += 3) {
    for (int j = 1; j < 95; j += 3) {
      for (int i = 1; i < 95; i += 3) {
        const double du = at(wind, 0, i + 1, j, k) - at(wind, 0, i - 1, j, k);
        const double dv = at(wind, 1, i, j + 1, k) - at(wind, 1, i, j - 1, k);
        const double dw = at(wind, 2, i, j, k + 1) - at(wind, 2, i, j, k - 1);
        divergence += (du + dv + dw) * (du + dv + dw);
        shear += du * du + dv * dv + dw * dw;
      }
    }
  }
  // The remainder is the truncation error of the differences, (spacing / core)^2 / 6 of the
  // gradients.
  EXPECT_LT(std::sqrt(divergence / shear), 0.03);
}

TEST(Tornado, FunnelIsCloudMovesAndClearsOutwards) {
  auto source = sample("tornado");
  const Volume first = read(*source, "cloud", 0);
  const Volume last = read(*source, "cloud", 11);
  EXPECT_GE(first.range[0], 0.0F);
  EXPECT_LE(first.range[1], 1.0F);
  EXPECT_GT(first.range[1], 0.95F);
  double moved = 0;
  double edge = 0;
  for (int j = 0; j < 64; ++j) {
    for (int i = 0; i < 64; ++i) {
      moved = std::max(moved, std::abs(at(first, 0, i, j, 45) - at(last, 0, i, j, 45)));
    }
    edge = std::max({edge, at(first, 0, 0, j, 45), at(first, 0, 63, j, 45)});
  }
  EXPECT_GT(moved, 0.9);
  EXPECT_LT(edge, 0.05);
}

TEST(Climate, FollowsCfConventions) {
  auto source = sample("climate");
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.grid.axes[0].kind, AxisKind::longitude);
  EXPECT_EQ(info.grid.axes[1].kind, AxisKind::latitude);
  EXPECT_EQ(info.grid.axes[2].kind, AxisKind::pressure);
  EXPECT_EQ(info.grid.axes[2].coordinates.front(), 1000);
  EXPECT_EQ(info.grid.axes[2].coordinates.back(), 10);
  EXPECT_TRUE(
      std::is_sorted(info.grid.axes[2].coordinates.rbegin(), info.grid.axes[2].coordinates.rend()));
  EXPECT_EQ(info.find("cloud")->standard_name, "cloud_area_fraction_in_atmosphere_layer");
  EXPECT_EQ(info.find("cloud")->units, "1");
  EXPECT_EQ(info.find("wind")->component_units,
            (std::vector<std::string>{"m s-1", "m s-1", "m s-1"}));
  EXPECT_EQ(info.steps[0].text, "2001-01-01T00:00:00Z");
  EXPECT_EQ(info.steps[5].text, "2001-01-02T06:00:00Z");
  EXPECT_EQ(sample("climate", {8, 4, 2}, 4 * 59 + 1)->info().steps.back().text,
            "2001-03-01T00:00:00Z");
}

// Mean over a latitude circle.
double zonal_mean(const Volume& wind, int component, int j, int k) {
  double sum = 0;
  for (int i = 0; i < wind.dims[0]; ++i) sum += at(wind, component, i, j, k);
  return sum / wind.dims[0];
}

TEST(Climate, JetsPeakNearTwoHundredHectopascals) {
  auto source = sample("climate");
  const Volume wind = read(*source, "wind");
  const auto& axes = source->info().grid.axes;
  for (const double side : {-1.0, 1.0}) {
    double best = 0;
    int best_j = 0;
    int best_k = 0;
    for (int k = 0; k < 19; ++k) {
      for (int j = 0; j < 160; ++j) {
        const double latitude = axes[1].coordinates[static_cast<std::size_t>(j)];
        const double mean = zonal_mean(wind, 0, j, k);
        if (latitude * side > 0 && mean > best) {
          best = mean;
          best_j = j;
          best_k = k;
        }
      }
    }
    const double latitude = axes[1].coordinates[static_cast<std::size_t>(best_j)];
    EXPECT_GT(best, 20.0);
    EXPECT_LT(best, 70.0);
    EXPECT_NEAR(latitude * side, 38.0, 10.0);
    EXPECT_NEAR(axes[2].coordinates[static_cast<std::size_t>(best_k)], 200.0, 51.0);
  }
}

TEST(Climate, TradesBlowFromTheEastTowardsTheEquator) {
  auto source = sample("climate");
  const Volume wind = read(*source, "wind");
  const auto& axes = source->info().grid.axes;
  const int ground = nearest(axes[2], 925);
  const int north = nearest(axes[1], 12);
  const int south = nearest(axes[1], -12);
  EXPECT_LT(zonal_mean(wind, 0, north, ground), -3.0);
  EXPECT_LT(zonal_mean(wind, 0, south, ground), -3.0);
  EXPECT_LT(zonal_mean(wind, 1, north, ground), -0.5);
  EXPECT_GT(zonal_mean(wind, 1, south, ground), 0.5);
}

// Mean relative vorticity, 1/s, of a level in a square of +-4 degrees about (lon, lat), from the
// circulation around it (Stokes).
double circulation_vorticity(const Volume& wind, const std::array<Axis, 3>& axes, double lon,
                             double lat, int k) {
  const int half = 4;
  const int ci = nearest(axes[0], lon);
  const int cj = nearest(axes[1], lat);
  const double metres = 111195.0 * 1.125;
  const double cosine = std::cos(lat * std::numbers::pi / 180.0);
  double sum = 0;
  for (int s = -half; s < half; ++s) {
    sum += (at(wind, 0, ci + s, cj - half, k) - at(wind, 0, ci + s, cj + half, k)) * cosine;
    sum += at(wind, 1, ci + half, cj + s, k) - at(wind, 1, ci - half, cj + s, k);
  }
  return sum * metres / (4.0 * half * half * metres * metres * cosine);
}

TEST(Climate, LowsTurnCounterClockwiseInTheNorthAndClockwiseInTheSouth) {
  auto source = sample("climate");
  const Volume wind = read(*source, "wind");
  const auto& axes = source->info().grid.axes;
  const int level = nearest(axes[2], 850);
  int lows_north = 0;
  int lows_south = 0;
  double strongest_north = 0;
  double strongest_south = 0;
  for (int degrees = -170; degrees < 175; degrees += 3) {
    const double lon = degrees;
    const double north = circulation_vorticity(wind, axes, lon, 50, level);
    const double south = circulation_vorticity(wind, axes, lon, -52, level);
    strongest_north = std::max(strongest_north, north);
    strongest_south = std::min(strongest_south, south);
    lows_north += north > 3e-5 ? 1 : 0;
    lows_south += south < -3e-5 ? 1 : 0;
  }
  EXPECT_GT(strongest_north, 4e-5);
  EXPECT_LT(strongest_south, -4e-5);
  EXPECT_GT(lows_north, 5);
  EXPECT_GT(lows_south, 5);
}

TEST(Climate, LowsDriftEast) {
  auto source = sample("climate");
  const auto& axes = source->info().grid.axes;
  const int level = nearest(axes[2], 850);
  const auto strongest = [&](const Volume& wind, double from, double to) {
    double best = 0;
    double where = from;
    for (int n = 0; n * 1.125 <= to - from; ++n) {
      const double lon = from + n * 1.125;
      const double v = circulation_vorticity(wind, axes, lon, 50, level);
      if (v > best) {
        best = v;
        where = lon;
      }
    }
    return where;
  };
  const Volume first = read(*source, "wind", 0);
  const Volume fifth = read(*source, "wind", 4);  // 24 h later
  const double before = strongest(first, -170, 150);
  const double after = strongest(fifth, before - 15, before + 25);
  EXPECT_NEAR(after - before, 10.0, 5.0);
}

TEST(Climate, CloudIsAFractionAndFollowsTheWeather) {
  auto source = sample("climate");
  const Volume cloud = read(*source, "cloud");
  EXPECT_GE(cloud.range[0], 0.0F);
  EXPECT_LE(cloud.range[1], 1.0F);
  const auto& axes = source->info().grid.axes;
  const auto cover = [&](double south, double north, double bottom, double top) {
    double sum = 0;
    int count = 0;
    for (int k = nearest(axes[2], bottom); k <= nearest(axes[2], top); ++k) {
      for (int j = nearest(axes[1], south); j <= nearest(axes[1], north); ++j) {
        sum += zonal_mean(cloud, 0, j, k);
        ++count;
      }
    }
    return sum / count;
  };
  // Tropical towers and storm tracks are cloudier than the subtropics; the stratosphere is clear.
  EXPECT_GT(cover(-8, 6, 700, 250), 2.0 * cover(17, 24, 700, 250));
  EXPECT_GT(cover(42, 58, 700, 300), 2.0 * cover(17, 24, 700, 300));
  EXPECT_GT(cover(-60, -44, 700, 300), 2.0 * cover(-24, -17, 700, 300));
  EXPECT_EQ(cover(-89, 89, 70, 10), 0.0);
}

TEST(Climate, AirRisesInCloudyFronts) {
  auto source = sample("climate");
  const Volume cloud = read(*source, "cloud");
  const Volume wind = read(*source, "wind");
  const int level = nearest(source->info().grid.axes[2], 500);
  double cloudy = 0;
  double clear = 0;
  int cloudy_count = 0;
  int clear_count = 0;
  for (int j = 0; j < 160; ++j) {
    for (int i = 0; i < 320; ++i) {
      const bool covered = at(cloud, 0, i, j, level) > 0.7;
      (covered ? cloudy : clear) += at(wind, 2, i, j, level);
      ++(covered ? cloudy_count : clear_count);
    }
  }
  ASSERT_GT(cloudy_count, 500);
  EXPECT_GT(cloudy / cloudy_count, 0.02);
  EXPECT_LT(clear / clear_count, 0.02);
}

TEST(ElectricField, IncidentWaveIsTransverseAndStandsBeforeTheWall) {
  auto source = sample("efield");
  const auto& axes = source->info().grid.axes;
  const int j = 13;
  const int k = 16;
  double along = 0;
  double across = 0;
  double loudest = 0;
  double quietest = 1e9;
  for (int i = 0; axes[0].coordinates[static_cast<std::size_t>(i)] < -0.7; ++i) {
    double peak = 0;
    for (std::size_t step = 0; step < 16; ++step) {
      const Volume field = read(*source, "E", step);
      along = std::max(along, std::abs(at(field, 0, i, j, k)));
      across = std::max(across, std::abs(at(field, 2, i, j, k)));
      peak = std::max(peak, std::abs(at(field, 2, i, j, k)));
    }
    loudest = std::max(loudest, peak);
    quietest = std::min(quietest, peak);
  }
  EXPECT_GT(across, 110.0);  // more than the incident 100 V/m, because of reflection
  EXPECT_LT(along, 0.25 * across);
  EXPECT_LT(quietest, 0.75 * loudest);  // nodes and antinodes
}

TEST(ElectricField, OneStepIsOneSixteenthOfAPeriod) {
  auto source = sample("efield");
  const Volume now = read(*source, "E", 3);
  const Volume half_later = read(*source, "E", 11);
  ASSERT_EQ(now.values.size(), half_later.values.size());
  double worst = 0;
  for (std::size_t n = 0; n < now.values.size(); ++n) {
    worst = std::max(worst, std::abs(static_cast<double>(now.values[n] + half_later.values[n])));
  }
  EXPECT_LT(worst, 1e-3);  // half a period reverses the field
  EXPECT_NEAR(source->info().steps[8].value, 0.5e9 / 600e6, 1e-9);
}

TEST(ElectricField, EnergyIsHalfEpsilonTimesSquare) {
  auto source = sample("efield", {20, 12, 12});
  const Volume field = read(*source, "E", 2);
  const Volume energy = read(*source, "energy", 2);
  for (int i = 0; i < 20; ++i) {
    double square = 0;
    for (int c = 0; c < 3; ++c) square += at(field, c, i, 5, 6) * at(field, c, i, 5, 6);
    EXPECT_NEAR(at(energy, 0, i, 5, 6), 0.5 * 8.8541878128e-12 * square, 1e-13);
  }
}

TEST(ElectricField, CabinShadesAndItsWallsExcludeTheField) {
  auto source = sample("efield");
  const auto& axes = source->info().grid.axes;
  const auto peak = [&](double x, double y, double z) {
    double most = 0;
    for (std::size_t step = 0; step < 16; step += 2) {
      const Volume field = read(*source, "E", step);
      const int i = nearest(axes[0], x);
      const int j = nearest(axes[1], y);
      const int k = nearest(axes[2], z);
      most = std::max(
          most, std::hypot(at(field, 0, i, j, k), at(field, 1, i, j, k), at(field, 2, i, j, k)));
    }
    return most;
  };
  EXPECT_GT(peak(-0.40, 0, 0), 40.0);                    // just behind the window
  EXPECT_LT(peak(0.80, 0, 0), 0.5 * peak(-0.40, 0, 0));  // in the back wall
  // In the shadow of the cabin, away from its axis, where waves from the edges interfere.
  EXPECT_LT((peak(0.95, 0.3, 0.2) + peak(0.95, -0.3, -0.2) + peak(0.95, 0.2, -0.3)) / 3, 60.0);
  const Volume walls = read(*source, "walls");
  EXPECT_EQ(at(walls, 0, nearest(axes[0], 0.79), 13, 16), 1.0);
  EXPECT_EQ(at(walls, 0, nearest(axes[0], -0.49), 13, 16), 0.0);  // the window is open
  EXPECT_EQ(at(walls, 0, nearest(axes[0], 0.2), 13, 16), 0.0);
}

TEST(ElectricField, HasNoChargeInFreeSpace) {
  auto source = sample("efield", {96, 48, 48}, 4);
  const Volume field = read(*source, "E", 1);
  const auto& axes = source->info().grid.axes;
  double divergence = 0;
  double gradient = 0;
  for (int i = 2; axes[0].coordinates[static_cast<std::size_t>(i)] < -0.62; ++i) {
    for (int k = 4; k < 44; k += 3) {
      for (int j = 4; j < 44; j += 3) {
        const double dx = at(field, 0, i + 1, j, k) - at(field, 0, i - 1, j, k);
        const double dy = at(field, 1, i, j + 1, k) - at(field, 1, i, j - 1, k);
        const double dz = at(field, 2, i, j, k + 1) - at(field, 2, i, j, k - 1);
        divergence += (dx + dy + dz) * (dx + dy + dz);
        gradient += dx * dx + dy * dy + dz * dz;
      }
    }
  }
  EXPECT_LT(std::sqrt(divergence / gradient), 0.1);
}

}  // namespace
}  // namespace windsplat::data
