// Lines through the seeds of a view: where they begin, what is refused, what they depend on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "server/data/model/column_search.hpp"
#include "server/data/model/measure.hpp"
#include "server/scene/traced/seeds.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {
namespace {

using protocol::SeedsView;
using protocol::View;
using testing::HasSubstr;

std::unique_ptr<data::Dataset> wind_dataset(int steps) {
  return dataset_of(
      std::make_unique<FakeSource>(atmosphere_grid(), std::vector{wind_info()}, steps));
}

// (step + 1) m/s to the east, every ten hours.
class EastWind final : public data::Source {
 public:
  EastWind(data::Grid grid, int steps) {
    info_.id = "fake";
    info_.title = "East wind";
    info_.source = "fake.nc";
    info_.format = "fake";
    info_.digest = "1";
    info_.grid = std::move(grid);
    data::FieldInfo wind = wind_info();
    wind.components = {"u", "v"};
    wind.component_units = {"m s-1", "m s-1"};
    info_.fields = {wind};
    info_.time_units = "hours since 2000-01-01";
    for (int s = 0; s < steps; ++s) info_.steps.push_back({10.0 * s, std::to_string(s)});
  }
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  [[nodiscard]] const int& reads() const { return reads_; }
  Result<data::Volume> read(std::size_t /*field*/, std::size_t step) override {
    ++reads_;
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = 2;
    std::vector<float> values(2 * volume.samples(), 0.0F);
    std::fill_n(values.begin(), volume.samples(), static_cast<float>(step + 1));
    volume.values = std::move(values);
    data::finish_volume(volume);
    return volume;
  }

