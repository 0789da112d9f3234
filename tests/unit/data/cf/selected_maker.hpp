// Small files with members of ensembles, for tests of chosen entries.
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test::entries {

// Values whose decimal digits are the sample's indices, the first dimension's first.
inline std::vector<double> tagged(const std::vector<std::size_t>& lengths) {
  std::vector<double> out{0};
  for (const std::size_t length : lengths) {
    std::vector<double> next;
    next.reserve(out.size() * length);
    for (const double tag : out) {
      for (std::size_t i = 0; i < length; ++i) next.push_back(10 * tag + static_cast<double>(i));
    }
    out = std::move(next);
  }
  return out;
}

inline float last_of(const Volume& volume) { return volume.values[volume.values.size() - 1]; }

struct Space {
  int z, y, x;
};

inline Space space_of(NetcdfMaker& file) {
  return {file.axis("lev", {1000, 500}, "hPa", "air_pressure"),
          file.axis("lat", {0, 10, 20}, "degrees_north", "latitude"),
          file.axis("lon", {0, 10, 20, 30}, "degrees_east", "longitude")};
}

// Members 3, 5 and 9; t(number, time, lev, lat, lon), oro(lat, lon).
inline void write_ensemble(const std::string& path, double hour = 0) {
  NetcdfMaker file(path);
  const int n = file.axis("number", {3, 5, 9}, "1", "realization");
  const int t = file.axis("time", {hour, hour + 6}, "hours since 2001-01-01", "time");
  const auto [z, y, x] = space_of(file);
  file.variable("t", NC_FLOAT, {n, t, z, y, x}, tagged({3, 2, 2, 3, 4}));
  file.variable("steady", NC_FLOAT, {z, y, x}, tagged({2, 3, 4}));
}

inline std::string why_not(const std::string& path) {
  const auto source = open_file(path);
  EXPECT_FALSE(source) << path << " was opened";
  return source ? "" : source.error().message;
}

}  // namespace windsplat::data::test::entries
