// What HDF5 knows of a file's datasets and the netCDF library does not report: where their data lie
// and what of them was written. InputFile -> DatasetStorage by path; blocks -> the same, masked.
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
  std::string problem;          // why its numbers cannot be read; empty if they can
  std::vector<hsize_t> extent;  // as written; a netCDF dimension may be longer
  std::vector<hsize_t> chunk;   // empty: not chunked
  std::size_t item_bytes = 0;
  bool written = true;    // of what is not chunked
  bool filtered = false;  // chunks are compressed
};

// The datasets of an HDF5 file by path ("/group/name"). Nothing is decoded. Errors: bad_data for
// what the netCDF library would refuse without a reason, or follow without end: external and
// dangling links, groups that contain themselves, more objects than the file can hold.
// Callers hold the LibraryLock.
Result<std::map<std::string, DatasetStorage>> survey_storage(const InputFile& input);

// A block of a dataset: one start and count a dimension.
struct Block {
  const std::vector<std::size_t>& start;
  const std::vector<std::size_t>& count;
};

// The HDF5 handle of the file; nullopt if it cannot be opened. Callers hold the LibraryLock.
Handle open_hdf5(const InputFile& input);

// Chunks of a dataset that were found absent, by number.
using AbsentChunks = std::unordered_set<std::uint64_t>;

// One dataset, open for questions about its chunks. Callers hold the LibraryLock.
class OpenDataset {
 public:
  // `absent` is kept by the caller from block to block: once the library has read an absent chunk
  // it says that there is one.
  OpenDataset(const Handle& file, const std::string& path, const DatasetStorage& storage,
              AbsentChunks& absent);

  // How many of the first `most` chunks were never written. Reads no data.
  [[nodiscard]] cf::Unwritten count_absent(std::size_t most);
  // Before a block is read. Errors: bad_data where a stored chunk is larger than its array needs.
  Result<void> check(const Block& block);
  // After it: what check() found was never written, chunks and what lies beyond the extent, becomes
  // NaN. HDF5 has its fill value there, which need not be the variable's _FillValue.
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