 private:
  int reads_ = 0;
  data::DatasetInfo info_;
};

View seeded(const std::vector<protocol::Vec3>& points = {}) {
  View view;
  view.vector.trace = protocol::TraceView{};
  view.vector.trace->seeds = SeedsView{};
  view.vector.trace->seeds->points = points;
  view.scalars = std::vector<protocol::ScalarView>{};
  return view;
}

std::int64_t lines_of(const View& view, data::Dataset& dataset) {
  return built(view, dataset).vector->streamlets->tally.lines;
}

// The pointer and message of the refusal.
std::pair<std::string, std::string> refusal_of(const View& view, data::Dataset& dataset) {
  const auto scene = build_scene(view, dataset);
  EXPECT_FALSE(scene);
  if (scene || scene.error().at.empty()) return {};
  EXPECT_EQ(scene.error().kind, ErrorKind::invalid);
  return {scene.error().at[0].pointer, scene.error().message};
}

TEST(SeededScene, AllKindsOfSeedsAddUp) {
  auto dataset = sample_dataset("tornado", {24, 24, 24});
  View view = seeded();
  EXPECT_EQ(lines_of(view, *dataset), 100);
  SeedsView& seeds = *view.vector.trace->seeds;
  const auto& axes = dataset->info().grid.axes;
  const auto corner = [&](double part) {
    protocol::Vec3 at{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto& c = axes[a].coordinates;
      at[a] = c.front() + part * (c.back() - c.front());
    }
    return at;
  };
  seeds.points = {corner(0.4), corner(0.7)};
  EXPECT_EQ(lines_of(view, *dataset), 2);
  seeds.line = protocol::SeedLineView{corner(0.2), corner(0.8), 7};
  EXPECT_EQ(lines_of(view, *dataset), 9);
  seeds.block = protocol::SeedBlockView{corner(0.2), corner(0.8), {3, 4, 1}};
  EXPECT_EQ(lines_of(view, *dataset), 21);
  seeds.evenly = 30;
  EXPECT_EQ(lines_of(view, *dataset), 51);
}

TEST(SeededScene, WeakPartsOfALineAreDrawn) {
  auto dataset = sample_dataset("tornado", {24, 24, 24});
  View view = seeded();
  view.vector.min_magnitude = 1e6;
  const Scene scene = built(view, *dataset);
  EXPECT_EQ(scene.vector->streamlets->tally.lines, 100);
  EXPECT_EQ(scene.vector->min_magnitude, 0);
}

TEST(SeededScene, ASeedOutsideIsRefusedWithItsPlaceAndTheRange) {
  auto dataset = wind_dataset(1);
  const auto point = refusal_of(seeded({{10, 0, 500}, {10, 40, 500}}), *dataset);
  EXPECT_EQ(point.first, "/vector/trace/seeds/points/1");
  EXPECT_THAT(point.second, HasSubstr("y = 40 is outside of the data, -10 to 10 degrees_north"));
  View line = seeded();
  line.vector.trace->seeds->line = protocol::SeedLineView{{0, 0, 500}, {30, 0, 100}, 2};
  const auto end = refusal_of(line, *dataset);
  EXPECT_EQ(end.first, "/vector/trace/seeds/line/to");
  EXPECT_THAT(end.second, HasSubstr("250 to 1000 hPa"));
  View block = seeded();
  block.vector.trace->seeds->block =
      protocol::SeedBlockView{{0, -30, 500}, {30, 0, 500}, {2, 2, 1}};
  EXPECT_EQ(refusal_of(block, *dataset).first, "/vector/trace/seeds/block");
  // Half a cell beyond the last sample, and a longitude of another turn.
  EXPECT_TRUE(build_scene(seeded({{10, 14.9, 500}}), *dataset));
  EXPECT_TRUE(build_scene(seeded({{-350, 0, 500}}), *dataset));
  EXPECT_FALSE(build_scene(seeded({{10, 15.1, 500}}), *dataset));
}

// There are no data below the lowest level and above the highest.
TEST(SeededScene, ASeedBeyondTheOutermostLevelsIsRefused) {
  auto dataset = wind_dataset(1);
  for (const double level : {1000.0, 250.0, 999.0, 251.0}) {
    EXPECT_TRUE(build_scene(seeded({{10, 0, level}}), *dataset)) << level;
  }
  for (const double level : {1001.0, 249.0, 1240.0}) {
    const auto refused = refusal_of(seeded({{10, 0, level}}), *dataset);
    EXPECT_EQ(refused.first, "/vector/trace/seeds/points/0") << level;
    EXPECT_THAT(refused.second, HasSubstr("is outside of the data, 250 to 1000 hPa"));
  }
}

TEST(SeededScene, ARegionHasItsOwnRange) {
  auto dataset = wind_dataset(1);
  View view = seeded({{30, 0, 500}});
  EXPECT_TRUE(build_scene(view, *dataset));
  view.region.x = protocol::Range{0, 20};
  const auto refused = refusal_of(view, *dataset);
  EXPECT_EQ(refused.first, "/vector/trace/seeds/points/0");
  EXPECT_THAT(refused.second, HasSubstr("x = 30 is outside of the region, which keeps 0 to 20"));
}

// Both ends lie in an axis of longitudes that is not closed, and the seeds between them do not.
TEST(SeededScene, ASeedBetweenTheEndsOfALineIsNamedByItsNumber) {
  auto dataset = wind_dataset(1);
  View view = seeded();
  view.vector.trace->seeds->line = protocol::SeedLineView{{0, 0, 500}, {360, 0, 500}, 5};
  const auto refused = refusal_of(view, *dataset);
  EXPECT_EQ(refused.first, "/vector/trace/seeds/line");
  EXPECT_THAT(refused.second, HasSubstr("seed 2 of 5: x = 90 is outside of the data"));
  view.vector.trace->seeds->line = protocol::SeedLineView{{-90, 0, 500}, {-10, 0, 500}, 1};
  EXPECT_THAT(refusal_of(view, *dataset).second, HasSubstr("seed 1 of 1: x = -50"));
  view.vector.trace->seeds->line = protocol::SeedLineView{{0, 0, 500}, {90, 0, 500}, 2};
  EXPECT_EQ(refusal_of(view, *dataset).first, "/vector/trace/seeds/line/to");
}

TEST(SeededScene, CoordinatesAreLinearBetweenSamples) {
  auto dataset = wind_dataset(1);
  const auto placed = place_dataset({}, *dataset);
  ASSERT_TRUE(placed);
  const auto index =
      PlaceSearch(**placed, dataset->info().grid.axes[2]).index_of({15, -5, 625}, "");
  ASSERT_TRUE(index);
  EXPECT_NEAR(index->x, 1.5, 1e-12);
  EXPECT_NEAR(index->y, 0.5, 1e-12);
  EXPECT_NEAR(index->z, 0.75, 1e-12);  // of 1000 and 500 hPa
}

// Columns of a turned map, whose longitudes and latitudes are linear in the index; longitudes from
// -180 to 180 degrees.
Placed turned_map(double first, int nx = 6, int ny = 5) {
  Placed placed;
  std::vector<double> x(static_cast<std::size_t>(nx));
  std::vector<double> y(static_cast<std::size_t>(ny));
  std::iota(x.begin(), x.end(), 0);
  std::iota(y.begin(), y.end(), 0);
  placed.grid.axes = {axis(data::AxisKind::cartesian, "", x),
                      axis(data::AxisKind::cartesian, "", y),
                      axis(data::AxisKind::pressure, "hPa", {1000})};
  data::Columns columns;
  for (const double j : y) {
    for (const double i : x) {
      columns.longitude.push_back(std::remainder(first + 0.9 * i - 0.4 * j, 360.0));
      columns.latitude.push_back(45 + 0.4 * i + 0.8 * j);
    }
  }
  placed.grid.columns = std::make_shared<const data::Columns>(columns);
  return placed;
}

TEST(SeededScene, LongitudesAndLatitudesOfColumnsAreSought) {
  // From 177.8 to 178.4 the antimeridian passes through the cell.
  for (const double first : {8.0, 177.8, 178.0, 178.4}) {
    const Placed placed = turned_map(first);
    const double x = 2.3;
    const double y = 1.6;
    const PlaceSearch search(placed, placed.grid.axes[2]);
    const auto index =
        search.index_of({first + 0.9 * x - 0.4 * y, 45 + 0.4 * x + 0.8 * y, 7}, "/here");
    ASSERT_TRUE(index);
    EXPECT_NEAR(index->x, x, 1e-9) << first;
    EXPECT_NEAR(index->y, y, 1e-9) << first;
    EXPECT_EQ(index->z, 0);
    const auto far = search.index_of({60, 45, 7}, "/here");
    ASSERT_FALSE(far);
    EXPECT_EQ(far.error().at[0].pointer, "/here");
  }
}

TEST(SeededScene, TheSearchFindsTheColumnOfAScan) {
  const Placed placed = turned_map(160, 31, 22);
  const data::ColumnSearch search(*placed.grid.columns, placed.grid.dims());
  int found = 0;
  for (int n = 0; n < 2000; ++n) {
    const double longitude = 150 + std::fmod(n * 0.618034, 1.0) * 50;
    const double latitude = 40 + std::fmod(n * 0.414214, 1.0) * 40;
    const auto scanned = data::nearest_sample(placed.grid, {longitude, latitude, std::nullopt});
    const auto sought = search.nearest(longitude, latitude);
    ASSERT_EQ(scanned.has_value(), sought.has_value()) << longitude << ' ' << latitude;
    if (!sought) {
      EXPECT_EQ(scanned.error().message, sought.error().message);
      continue;
    }
    ++found;
    EXPECT_EQ(scanned->index[0], (*sought)[0]);
    EXPECT_EQ(scanned->index[1], (*sought)[1]);
  }
  EXPECT_GT(found, 500);
  EXPECT_LT(found, 2000);
}

TEST(SeededScene, SeekingSeedsEndsWhenCancelled) {
  const Placed placed = turned_map(8);
  const CancelToken cancel;
  cancel.cancel();
  const SeedsView points = *seeded({{10, 47, 7}}).vector.trace->seeds;
  const auto none = seeds_of(points, placed, placed.grid.axes[2], {}, cancel);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::cancelled);
}

