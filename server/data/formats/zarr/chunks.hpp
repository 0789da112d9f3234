// Numbering of the files of an array (chunks, or shards of chunks) and their keys in the store.
#pragma once

#include <cstdint>
#include <string>

#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// Number of files of an array; at least one unless a dimension is empty.
std::uint64_t file_count(const ArrayMetadata& array);

// A file within its array's folder; `number` counts with the last dimension fastest.
std::string file_key(const ArrayMetadata& array, std::uint64_t number);

}  // namespace windsplat::data::zarr
