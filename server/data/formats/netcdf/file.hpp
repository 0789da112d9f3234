// One open netCDF file, through the C library with RAII. InputFile -> validation -> nc_open ->
// FileContents and numbers.
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/netcdf/hdf5_storage.hpp"

namespace windsplat::data::netcdf {

// The library is not thread-safe: every call on any file requires this lock.
class LibraryLock {
 public:
  LibraryLock();
  ~LibraryLock();
  LibraryLock(const LibraryLock&) = delete;
  LibraryLock& operator=(const LibraryLock&) = delete;
};

// The absolute output path with links resolved; must not contain the characters by which the
// library recognises URLs and mode fragments. Errors: not_found, bad_data.
Result<std::string> writable_path(const std::string& path);

class File final : public cf::ArrayFile {
 public:
  // `group`: path of the group to read ("a/b"), with the coordinates of its parents. Empty: the
  // root, or, if that has no fields, the first group (breadth first) with fields. Errors: bad_data
  // if the file is not netCDF (classic, 64-bit or HDF5) or truncated; not_found for an unknown
  // group.
  static Result<std::unique_ptr<File>> open(std::shared_ptr<const InputFile> input,
                                            const std::string& group = "");
  ~File() override;
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return input_->name(); }
  [[nodiscard]] std::string format() const override;
  [[nodiscard]] std::string identity() const override;

  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override;

  [[nodiscard]] cf::Unwritten unwritten(int variable, std::size_t most) const override;
  void forget_chunks(int variable) const override;

  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;

 private:
  explicit File(std::shared_ptr<const InputFile> input) : input_(std::move(input)) {}
  // Ids of a variable in the library.
  struct Place {
    int group = 0;
    int id = 0;
  };
  [[nodiscard]] static std::string text(const Place& variable, const char* attribute);
  [[nodiscard]] const Place& place_of(int variable) const {
    return places_.at(static_cast<std::size_t>(variable));
  }
  Result<void> look_before_opening();
  Result<void> open_library();
  Result<void> scan(const std::string& group);
  Result<void> choose_group(const std::string& wanted, const std::vector<std::string>& groups);
  Result<void> scan_group(const std::string& path);
  Result<void> scan_dimensions(int group);
  void set_spacing_of_wrf(int group);
  void find_dates();
  Result<void> scan_variables(int group, bool above);
  Result<void> scan_variable(const Place& place, bool above);
  [[nodiscard]] bool has_field() const;
  void look_at_storage(const Place& place, FileVariable& variable);
  // Under the LibraryLock:
  void keep_chunks(int variable, const Block& block) const;
  void free_chunks(int variable) const;
  void forget_others(int variable, std::size_t bytes) const;
  template <class T, class Get>
  Result<void> read_block(int variable, const Block& block, T* out, const Get& get) const;
  Result<void> read_dates(const Block& block, double* out) const;
  [[nodiscard]] Error fault(const std::string& what) const { return input_->fault(what); }

  std::shared_ptr<const InputFile> input_;
  int ncid_ = -1;
  bool classic_ = false;
  bool netcdf4_ = false;  // false: plain HDF5
  std::string group_;     // "" or "/a/b"
  std::vector<int> dimension_ids_;
  std::vector<Place> places_;                      // parallel to contents_.variables
  Handle hdf5_;                                    // in addition to that of the netCDF library
  std::map<std::string, DatasetStorage> storage_;  // HDF5 datasets, keyed by path
  std::vector<std::string> paths_;                 // parallel to contents_.variables
  int dates_ = -1;  // variable of characters that is read as seconds (dates.hpp)
  // Under the LibraryLock: absent chunks by object, and the variables whose chunks the library
  // caches with their cache sizes, most recently read first.
  mutable std::map<haddr_t, AbsentChunks> absent_;
  mutable std::list<std::pair<int, std::size_t>> kept_;
  FileContents contents_;
};

}  // namespace windsplat::data::netcdf