// A handle that computes nothing does not seek seeds either: it reports what is absent.
TEST(SeededScene, SeedsAreSoughtOnlyWhileLinesAreMade) {
  auto dataset = wind_dataset(1);
  built(seeded({{10, 0, 500}}), *dataset);
  const View outside = seeded({{10, 40, 500}});
  data::Dataset resident = dataset->resident_only();
  const auto absent = build_scene(outside, resident);
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().kind, ErrorKind::not_resident);
  EXPECT_EQ(refusal_of(outside, *dataset).first, "/vector/trace/seeds/points/0");
}

TEST(SeededScene, WhatDeterminesTheLinesIsPartOfTheirKey) {
  auto dataset = sample_dataset("tornado", {12, 12, 12});
  const auto first = built(seeded(), *dataset).vector->streamlets;
  const auto differs = [&](const auto& change) {
    View view = seeded();
    change(*view.vector.trace->seeds);
    return built(view, *dataset).vector->streamlets != first;
  };
  EXPECT_FALSE(differs([](SeedsView&) {}));
  EXPECT_TRUE(differs([](SeedsView& s) { s.evenly = 99; }));
  EXPECT_TRUE(differs([](SeedsView& s) { s.length = 0.3; }));
  EXPECT_TRUE(differs([](SeedsView& s) { s.duration = 0.01; }));
  EXPECT_TRUE(differs([](SeedsView& s) { s.pieces = 10; }));
  EXPECT_TRUE(differs([](SeedsView& s) { s.dash = 0.3; }));
  EXPECT_TRUE(differs([](SeedsView& s) { s.points = {{0.4, 0.4, 0.4}}; }));
  EXPECT_TRUE(differs([](SeedsView& s) {
    s.line = protocol::SeedLineView{{0.4, 0.4, 0.4}, {0.6, 0.6, 0.6}, 2};
  }));
  EXPECT_TRUE(differs([](SeedsView& s) {
    s.block = protocol::SeedBlockView{{0.4, 0.4, 0.4}, {0.6, 0.6, 0.6}, {2, 1, 1}};
  }));
}

