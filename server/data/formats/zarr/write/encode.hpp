// The items of a chunk -> the bytes that are stored of it.
#pragma once

#include <cstddef>
#include <span>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/chunk_bytes.hpp"
#include "server/data/formats/zarr/write/write_store.hpp"

namespace windsplat::data::zarr {

// Items of a chunk of the array, in the byte order of this machine, which is that of the store.

// Whether the chunk may be left out: a reader has its items for those that are absent.
bool may_be_absent(const WrittenArray& array, std::span<const unsigned char> items);

// Equal items give equal bytes. Errors: internal.
Result<ChunkBytes> encode_chunk(const WrittenArray& array, std::span<const unsigned char> items);

// Appends a number, little-endian.
void append_number(std::uint64_t number, std::size_t bytes, ChunkBytes& to);

}  // namespace windsplat::data::zarr
