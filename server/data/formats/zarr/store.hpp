// A folder that is a Zarr store of version 2 or 3. Chunks -> blocks of numbers.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/zarr/chunk_bytes.hpp"
#include "server/data/formats/zarr/recent.hpp"
#include "server/data/formats/zarr/scan.hpp"
#include "server/data/formats/zarr/shard.hpp"

namespace windsplat::data::zarr {

// Whether a folder is a Zarr store.
bool is_store(Files& files);

struct ChunkRange;
struct LevelStore;
struct Outlook;

// Conventions of xarray: `_ARRAY_DIMENSIONS` names the dimensions, and in version 2 fill_value is
// _FillValue.
class Store final : public cf::ArrayFile {
 public:
  // `levels`: receives the other levels of a store with levels, null of any other. Errors:
  // bad_data.
  static Result<std::unique_ptr<Store>> open(std::shared_ptr<Files> files,
                                             std::unique_ptr<LevelStore>* levels = nullptr);

  [[nodiscard]] const FileContents& contents() const override { return contents_.file; }
  [[nodiscard]] const std::string& name() const override { return contents_.name; }
  [[nodiscard]] std::string format() const override {
    return "Zarr v" + std::to_string(contents_.version);
  }
  [[nodiscard]] std::string identity() const override { return contents_.identity; }

  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  [[nodiscard]] std::size_t chunk_cost_bytes(int /*variable*/) const override {
    return zarr_chunk_cost_bytes;
  }
  void forget_chunks(int variable) const override;
  void expect(const std::vector<cf::Block>& blocks) const override;
  [[nodiscard]] cf::Unwritten unwritten(int variable, std::size_t most) const override;

  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;

 private:
  struct File {
    std::string path;                        // in the store
    std::shared_ptr<const InputFile> input;  // null if absent
  };
  struct Chunk {
    ChunkBytes bytes;              // empty if it is absent
    std::size_t unread_items = 0;  // of the array, edges left out
  };
  struct OpenShard {
    File file;
    std::vector<Span> index;  // empty if the file is absent
    std::string identity;     // of a file in parts, which is closed once a block has its chunks
    bool is_told = false;     // by expect(): all of its chunks that will be read
    [[nodiscard]] bool is_absent(std::size_t chunk) const {
      return index.empty() || index[chunk].bytes == absent_span;
    }
  };

  Store(std::shared_ptr<Files> files, StoreContents contents)
      : files_(std::move(files)), contents_(std::move(contents)) {}

  [[nodiscard]] const Array& array_of(int variable) const;
  [[nodiscard]] int variable_of(const Array& array) const {
    return static_cast<int>(&array - contents_.arrays.data());
  }
  template <class Out>
  Result<void> read_block(int variable, const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, Out* out) const;
  // place: indices of the chunk in the grid of all chunks.
  Result<Chunk*> chunk_at(int variable, const std::vector<std::size_t>& place,
                          std::size_t kept_bytes_max) const;
  // A chunk of a file, which is a shard if it has more than one.
  Result<ChunkBytes> load(const Array& array, std::uint64_t file_number, std::size_t in_file) const;
  Result<const OpenShard*> shard_at(const Array& array, std::uint64_t number) const;
  Result<OpenShard> open_shard(const Array& array, std::uint64_t number) const;
  Result<File> open_file(const Array& array, std::uint64_t number) const;
  Result<const OpenShard*> reopened(const Array& array, std::uint64_t number,
                                    OpenShard& kept) const;
  // Tells of a store that is fetched what is read of the next files of a block.
  void look_ahead(const Array& array, Outlook& outlook) const;
  void expect_file(const Array& array, std::uint64_t number) const;
  void expect_chunks(const Array& array, const OpenShard& shard, const ChunkRange& chunks) const;
  void close_parts(int variable, std::uint64_t number) const;
  [[nodiscard]] Error fault(const std::string& path, const std::string& what) const;

  std::shared_ptr<Files> files_;
  StoreContents contents_;
  mutable std::mutex mutex_;  // guards what is cached
  mutable Recent<Chunk> kept_;
  mutable Recent<OpenShard> shards_;
  // By variable and number: those of expect() that are not read yet, at most Outlook::shards.
  mutable std::map<std::pair<int, std::uint64_t>, OpenShard> expected_;
};

// The arrays that the attribute of a store with levels names, and the coordinates of level 0.
struct LevelStore {
  LevelNames names;
  std::map<std::string, Array> finest;  // of level 0, by name
  std::vector<ArrayMetadata> metadata;  // by the index of an array in `arrays`
  std::map<std::string, int> indices;   // by path
  std::unique_ptr<const Store> arrays;
};

}  // namespace windsplat::data::zarr
