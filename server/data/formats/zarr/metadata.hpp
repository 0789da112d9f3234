// Contents of .zarray as plain, validated data. Json -> ArrayMetadata.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/json.hpp"

namespace windsplat::data::zarr {

struct Dtype {
  char kind = 'f';        // b, i, u, f as in NumPy
  std::size_t bytes = 4;  // size of one item
  bool big_endian = false;
};

enum class Compressor { none, zlib, gzip, zstd, lz4, blosc };

// Filters of numcodecs, decoded in reverse order.
struct Filter {
  enum class Kind { shuffle, delta, fixed_scale_offset };
  Kind kind = Kind::shuffle;
  std::size_t element_bytes = 0;  // shuffle
  Dtype decoded;                  // the others
  Dtype encoded;
  double scale = 1;  // fixed_scale_offset: decoded = encoded / scale + offset
  double offset = 0;
};

struct ArrayMetadata {
  std::vector<std::size_t> shape;
  std::vector<std::size_t> chunks;  // same rank as shape, each at least 1
  Dtype dtype;
  bool column_major = false;
  char separator = '.';
  Compressor compressor = Compressor::none;
  std::vector<Filter> filters;
  std::optional<double> fill_value;  // empty: the values of absent chunks are undefined
  std::string problem;               // why the array cannot be read; empty if it can

  [[nodiscard]] std::size_t chunk_items() const;
};

// Errors: bad_data for invalid Zarr v2 metadata; unsupported features set `problem`.
Result<ArrayMetadata> parse_array(const Json& json);

// The number of an attribute or fill_value, including the strings NaN, Infinity and -Infinity.
std::optional<double> as_number(const Json& json);

}  // namespace windsplat::data::zarr
