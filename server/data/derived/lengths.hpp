// Axes of a grid -> lengths in metres: what is known of them, and finite differences along an axis.
#pragma once

#include <array>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::derived {

inline constexpr double earth_radius_m = 6371000.0;
inline constexpr double degree = std::numbers::pi / 180.0;  // in radians

// How x and y measure lengths: coordinates in units of length, or longitudes and latitudes, of the
// axes or of the columns. Unknown also where one of them has a single sample.
enum class Surface { unknown, plane, sphere };
Surface surface_of(const Grid& grid);

// Metres upward of every level, from a vertical axis in units of length, or from one of air
// pressure by the ICAO standard atmosphere; nullopt: neither, or a single level.
std::optional<std::vector<double>> level_heights(const Grid& grid);

// Weights of the first derivative at a sample.
struct Stencil {
  std::size_t count = 0;  // samples used; 0: there is no difference
  std::array<std::size_t, 3> at{};
  std::array<double, 3> weight{};
  double span = 0;  // distance of the outermost samples, in the coordinate
};

// Differences along one axis. `period` > 0: sample `distinct` would be the first one again, that
// much further on (a last sample that repeats the first is not counted).
class Along {
 public:
  explicit Along(std::vector<double> coordinates, std::size_t distinct = 0, double period = 0);

  // Three points of any spacing, exact for quadratics: the neighbours, otherwise two samples on one
  // side; two points if no three can be used. `usable(m)`: whether sample m may be used, which the
  // sample itself must be.
  template <class Usable>
  [[nodiscard]] Stencil at(std::size_t sample, const Usable& usable) const {
    const Stencil& usual = usual_[sample];
    if (all_usable(usual, usable)) return usual;
    for (const Offsets& offsets : choices) {
      const Stencil other = stencil(sample, offsets);
      if (all_usable(other, usable)) return other;
    }
    return {};
  }

 private:
  struct Offsets {
    std::size_t count;
    std::array<int, 3> of;
  };
  static constexpr std::array<Offsets, 5> choices{
      {{3, {-1, 0, 1}}, {3, {0, 1, 2}}, {3, {-2, -1, 0}}, {2, {0, 1, 0}}, {2, {-1, 0, 0}}}};

  template <class Usable>
  static bool all_usable(const Stencil& stencil, const Usable& usable) {
    for (std::size_t m = 0; m < stencil.count; ++m) {
      if (!usable(stencil.at[m])) return false;
    }
    return stencil.count > 0;
  }
  [[nodiscard]] Stencil stencil(std::size_t sample, const Offsets& offsets) const;

  std::vector<double> coordinates_;
  std::size_t distinct_;
  double period_;
  std::vector<Stencil> usual_;
};

// Along x, around the globe where the longitudes of the axis, or of all columns, close a circle.
Along along_x(const Grid& grid);

}  // namespace windsplat::data::derived
