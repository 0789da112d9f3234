// Numbering of the files of an array (chunks, or shards of chunks) and their keys in the store.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/data/formats/zarr/metadata.hpp"

namespace windsplat::data::zarr {

// Number of files of an array; at least one unless a dimension is empty.
std::uint64_t file_count(const ArrayMetadata& array);

// A file within its array's folder; `number` counts with the last dimension fastest.
std::string file_key(const ArrayMetadata& array, std::uint64_t number);

// Chunks of an array, or files of it: the first and the last along each dimension.
struct ChunkRange {
  std::vector<std::size_t> first;
  std::vector<std::size_t> last;
  bool operator==(const ChunkRange&) const = default;
};

// Advances a place within a range along so many dimensions, the last one fastest; false after the
// last place.
bool advance(std::vector<std::size_t>& place, const ChunkRange& range, std::size_t dimensions);

// Those of that shape in which a block lies; its counts are positive.
ChunkRange range_of(const std::vector<std::size_t>& shape, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count);

std::uint64_t number_of_file(const ArrayMetadata& array, const std::vector<std::size_t>& file);

// Those of `chunks` that lie in a file.
ChunkRange chunks_in(const ArrayMetadata& array, const std::vector<std::size_t>& file,
                     const ChunkRange& chunks);

// A chunk of an array: its file, and its place in that file's index.
struct ChunkPlace {
  std::uint64_t file = 0;
  std::size_t in_file = 0;
  std::size_t per_file = 1;
  [[nodiscard]] std::uint64_t number() const { return file * per_file + in_file; }
};

// place: indices of the chunk in the grid of all chunks.
ChunkPlace place_of(const ArrayMetadata& array, const std::vector<std::size_t>& place);

}  // namespace windsplat::data::zarr
