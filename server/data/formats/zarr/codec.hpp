// Stored bytes of a chunk -> bytes of its items, little-endian, in the order of the chunk.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/chunk_bytes.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// Largest size of a stored chunk of this array; larger ones are rejected before reading.
std::size_t stored_bytes_max(const ArrayMetadata& array);

// Whether a CRC-32C (RFC 3720) of the preceding bytes ends them, in little-endian order.
constexpr std::size_t crc32c_bytes = 4;
bool ends_in_crc32c(std::span<const unsigned char> bytes);

// Returns chunk_items() items. Sizes in the stored bytes are checked against the metadata before
// use. Errors: bad_data; the message is a predicate without subject.
Result<ChunkBytes> decode_chunk(const ArrayMetadata& array, ChunkBytes stored);

}  // namespace windsplat::data::zarr
