// Storage of datasets in HDF5 files, which the netCDF library does not report: layout and unwritten
// chunks. InputFile -> DatasetStorage by path; masks unwritten parts of blocks.
#pragma once

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_set>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::netcdf {

// An HDF5 identifier, closed with its scope.
class Handle {
 public:
  Handle() = default;
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(other.id_), close_(other.close_) { other.id_ = -1; }
  Handle& operator=(Handle&& other) noexcept;
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle();
  explicit operator bool() const { return id_ >= 0; }
  [[nodiscard]] hid_t id() const { return id_; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

struct DatasetStorage {
  haddr_t object = 0;           // in the file; links to one dataset share it
  std::string problem;          // why it cannot be read; empty if it can
  std::vector<hsize_t> extent;  // current size; a netCDF dimension may be longer
  std::vector<hsize_t> chunk;   // empty: not chunked
  std::size_t item_bytes = 0;
  bool written = true;    // for unchunked datasets
  bool filtered = false;  // chunks are compressed
};

// The datasets of an HDF5 file by path ("/group/name"), without decoding. Errors: bad_data for
// files on which the netCDF library would fail without a reason or loop forever: external and
// dangling links, cyclic groups, more objects than the file can contain. Requires the LibraryLock.
Result<std::map<std::string, DatasetStorage>> scan_storage(const InputFile& input);

// A block of a dataset: one start and count per dimension.
struct Block {
  const std::vector<std::size_t>& start;
  const std::vector<std::size_t>& count;
};

// Opens the file in HDF5; the handle is invalid on failure. Requires the LibraryLock.
Handle open_hdf5(const InputFile& input);

// Chunks of a dataset that were found absent, by number.
using AbsentChunks = std::unordered_set<std::uint64_t>;

// One open dataset, to examine its chunks. Requires the LibraryLock.
class OpenDataset {
 public:
  // The caller keeps `absent` between blocks, because the library reports an absent chunk as
  // present once it has been read.
  OpenDataset(const Handle& file, const std::string& path, const DatasetStorage& storage,
              AbsentChunks& absent);

  // Counts the unwritten chunks among the first `most`, without reading data.
  [[nodiscard]] cf::Unwritten count_absent(std::size_t most);
  // Call before reading a block. Errors: bad_data if a stored chunk is larger than possible.
  Result<void> check(const Block& block);
  // Call after reading: sets unwritten chunks and everything beyond the extent to NaN. HDF5 returns
  // its fill value there, which may differ from _FillValue of the variable.
  template <class T>
  void mask(const Block& block, T* out) const;

 private:
  struct Box {
    std::vector<std::size_t> first;
    std::vector<std::size_t> end;
  };
  template <class Absent, class Chunk>
  bool walk(const Block& block, const Absent& absent, const Chunk& chunk) const;
  template <class Absent, class Chunk>
  bool walk_chunks(const Box& inside, const Absent& absent, const Chunk& chunk) const;
  [[nodiscard]] hsize_t stored_bytes(const std::vector<hsize_t>& at);
  [[nodiscard]] std::uint64_t number_of(const std::vector<hsize_t>& at) const;

  const DatasetStorage& storage_;
  AbsentChunks& absent_;
  Handle dataset_;
  bool any_absent_ = false;
};

extern template void OpenDataset::mask(const Block& block, float* out) const;
extern template void OpenDataset::mask(const Block& block, double* out) const;

}  // namespace windsplat::data::netcdf
