// Chunks of an array -> files of a store.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/zarr/shard.hpp"
#include "server/data/formats/zarr/write/write_store.hpp"

namespace windsplat::data::zarr {

struct WrittenFile {
  std::string path;  // in the store
  std::uint64_t bytes = 0;
  std::uint32_t crc32c = 0;  // of the whole file
  bool operator==(const WrittenFile&) const = default;
};

// Writes the chunks of a region of an array (WrittenArray::region): into one file, a shard with its
// index at the end, or a file for each chunk if the store has none. Files that exist are replaced.
// A file is removed again unless close() succeeds. Errors name the file: out_of_memory (the disk is
// full), internal. After an error the writer can only be destroyed.
class ShardWriter {
 public:
  // `place`: of the region among those of the array, along each dimension. The array must outlive
  // the writer. No file is made before there is a chunk.
  ShardWriter(std::filesystem::path store, const WrittenArray& array,
              const std::vector<std::size_t>& place);
  ShardWriter(ShardWriter&& other) noexcept;
  ShardWriter& operator=(ShardWriter&&) = delete;
  ~ShardWriter();

  // `chunk`: its number within the region, counted with the last dimension fastest; each once. In
  // the file chunks are in the order of the calls. `items`: all of a chunk, also at the ends of the
  // array, in the array's type. A chunk of absent items alone is left out.
  Result<void> add(std::size_t chunk, std::span<const float> items);
  Result<void> add(std::size_t chunk, std::span<const double> items);
  Result<void> add(std::size_t chunk, std::span<const std::uint32_t> items);

  // Writes the index and syncs the files, but not their folders. Gives the files in the order of
  // the calls; none if there is no chunk.
  Result<std::vector<WrittenFile>> close();

 private:
  template <class T>
  Result<void> add_items(std::size_t chunk, std::span<const T> items);
  [[nodiscard]] std::string path_of(std::size_t chunk) const;
  Result<void> open(const std::string& path);
  Result<void> append(std::span<const unsigned char> bytes);
  Result<void> finish_file();

  std::filesystem::path store_;
  const WrittenArray* array_;
  std::vector<std::size_t> place_;
  std::vector<std::size_t> chunks_;  // of the region, along each dimension
  std::vector<Span> index_;          // by chunk; of chunks that are files without meaning
  std::vector<WrittenFile> files_;   // the last one may be open
  int descriptor_ = -1;
  bool is_closed_ = false;
};

// Writes a small array whose items are given as a whole. Errors: those of ShardWriter.
Result<std::vector<WrittenFile>> write_array(const std::filesystem::path& store,
                                             const WrittenArray& array,
                                             std::span<const float> items);
Result<std::vector<WrittenFile>> write_array(const std::filesystem::path& store,
                                             const WrittenArray& array,
                                             std::span<const double> items);
Result<std::vector<WrittenFile>> write_array(const std::filesystem::path& store,
                                             const WrittenArray& array,
                                             std::span<const std::uint32_t> items);

}  // namespace windsplat::data::zarr
