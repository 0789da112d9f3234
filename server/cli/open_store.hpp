// Opens the store of a command, which reads files in a separate process.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "server/data/fetch/fetcher.hpp"
#include "server/data/resident/store.hpp"

namespace windsplat::cli {

// Part of the memory limit for the daemon itself: program, libraries, threads, sessions, the lines
// of the Earth (ground/atlas.hpp: 4.3 MB if every level was needed), and one
// picture of 1920 x 1088 pixels that is drawn, measured and encoded (measured:
// docs/benchmarks/server.md). Loaders, larger pictures and references are counted separately when
// they are needed.
constexpr std::uint64_t program_bytes = std::uint64_t{112} << 20;
// What the renderer caches about the samples of a frame: 16 bytes per 64 samples.
constexpr std::uint64_t data_bytes_a_summary_byte = 16;
// For the grounds that the renderer keeps between frames: what its summaries, of which it keeps at
// most 64 MiB, leave of their part of the limit; at most as much again.
std::uint64_t ground_bytes_of(std::uint64_t memory_bytes);
// Below this limit too little would remain for fields and a loader.
constexpr std::uint64_t memory_bytes_min = std::uint64_t{192} << 20;
// The address space of a process on x86-64; that of arm64 is twice as large.
constexpr std::uint64_t memory_bytes_max = std::uint64_t{1} << 47;

// Formats a value of the option: "192M" if that is exact, otherwise in bytes.
std::string bytes_text(std::uint64_t bytes);

// `memory_bytes`, at least memory_bytes_min, is the limit of the whole program including its
// loaders; part of it is reserved for memory other than data. `fetcher` fetches the datasets that
// are given as URLs; null: they are refused.
using FetcherPtr = std::shared_ptr<data::fetch::Fetcher>;
data::StoreOptions store_options(std::uint64_t memory_bytes, FetcherPtr fetcher = nullptr,
                                 data::Storage storage = data::Storage::float32);
// The same for a command that reads ranges without a request: loaders get no more memory for
// reading than for opening.
data::StoreOptions frugal_store_options(std::uint64_t memory_bytes, FetcherPtr fetcher = nullptr);

// A sample or files by name, without a store and its limit; `loader_bytes`: of the private memory
// of the loader. Errors: those of Store::add().
Result<std::unique_ptr<data::Source>> open_source(const std::string& name,
                                                  std::uint64_t loader_bytes,
                                                  const FetcherPtr& fetcher,
                                                  const CancelToken& cancel);

}  // namespace windsplat::cli
