// The bytes of a chunk as stored -> those of its items, little-endian, in the chunk's own order.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// The most bytes that a stored chunk of this array may have; longer ones are not even read.
std::size_t stored_bytes_max(const ArrayMetadata& array);

// chunk_items() items. What the bytes claim of themselves is checked against the array's metadata
// before anything is written. Errors: bad_data, a clause without a subject.
Result<std::vector<unsigned char>> decode_chunk(const ArrayMetadata& array,
                                                std::vector<unsigned char> stored);

}  // namespace windsplat::data::zarr
