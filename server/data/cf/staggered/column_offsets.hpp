// How far 2-D longitudes and latitudes lie from others with the same rows and columns.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/staggered/staggering.hpp"

namespace windsplat::data::cf {

// Degrees of rows of `width` columns.
struct ColumnPlaces {
  std::vector<double> longitude;
  std::vector<double> latitude;
  std::size_t width = 0;
};

// Of two variables on the same dimensions. Errors: bad_data.
Result<ColumnPlaces> column_places(const ArrayFile& file, int longitude, int latitude);

// How far `b` lies from `a`, in cells along rows (towards higher ones) and columns: the median over
// the samples with neighbours, from the nearest combination of the steps to both. nullopt: other
// numbers of rows or columns, fewer than two, or none has positions.
std::optional<std::array<double, 2>> offset_in_cells(const ColumnPlaces& a, const ColumnPlaces& b);

// The first face of the first center for faces that lie so far from centers of as many: -1 or 0.
// Half a cell to a tenth of one, since grids are stretched and curved; nullopt for others.
std::optional<std::ptrdiff_t> first_face_at(double cells);
inline constexpr double offset_tolerance = 0.1;

// One entry per variable of the file in both.
struct ColumnOffsets {
  // One per dimension of the variable, whose centers are that dimension itself; empty if it lies at
  // the centers.
  std::vector<std::vector<Stagger>> staggers;
  std::vector<std::string> unread;  // why a variable cannot be placed; empty if it can
};

// Variables on common rows and columns may name different positions by `coordinates`, as those at
// T and at U points of POP (TLONG TLAT, ULONG ULAT). The centers are the positions that most
// variables without the name of a velocity have, of as many the first; variables half a cell beside
// them are staggered, others cannot be read, nor are positions other than the centers used for the
// grid. Errors: bad_data.
Result<ColumnOffsets> find_column_offsets(const ArrayFile& file);

}  // namespace windsplat::data::cf
