// Reduced grids: rows of different numbers of points -> rows of one length.
#pragma once

#include <cstddef>
#include <vector>

namespace windsplat::data::grib {

// Interpolates every row linearly and periodically onto `columns` points; all rows begin at the
// same longitude. values: the rows one after the other, of row_lengths[j] >= 1 points each; NaN if
// missing. A sample between a value and a missing one is that value. Returns one row of `columns`
// samples for each row. Rows of `columns` points stay as they are; others have an error of at most
// h^2 / 8 times the second derivative along the row, with the spacing h of their points.
std::vector<float> equal_rows(const std::vector<float>& values,
                              const std::vector<std::size_t>& row_lengths, std::size_t columns);

}  // namespace windsplat::data::grib
