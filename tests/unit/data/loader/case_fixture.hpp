// Loaders of cases of OpenFOAM and EnSight; the tests are skipped where windsplat-vtk is not built.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "tests/unit/data/loader/loader_fixture.hpp"

namespace windsplat::data::loader {

// Linear in place and time.
inline std::vector<double> pressure_at(const std::array<double, 3>& at, double time) {
  return {1 + at[0] - 2 * at[1] + 4 * at[2] + 8 * time};
}
// A solid rotation about z with 2 rad/s, and a rise.
inline std::vector<double> wind_at(const std::array<double, 3>& at, double time) {
  return {-2 * (at[1] - 0.25), 2 * (at[0] - 0.5), 0.5 + time};
}

class CaseLoader : public Loader {
 protected:
  void SetUp() override {
    Loader::SetUp();
#ifdef WINDSPLAT_CASE_PROGRAM
    set_case_program(WINDSPLAT_CASE_PROGRAM);
    ASSERT_TRUE(has_case_program());
#else
    GTEST_SKIP() << "windsplat-vtk is not built: VTK is not installed (scripts/setup vtk)";
#endif
  }
  void TearDown() override {
    set_case_program("");
    Loader::TearDown();
  }

  // The message of opening, or of reading the first field if that succeeds.
  static std::string refusal(const std::string& path) {
    auto source = open_path(path);
    if (!source) return source.error().message;
    auto volume = (*source)->read(0, 0);
    return volume ? "not refused" : volume.error().message;
  }
};

inline Result<Volume> volume_of(RemoteSource& source, const std::string& field, std::size_t step) {
  const auto& fields = source.info().fields;
  for (std::size_t f = 0; f < fields.size(); ++f) {
    if (fields[f].name == field) return source.read(f, step);
  }
  return make_error(ErrorKind::not_found, field + " is no field");
}

// Calls take(index, position) for every sample, x fastest.
inline void for_samples(const DatasetInfo& info, const auto& take) {
  const auto& axes = info.grid.axes;
  std::size_t sample = 0;
  for (const double z : axes[2].coordinates) {
    for (const double y : axes[1].coordinates) {
      for (const double x : axes[0].coordinates) {
        take(sample++, std::array<double, 3>{x, y, z});
      }
    }
  }
}

}  // namespace windsplat::data::loader