TEST(SeededScene, BeyondTheMemoryLimitIsRefusedWithTheRemedy) {
  auto source = data::open_sample("tornado", {16, 16, 16});
  data::Dataset dataset(std::move(*source), "tornado", std::uint64_t{40} << 20U);
  View view = seeded();
  view.vector.trace->seeds->evenly = 5000;
  view.vector.trace->seeds->pieces = 4096;
  const auto refused = refusal_of(view, dataset);
  EXPECT_EQ(refused.first, "/vector/trace/seeds");
  EXPECT_THAT(refused.second, HasSubstr("/vector/trace/seeds/pieces"));
  view.vector.trace->seeds->pieces = 20;
  EXPECT_TRUE(build_scene(view, dataset));
}

TEST(SeededScene, MoreSeedsTogetherThanTheLimitAreRefused) {
  auto dataset = wind_dataset(1);
  View view = seeded();
  view.vector.trace->seeds->evenly = 4000;
  view.vector.trace->seeds->block = protocol::SeedBlockView{{0, 0, 500}, {30, 0, 500}, {40, 40, 1}};
  const auto refused = complete(view, *dataset);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().at[0].pointer, "/vector/trace/seeds");
  EXPECT_THAT(refused.error().message, HasSubstr("has 5600 seeds; the limit is 5000"));
}

TEST(PathScene, NeedsTimesAndSpeedsInTheWorld) {
  auto dataset = wind_dataset(3);
  View view = seeded({{10, 0, 500}});
  view.vector.trace->seeds->path_steps = 1;
  EXPECT_EQ(refusal_of(view, *dataset).first, "/vector/trace/seeds/pathSteps");
  EXPECT_THAT(refusal_of(view, *dataset).second, HasSubstr("/vector/space"));
  view.vector.space = protocol::VectorSpace::world;
  EXPECT_THAT(refusal_of(view, *dataset).second, HasSubstr("no known unit"));
  auto one = wind_dataset(1);
  EXPECT_THAT(refusal_of(view, *one).second, HasSubstr("has one step"));
}

// A wind of (step + 1) m/s to the east, that changes linearly in time, moves along the equator.
TEST(PathScene, AWindThatGrowsCarriesAParticleByItsMeanSpeed) {
  data::Dataset dataset(std::make_unique<EastWind>(atmosphere_grid(), 3), "fake",
                        std::uint64_t{1} << 30U);
  View view = seeded({{15, 0, 500}});
  view.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
  view.vector.space = protocol::VectorSpace::world;
  view.step = 1;
  view.vector.trace->seeds->path_steps = 5;  // of which the series has one on each side
  const Scene scene = built(view, dataset);
  const trace::Segments& made = *scene.vector->streamlets;
  ASSERT_EQ(made.tally.lines, 1);
  double low = 1e9;
  double high = -1e9;
  for (std::size_t v = 0; v + 1 < made.vertices(); ++v) {
    if (!(made.magnitudes[v] > 0)) continue;
    low = std::min<double>(low, made.places[v][0]);
    high = std::max<double>(high, made.places[v + 1][0]);
  }
  // Ten hours a step: from 1 to 2 m/s 54 km, from 2 to 3 m/s 90 km; world units by longitude.
  const auto& x = scene.lattice.positions[0];
  const double per_degree = (x.back() - x.front()) / 30;
  const double metres = 6371000 * std::numbers::pi / 180;
  const double middle = 0.5 * (x.front() + x.back());
  EXPECT_NEAR((middle - low) / per_degree * metres, 54000, 300);
  EXPECT_NEAR((high - middle) / per_degree * metres, 90000, 300);
}

