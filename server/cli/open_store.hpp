// The store of a command: files are read by a process apart.
#pragma once

#include <cstdint>

#include "server/data/store.hpp"

namespace windsplat::cli {

// What a command takes that is not told how much: as much as a server that is not told.
constexpr std::uint64_t command_bytes_max = 8ULL << 30;

// `memory_bytes` is what the whole program may take, its loaders included: a part of it is kept
// back for what is not data.
data::StoreOptions store_options(std::uint64_t memory_bytes,
                                 data::Storage storage = data::Storage::float32);

}  // namespace windsplat::cli
