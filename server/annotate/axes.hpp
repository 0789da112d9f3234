// Coordinates of an axis <-> positions in the box.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// Monotonic and piecewise linear between samples, or in the logarithm of the coordinate; linear
// beyond the outermost ones.
class AxisMap {
 public:
  // Errors: none; `values` and `positions` have the same size, at least 1, and ascend or descend.
  AxisMap(std::vector<double> values, std::vector<double> positions, bool logarithmic);

  [[nodiscard]] double position(double value) const;
  [[nodiscard]] double value(double position) const;
  // Whether equal steps of the coordinate are equal steps in the box, to a thousandth.
  [[nodiscard]] bool even() const { return even_; }
  [[nodiscard]] bool single() const { return values_.size() == 1; }

 private:
  std::vector<double> values_;  // their logarithms if logarithmic_
  std::vector<double> positions_;
  bool logarithmic_ = false;
  bool even_ = true;
};

// The map of axis a (x, y, z) of a box that is not a globe; nullopt: its coordinates are not those
// of the box (rows and columns of a grid that a map places by 2-D longitudes have their degrees).
std::optional<AxisMap> axis_map(const Subject& subject, std::size_t axis);

// The axis as drawn: longitudes and latitudes where a map places columns by them, a height field
// as the vertical one, kilometres for metres that reach 100 km.
data::Axis drawn_axis(const Subject& subject, std::size_t axis);

}  // namespace windsplat::annotate
