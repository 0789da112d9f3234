// Land, sea, coasts and borders of the embedded lines.
#include "server/ground/atlas.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/ground/lines.hpp"

namespace windsplat::ground {
namespace {

struct Known {
  const char* name;
  double latitude, longitude;
  bool land;
};

// At least half a degree from any coast.
constexpr std::array<Known, 36> known{{{"Madrid", 40.42, -3.70, true},
                                       {"Paris", 48.86, 2.35, true},
                                       {"Prague", 50.08, 14.44, true},
                                       {"Moscow", 55.76, 37.62, true},
                                       {"Novosibirsk", 55.03, 82.92, true},
                                       {"Yakutsk", 62.03, 129.73, true},
                                       {"Delhi", 28.61, 77.21, true},
                                       {"Lhasa", 29.65, 91.10, true},
                                       {"Wuhan", 30.59, 114.31, true},
                                       {"Riyadh", 24.71, 46.68, true},
                                       {"Nairobi", -1.29, 36.82, true},
                                       {"Johannesburg", -26.20, 28.05, true},
                                       {"Timbuktu", 16.77, -3.01, true},
                                       {"Alice Springs", -23.70, 133.88, true},
                                       {"Denver", 39.74, -104.99, true},
                                       {"Winnipeg", 49.90, -97.14, true},
                                       {"Fairbanks", 64.84, -147.72, true},
                                       {"Brasilia", -15.79, -47.88, true},
                                       {"La Paz", -16.49, -68.12, true},
                                       {"Summit of Greenland", 72.58, -38.46, true},
                                       {"Vostok", -78.46, 106.84, true},
                                       {"South Pole", -90.0, 0.0, true},
                                       {"beside the South Pole", -89.5, 179.9, true},
                                       {"North Pole", 90.0, 0.0, false},
                                       {"North Atlantic", 40.0, -40.0, false},
                                       {"South Atlantic", -30.0, -15.0, false},
                                       {"North Pacific", 35.0, -160.0, false},
                                       {"date line", 10.0, 180.0, false},
                                       {"Indian Ocean", -20.0, 80.0, false},
                                       {"Southern Ocean", -58.0, 100.0, false},
                                       {"Hudson Bay", 59.0, -85.0, false},
                                       {"Gulf of Mexico", 25.0, -90.0, false},
                                       {"Mediterranean", 35.0, 18.0, false},
                                       {"Black Sea", 43.2, 34.0, false},
                                       {"Bay of Biscay", 45.0, -5.0, false},
                                       {"Tasman Sea", -38.0, 160.0, false}}};

TEST(Atlas, KnowsLandAndSeaAtEveryLevel) {
  for (std::size_t n = 0; n < levels; ++n) {
    const Level& level = atlas(n);
    for (const Known& at : known) {
      EXPECT_EQ(level.is_land({at.longitude, at.latitude}), at.land)
          << at.name << " at " << level.tolerance();
      EXPECT_EQ(level.is_land({at.longitude + 360, at.latitude}), at.land) << at.name;
    }
  }
}

// A segment of this level passes through a corner of its cells, with a slope of 1.
TEST(Atlas, ASegmentThroughACornerSeparatesLandAndSea) {
  const Level& level = atlas(levels - 1);
  EXPECT_FALSE(level.is_land({78.115, -68.795}));
  EXPECT_TRUE(level.is_land({78.93, -68.895}));
  EXPECT_TRUE(level.is_land({78.3, -69.2}));
}

// The parity of the coasts between a place and the north pole, of all of them.
TEST(Atlas, LandFollowsFromTheCoastsToTheNorthOfAPlace) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> longitudes(-180, 180);
  std::uniform_real_distribution<double> latitudes(-88, 88);
  for (std::size_t n = 0; n < levels; ++n) {
    const Level& level = atlas(n);
    int land = 0;
    for (int trial = 0; trial < 400; ++trial) {
      const Place place{longitudes(random), latitudes(random)};
      std::set<const Segment*> crossed;
      const auto column = level.cells(place.longitude, place.longitude, -90, 90);
      level.each(column, false, [&](const Segment& s, bool) {
        const double a = std::remainder(static_cast<double>(s.from[0]) - place.longitude, 360.0);
        const double b = a + static_cast<double>(s.to[0]) - static_cast<double>(s.from[0]);
        if ((a <= 0) == (b <= 0)) return;
        const auto south = static_cast<double>(s.from[1]);
        const double at = south + (static_cast<double>(s.to[1]) - south) * (a / (a - b));
        if (at > place.latitude) crossed.insert(&s);
      });
      const bool odd = crossed.size() % 2 == 1;
      EXPECT_EQ(level.is_land(place), odd) << place.longitude << ' ' << place.latitude;
      land += odd ? 1 : 0;
    }
    // Evenly in latitude, 36 % of the Earth are land, most of it in the north and at the south
    // pole.
    EXPECT_GT(land, 100);
    EXPECT_LT(land, 200);
  }
}

// 29.2 % of the Earth are land, 0.3 % of it the ice shelves of Antarctica, which the data leave
// out.
TEST(Atlas, HasTheAreaOfTheContinents) {
  for (std::size_t n = 0; n < levels; ++n) {
    const Level& level = atlas(n);
    double land = 0;
    double all = 0;
    for (double latitude = -89.5; latitude < 90; latitude += 1) {
      const double weight = std::cos(latitude * 3.14159265358979 / 180);
      for (double longitude = -179.5; longitude < 180; longitude += 1) {
        all += weight;
        if (level.is_land({longitude, latitude})) land += weight;
      }
    }
    EXPECT_NEAR(land / all, 0.289, 0.004) << level.tolerance();
  }
}

// Capes by their coordinates in gazetteers: a coast passes within the tolerance of the level and
// 2 km, and none lies half a degree out to sea.
TEST(Atlas, CoastsPassKnownCapes) {
  struct Cape {
    const char* name;
    double latitude, longitude;
  };
  constexpr std::array<Cape, 6> capes{{{"Point of Tarifa", 36.000, -5.610},
                                       {"Cape Agulhas", -34.833, 20.000},
                                       {"Cape of Good Hope", -34.357, 18.473},
                                       {"Cape St Vincent", 37.023, -8.996},
                                       {"Cape Comorin", 8.078, 77.541},
                                       {"Cape Wrath", 58.625, -5.000}}};
  for (std::size_t n = 0; n < levels; ++n) {
    const Level& level = atlas(n);
    if (level.tolerance() > 0.1) continue;
    for (const Cape& cape : capes) {
      double nearest = 1e9;
      const double shrink = std::cos(cape.latitude * 3.14159265358979 / 180);
      level.each(
          level.cells(cape.longitude - 2, cape.longitude + 2, cape.latitude - 2, cape.latitude + 2),
          false, [&](const Segment& s, bool) {
            const double ax = (static_cast<double>(s.from[0]) - cape.longitude) * shrink;
            const double ay = static_cast<double>(s.from[1]) - cape.latitude;
            const double bx = (static_cast<double>(s.to[0]) - cape.longitude) * shrink;
            const double by = static_cast<double>(s.to[1]) - cape.latitude;
            for (double t = 0; t <= 1; t += 0.01) {
              nearest = std::min(nearest, std::hypot(ax + t * (bx - ax), ay + t * (by - ay)));
            }
          });
      EXPECT_LT(nearest, level.tolerance() + 0.02) << cape.name;
    }
  }
}

TEST(Atlas, BordersSeparateNeighboursAndAreNoCoasts) {
  const Level& level = atlas(0);
  const auto alps = level.cells(7, 8, 45.9, 46.9);  // Italy and Switzerland
  int borders = 0;
  level.each(alps, true, [&](const Segment&, bool coast) { borders += coast ? 0 : 1; });
  EXPECT_GT(borders, 10);
  level.each(alps, false, [](const Segment&, bool) { ADD_FAILURE(); });
}

TEST(Atlas, TheCoarsestLevelWithinHalfAPixelIsChosen) {
  EXPECT_EQ(level_for(0.001).tolerance(), 0.015);
  EXPECT_EQ(level_for(0.099).tolerance(), 0.015);
  EXPECT_EQ(level_for(0.101).tolerance(), 0.05);
  EXPECT_EQ(level_for(0.5).tolerance(), 0.2);
}

// In a process of its own, since other tests read other levels.
TEST(AtlasDeathTest, ALevelIsReadWhenItIsFirstNeeded) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto is_lazy = [] {
    if (atlas_bytes() != 0) return false;
    for (const double degrees : {0.001, 0.2, 0.5}) level_number(degrees);
    if (atlas_bytes() != 0) return false;
    const std::size_t coarse = level_for(0.5).bytes();
    level_for(0.7);
    if (atlas_bytes() != coarse) return false;
    const std::size_t middle = level_for(0.2).bytes();
    return atlas_bytes() == coarse + middle;
  };
  EXPECT_EXIT(std::_Exit(is_lazy() ? 0 : 1), testing::ExitedWithCode(0), "");
}

TEST(Atlas, ThreadsThatNeedALevelGetOneAndTheSame) {
  std::array<const Level*, 8> found{};
  std::vector<std::thread> threads;
  threads.reserve(found.size());
  for (const Level*& level : found) {
    threads.emplace_back([&level] { level = &level_for(0.2); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Level* level : found) EXPECT_EQ(level, found[0]);
}

// As the comment of atlas() says.
TEST(Atlas, LevelsTakeTheMemoryThatIsStated) {
  constexpr std::array<double, levels> megabytes{3.03, 1.02, 0.21};
  for (std::size_t n = 0; n < levels; ++n) {
    EXPECT_NEAR(static_cast<double>(atlas(n).bytes()) * 1e-6, megabytes.at(n), 0.05) << n;
    EXPECT_EQ(atlas(n).tolerance(), tolerances.at(n));
  }
}

// As scripts/ground_data prints them.
TEST(Atlas, IsTheOutputOfItsScript) {
  const std::string bytes = embedded_lines();
  EXPECT_EQ(bytes.size(), 324504U);
  EXPECT_EQ(crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())),
            4267978305U);
}

}  // namespace
}  // namespace windsplat::ground
