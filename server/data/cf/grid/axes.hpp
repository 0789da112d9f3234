// FileContents -> roles of dimensions and oriented axes, by CF attributes first and common names
// last.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/contents.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::cf {

enum class Role { unknown, x, y, z, time, other };  // other: an ensemble, cell corners, ...

// What is known about a dimension before the variables on it are examined.
struct DimensionRole {
  Role role = Role::unknown;
  AxisKind kind = AxisKind::cartesian;
  bool kind_is_sure = false;   // false: only the role is known, e.g. vertical
  bool positive_down = false;  // larger coordinates lie lower
  int coordinate = -1;         // the 1-D variable that gives its coordinates; -1: none
  bool is_assumed = false;     // the coordinate is that of named_coordinate()
  bool is_list = false;        // cells or stations in a list; `role` is then other
};

// Classifies dimensions; the result has one entry per dimension of the file. Evidence in order of
// reliability: the `axis` attribute, standard_name, units, `positive`, then the names of coordinate
// variable and dimension.
std::vector<DimensionRole> classify_dimensions(const FileContents& contents);

// Whether lower-case units are one of CF's spellings of degrees_east.
bool is_east(std::string_view units);

// Whether units are radians, in upper or lower case.
bool is_radian(std::string_view units);

// Whether a variable contains longitudes or latitudes, of any rank.
bool is_position(const FileVariable& variable);

// Assignment of the dimensions of a variable to space and time; -1 if missing.
struct Layout {
  std::array<int, 3> space{-1, -1, -1};  // dimension ids of x, y, z
  int time = -1;
  std::string problem;  // why the variable cannot be placed; empty if it can

  [[nodiscard]] int rank() const;  // number of spatial dimensions
};

// Dimensions of unknown role are assigned to free axes, the last one to x, then y, then z; an
// unlimited first one is time. Other dimensions must have length 1. If two dimensions are
// candidates for one axis, one of length 1 is ignored.
Layout lay_out(const FileContents& contents, const std::vector<DimensionRole>& roles,
               const FileVariable& variable);

// An axis whose index ascends with the world coordinate, and whether the file has the reverse
// order.
struct OrientedAxis {
  Axis axis;
  bool turned = false;
  std::string note;  // which assumption was made; empty if none
};

// Whether orient_axis() accepts coordinates: finite and strictly monotonic, longitudes in degrees
// also past the end of their range.
bool can_be_axis(std::vector<double> values, AxisKind kind);

// which: 0 x, 1 y, 2 z. coordinates: as in the file, angles in degrees; empty: the dimension has
// none, samples are placed by index. horizontal: kind of the x axis, which distinguishes a height
// from a plain z. Errors: bad_data if the coordinates are not finite and strictly monotonic.
Result<OrientedAxis> orient_axis(const FileContents& contents, const DimensionRole& role,
                                 int dimension, int which, std::vector<double> coordinates,
                                 AxisKind horizontal);

}  // namespace windsplat::data::cf
