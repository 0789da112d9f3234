// What the metadata of both versions have in common.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

Error broken_metadata(const std::string& what);

// A list of at most 8 lengths with a bounded product. Errors: bad_data.
Result<std::vector<std::size_t>> lengths(const Json& json, const char* key, std::int64_t least);

// Whether shape and chunks have one rank and not too many chunks. Errors: bad_data.
Result<void> check_chunks(const ArrayMetadata& array);

// Sets `problem` if a chunk is too large at any step of encoding.
void limit_chunk(ArrayMetadata& array);

// The codec of numcodecs with this id and configuration, for items of type `now`, which becomes
// that of its output. False, with `problem` set, if it is not supported. Filters that only round
// on encoding add nothing.
bool add_numcodec(const std::string& id, const Json& configuration, Dtype& now,
                  ArrayMetadata& array);

bool is_compressor(Codec::Kind kind);

// The compressor of numcodecs with this id; nullopt if there is none.
std::optional<Codec::Kind> compressor_named(std::string_view name);

}  // namespace windsplat::data::zarr
