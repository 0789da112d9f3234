// Stored number -> physical value, or NaN if missing or invalid (CF 1.8, 2.5.1 and 8.1).
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "server/data/cf/array_file.hpp"

namespace windsplat::data::cf {

struct Packing {
  bool packed = false;  // scale and offset apply; otherwise numbers are unchanged, including -0
  double scale = 1;
  double offset = 0;
  double wrap = 0;              // added to negative stored numbers of a signed type that is marked
                                // as unsigned
  std::vector<double> missing;  // stored numbers that mean "no value"
  double valid_min = -std::numeric_limits<double>::infinity();
  double valid_max = std::numeric_limits<double>::infinity();
  bool valid_is_unpacked = false;  // the limits are physical values, not stored numbers
};

// Packing from _FillValue, missing_value, valid_min, valid_max, valid_range, scale_factor,
// add_offset and _Unsigned. Without _FillValue, the default fill value of the type is missing,
// except for 8-bit types.
Packing packing_of(const ArrayFile& file, int variable);

// "-150 to 5000", "from 0", "up to 1": the valid values, unpacked; empty if all are.
std::string valid_text(const Packing& packing);

// Which of the variables have valid values, as a note; empty: none.
std::string valid_values_note(const ArrayFile& file, const std::vector<int>& variables);

// value = stored * scale + offset; NaN if missing, invalid, or beyond float32.
float unpack(const Packing& packing, double stored);
// The same in double, for coordinates.
double unpack_double(const Packing& packing, double stored);

// Mask of unpacked numbers stored as float32.
struct FloatMask {
  std::vector<float> missing;
  float valid_min = -std::numeric_limits<float>::max();
  float valid_max = std::numeric_limits<float>::max();
};
// The mask alone; empty if the packing needs more than a mask.
std::optional<FloatMask> float_mask(const Packing& packing);
// Applies unpack() to every value, in place.
void apply(const FloatMask& mask, float* values, std::size_t count);

}  // namespace windsplat::data::cf
