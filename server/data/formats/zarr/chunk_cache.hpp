// Decoded chunks of one variable, the least recently used evicted first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <unordered_map>
#include <vector>

namespace windsplat::data::zarr {

using ChunkBytes = std::vector<unsigned char>;  // empty if the chunk is absent

class ChunkCache {
 public:
  static constexpr std::size_t bookkeeping_bytes = 256;  // overhead of a cached chunk

  // Drops the chunks of another variable.
  void select(int variable);
  void forget(int variable);
  // Null if absent; valid until the next call.
  const ChunkBytes* find(std::uint64_t number);
  // Evicts chunks until `bytes` more fit, or none is left.
  void evict_for(std::size_t bytes, std::size_t bytes_max);
  const ChunkBytes* add(std::uint64_t number, ChunkBytes bytes);

 private:
  struct Chunk {
    std::uint64_t number = 0;
    ChunkBytes bytes;
  };
  void clear();

  int variable_ = -1;
  std::size_t bytes_ = 0;
  std::list<Chunk> chunks_;  // most recently used first
  std::unordered_map<std::uint64_t, std::list<Chunk>::iterator> by_number_;
};

}  // namespace windsplat::data::zarr
