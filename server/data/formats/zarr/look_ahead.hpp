// The files and chunks of a block that are read next: block -> Files::expect().
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/data/formats/zarr/chunks.hpp"

namespace windsplat::data::zarr {

// How far a reader has told which files and chunks of a block it will read, and has read. Names of
// files are told earlier than the chunks of shards, for which their index is needed.
struct Outlook {
  static constexpr std::uint64_t names = 32;
  static constexpr std::uint64_t shards = 8;
  static constexpr std::size_t index_bytes_max = std::size_t{16} << 20;  // before a box is read

  // The next file along a range of files.
  struct Walk {
    std::vector<std::size_t> at;
    std::uint64_t count = 0;
    bool is_over = false;
    void step(const ChunkRange& files) {
      ++count;
      is_over = !advance(at, files, at.size());
    }
  };

  Outlook(const ChunkRange& all_files, const ChunkRange& all_chunks)
      : files(all_files), chunks(all_chunks), named{all_files.first}, told{all_files.first} {}
  const ChunkRange& files;
  const ChunkRange& chunks;
  Walk named;
  Walk told;
  std::uint64_t read = 0;  // files
};

}  // namespace windsplat::data::zarr