View carried_paths(int steps) {
  View view = seeded({{15, 0, 500}});
  view.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
  view.vector.space = protocol::VectorSpace::world;
  view.step = 1;
  view.vector.trace->seeds->path_steps = steps;
  return view;
}

TEST(PathScene, TheNumberOfStepsIsPartOfTheKeyOfTheLines) {
  data::Dataset dataset(std::make_unique<EastWind>(atmosphere_grid(), 5), "fake",
                        std::uint64_t{1} << 30U);
  const auto one = built(carried_paths(1), dataset).vector->streamlets;
  EXPECT_EQ(built(carried_paths(1), dataset).vector->streamlets, one);
  EXPECT_NE(built(carried_paths(3), dataset).vector->streamlets, one);
  EXPECT_NE(built(carried_paths(0), dataset).vector->streamlets, one);
}

// Drawing the picture again needs the vectors of its own step only.
TEST(PathScene, KeptPathsDoNotLoadTheirStepsAgain) {
  auto source = std::make_unique<EastWind>(atmosphere_grid(), 3);
  const int& reads = source->reads();
  data::Dataset dataset(std::move(source), "fake", std::uint64_t{1} << 30U);
  const auto kept = built(carried_paths(1), dataset).vector->streamlets;
  dataset.evict();
  const int before = reads;
  const Scene again = built(carried_paths(1), dataset);
  EXPECT_EQ(again.vector->streamlets, kept);
  EXPECT_LE(reads, before + 1);
}

// Of a difference at the same steps, paths end where one of the datasets does.
TEST(PathScene, ADifferenceHasTheStepsOfBothDatasets) {
  const data::Dataset longer(std::make_unique<EastWind>(atmosphere_grid(), 5), "longer",
                             std::uint64_t{1} << 30U);
  for (const int steps : {1, 2}) {
    const data::Dataset shorter(std::make_unique<EastWind>(atmosphere_grid(), steps), "shorter",
                                std::uint64_t{1} << 30U);
    auto both = longer.minus(shorter, std::nullopt);
    ASSERT_TRUE(both) << both.error().message;
    View view = carried_paths(4);
    view.step = 0;
    view.difference = protocol::DifferenceView{"shorter", std::nullopt};
    const auto scene = build_scene(view, *both);
    EXPECT_EQ(scene.has_value(), steps == 2);
    if (steps == 1) {
      ASSERT_FALSE(scene.error().at.empty()) << scene.error().message;
      EXPECT_EQ(scene.error().at[0].pointer, "/vector/trace/seeds/pathSteps");
    } else if (!scene) {
      ADD_FAILURE() << scene.error().message;
    }
  }
}

// Each of them fits, but not both.
TEST(PathScene, VectorsOfTheStepsAndSegmentsMustFitTogether) {
  data::Grid grid = atmosphere_grid();
  std::vector<double> levels;
  for (int k = 0; k < 20000; ++k) levels.push_back(1000 - 0.04 * k);
  grid.axes[2].coordinates = levels;
  constexpr std::uint64_t series = 5 * 12 * 20000 * 2 * sizeof(float);
  std::uint64_t limit = series;
  const auto dataset_within = [&](std::uint64_t bytes) {
    return data::Dataset(std::make_unique<EastWind>(grid, 5), "fake", bytes);
  };
  while (!dataset_within(limit).is_within_limit(series + (series / 2))) limit += 1U << 20U;
  data::Dataset dataset = dataset_within(limit);
  View view = carried_paths(4);
  view.vector.trace->seeds->points.clear();
  view.vector.trace->seeds->pieces = 4096;
  view.vector.trace->seeds->evenly =
      static_cast<int>(series / (2 * 4224 * trace::Segments::vertex_bytes));
  const auto refused = refusal_of(view, dataset);
  EXPECT_EQ(refused.first, "/vector/trace/seeds");
  EXPECT_THAT(refused.second, HasSubstr("/vector/trace/seeds/pathSteps"));
}

}  // namespace
}  // namespace windsplat::scene
