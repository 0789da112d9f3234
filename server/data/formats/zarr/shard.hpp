// The index of a shard: where in the file its chunks are.
// https://zarr-specs.readthedocs.io/en/latest/v3/codecs/sharding-indexed/index.html
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

struct Span {
  std::uint64_t offset = 0;  // from the start of the file
  std::uint64_t bytes = 0;   // absent_span: the chunk is absent
  bool operator==(const Span&) const = default;
};
constexpr std::uint64_t absent_span = std::numeric_limits<std::uint64_t>::max();

// Bytes of the index of a shard.
std::size_t index_bytes(const ArrayMetadata& array);

// The spans of all chunks of a shard, each within the file. Errors: bad_data; those of the content
// are predicates without subject.
Result<std::vector<Span>> read_index(const ArrayMetadata& array, const InputFile& file);

}  // namespace windsplat::data::zarr
