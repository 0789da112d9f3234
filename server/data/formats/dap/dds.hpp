// Dataset Descriptor Structure: the variables of an OPeNDAP dataset (DAP 2.0, 4.3 and 7.1).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::dap {

inline constexpr std::size_t arrays_max = 10'000;
inline constexpr std::size_t rank_max = 16;

enum class Type { uint8, int16, uint16, int32, uint32, float32, float64, text };

struct Dimension {
  std::string name;  // as in netCDF; made from the variable's name if it has none
  std::uint64_t length = 0;
};

// An array of the dataset, or that of a grid; of the maps of a grid those whose name is no array of
// the dataset.
struct Array {
  std::string name;
  std::string path;  // in constraints: the name of its grid, '.', and its name
  Type type = Type::float32;
  std::vector<Dimension> dims;  // slowest first; none for a number
};

struct Dds {
  std::vector<Array> arrays;
  std::vector<std::string> others;  // structures and sequences, which are not read
};

// Errors: bad_data without the name of the file: malformed, or more than arrays_max arrays, or
// dimensions of one name and different lengths.
Result<Dds> parse_dds(std::string_view text);

// The description of an answer with one array, which services send alone, in a structure, or in its
// grid with the maps behind it. Errors: bad_data, also for any other number of arrays.
Result<Array> parse_sent(std::string_view text);

}  // namespace windsplat::data::dap
