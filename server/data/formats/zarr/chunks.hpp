// Numbering of the chunks of an array and their keys in the store.
#pragma once

#include <cstdint>
#include <string>

#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// Number of chunks of an array; at least one unless a dimension is empty.
std::uint64_t chunk_count(const ArrayMetadata& array);

// The file of a chunk within its array's folder; `number` counts with the last dimension fastest.
std::string chunk_key(const ArrayMetadata& array, std::uint64_t number);

}  // namespace windsplat::data::zarr
