// The store of a command: files are read by a process apart.
#pragma once

#include <cstdint>
#include <string>

#include "server/data/resident/store.hpp"

namespace windsplat::cli {

// Of a memory limit the daemon itself: program, libraries, threads, sessions, and one picture of
// 1920 x 1088 pixels that is drawn, measured and encoded (measured:
// docs/benchmarks/server.md). Loaders, larger pictures and references are counted as they come.
constexpr std::uint64_t program_bytes = std::uint64_t{112} << 20;
// What the renderer keeps about the samples of a frame: 16 bytes for each 64 samples.
constexpr std::uint64_t data_bytes_a_summary_byte = 16;
// Below it there is too little left for fields and a loader.
constexpr std::uint64_t memory_bytes_min = std::uint64_t{192} << 20;
// What a process of x86-64 has addresses for; arm64 has twice as many.
constexpr std::uint64_t memory_bytes_max = std::uint64_t{1} << 47;

// As the option takes it: "192M" where that says it exactly, else in bytes.
std::string bytes_text(std::uint64_t bytes);

// `memory_bytes`, at least memory_bytes_min, is what the whole program may take, its loaders
// included: a part of it is kept back for what is not data.
data::StoreOptions store_options(std::uint64_t memory_bytes,
                                 data::Storage storage = data::Storage::float32);
// The same of a command that reads what it was not asked for: loaders get no more memory to read
// than to open.
data::StoreOptions frugal_store_options(std::uint64_t memory_bytes);

}  // namespace windsplat::cli
