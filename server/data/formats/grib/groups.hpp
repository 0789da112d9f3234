// The fields of one quantity of a GRIB file, and the axes that they span.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "server/data/formats/grib/fields.hpp"

namespace windsplat::data::grib {

// Axes besides those of the grid, slowest first.
enum AxisIndex : std::size_t { member_axis, reference_axis, time_axis, level_axis_index };
constexpr std::size_t axis_count = 4;

// Member of an ensemble, reference time, time and level; times in hours since 1970-01-01.
using Place = std::array<double, axis_count>;

// The fields of one quantity, kind of level, statistic and grid.
struct Group {
  Header header;  // header of its first field
  Names names;
  std::size_t grid = 0;
  std::map<Place, std::size_t> fields;
  std::size_t repeated = 0;
  bool is_distinguished = false;  // others have the same name and kind of level on the same grid
  bool is_constant = false;       // the same at all times; its times are 0
  std::string height;             // "10m" if there are winds of other heights; see merge_heights
  std::array<std::vector<double>, axis_count> axes;  // ascending; set by find_axes
};

// Winds at usual heights have names of their own in ecCodes (10u, 100u, 200u), and others are u.
// With those of three or more heights they become one group, u or v; with two they stay apart.
void merge_heights(std::vector<Group>& groups);

// Whether times overlap: fields of one group that differ only in their reference time. If so, the
// times of all groups become lead times in hours, otherwise all reference times 0.
bool tell_references(std::vector<Group>& groups);

// Keeps the members that have as many fields as the one with the most.
void omit_incomplete_members(Group& group, std::vector<std::string>& notes);

// The axes of every group. A group whose times, or whose two or more levels, are part of those of
// another group on the same grid (and kind of levels) takes the other's; fields that it lacks are
// masked. All groups have the same reference times.
void find_axes(std::vector<Group>& groups, std::vector<std::string>& notes);

// Instants before statistics; marks groups that differ only in their statistic.
void order(std::vector<Group>& groups);

}  // namespace windsplat::data::grib
