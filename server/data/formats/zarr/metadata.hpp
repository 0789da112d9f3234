// Metadata of an array as plain, validated data. Json of .zarray or zarr.json -> ArrayMetadata.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/json.hpp"

namespace windsplat::data::zarr {

struct Dtype {
  char kind = 'f';        // b, i, u, f as in NumPy
  std::size_t bytes = 4;  // size of one item
  bool operator==(const Dtype&) const = default;
};

// A step of encoding. The first step encodes the items of a chunk, in little-endian byte order.
struct Codec {
  enum class Kind {
    swap_bytes,
    shuffle,  // the numcodecs filters shuffle, delta and fixedscaleoffset
    delta,
    fixed_scale_offset,
    zlib,
    gzip,
    zstd,
    lz4,
    blosc,
    crc32c
  };
  Kind kind = Kind::swap_bytes;
  std::size_t element_bytes = 0;  // swap_bytes, shuffle
  Dtype decoded = {};             // delta, fixed_scale_offset
  Dtype encoded = {};
  double scale = 1;  // fixed_scale_offset: decoded = encoded / scale + offset
  double offset = 0;
};

// A file of several chunks with an index of their places (codec sharding_indexed).
struct Shard {
  std::vector<std::size_t> shape;  // in items; a multiple of the chunks
  std::vector<std::size_t> order;  // dimensions in which the index counts chunks, slowest first
  bool index_at_start = false;
  bool index_big_endian = false;
  bool index_checked = true;  // a CRC-32C follows the index
};

struct ArrayMetadata {
  std::vector<std::size_t> shape;
  std::vector<std::size_t> chunks;  // what is decoded at once; same rank as shape, each at least 1
  std::vector<std::size_t> order;   // dimensions of a stored chunk, slowest first
  Dtype dtype;
  bool prefixed_keys = false;  // "c/0/0", not "0/0"
  char separator = '.';
  std::vector<Codec> codecs;
  std::optional<Shard> shard;        // empty: a file holds one chunk
  std::optional<double> fill_value;  // empty: the values of absent chunks are undefined
  std::string problem;               // why the array cannot be read; empty if it can

  [[nodiscard]] std::size_t chunk_items() const;
  // The shape of the chunks that are files.
  [[nodiscard]] const std::vector<std::size_t>& file_shape() const {
    return shard ? shard->shape : chunks;
  }
};

// Errors: bad_data for invalid metadata; unsupported features set `problem`.
// https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html
Result<ArrayMetadata> parse_v2(const Json& json);
// https://zarr-specs.readthedocs.io/en/latest/v3/core/index.html
Result<ArrayMetadata> parse_v3(const Json& json);

// The number of an attribute or fill_value, including the strings NaN, Infinity and -Infinity.
std::optional<double> as_number(const Json& json);

// An extension of version 3 that is neither in `known` nor optional; empty if there is none.
std::string unknown_member(const Json& json, const std::vector<std::string_view>& known);

}  // namespace windsplat::data::zarr
