// Linear interpolation along periodic rows.
#include "server/data/formats/grib/rows.hpp"

#include <cmath>

namespace windsplat::data::grib {

std::vector<float> equal_rows(const std::vector<float>& values,
                              const std::vector<std::size_t>& row_lengths, std::size_t columns) {
  std::vector<float> out(row_lengths.size() * columns);
  const float* row = values.data();
  auto sample = out.begin();
  for (const std::size_t length : row_lengths) {
    for (std::size_t i = 0; i < columns; ++i, ++sample) {
      // The position i * length / columns in whole numbers: no rounding where points coincide.
      const std::size_t before = i * length / columns;
      const std::size_t rest = i * length % columns;
      const float left = row[before];
      const float right = row[before + 1 == length ? 0 : before + 1];
      if (rest == 0 || std::isnan(right)) {
        *sample = left;
      } else if (std::isnan(left)) {
        *sample = right;
      } else {
        const double way = static_cast<double>(rest) / static_cast<double>(columns);
        const double start = left;
        *sample = static_cast<float>(start + way * (right - start));
      }
    }
    row += length;
  }
  return out;
}

}  // namespace windsplat::data::grib
