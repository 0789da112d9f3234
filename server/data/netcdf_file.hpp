// One open netCDF file: the C library behind RAII, checked before the library sees it.
// path -> checks of our own -> nc_open -> FileContents and numbers.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/contents.hpp"

namespace windsplat::data::netcdf {

// The library is not thread-safe: every call of it, on whatever file, is made under this lock.
class LibraryLock {
 public:
  LibraryLock();
  ~LibraryLock();
  LibraryLock(const LibraryLock&) = delete;
  LibraryLock& operator=(const LibraryLock&) = delete;
};

// A path the library takes for a plain local file: absolute, links resolved, without the marks by
// which it recognises URLs and mode fragments. The last part need not exist if `for_writing`.
// Errors: not_found, bad_data.
Result<std::string> plain_path(const std::string& path, bool for_writing);

// A numeric attribute, as doubles.
struct Numbers {
  std::vector<double> values;  // empty if the attribute is absent or text
  bool floating = false;       // stored as float or double
};

class File {
 public:
  // Errors: not_found; bad_data for what is not a regular file, not netCDF, or cut short.
  static Result<std::unique_ptr<File>> open(const std::string& path);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  [[nodiscard]] const FileContents& contents() const { return contents_; }
  [[nodiscard]] bool is_classic() const { return classic_; }
  [[nodiscard]] const std::string& name() const { return name_; }  // without its folder
  // Name, size and time of last change, so independent of where the file lies.
  [[nodiscard]] std::string identity() const;

  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const;
  // Chunk length along each dimension; 1 where the variable is not chunked.
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const;

  // Frees the chunks that the library keeps of a variable, up to 16 MiB each.
  void forget_chunks(int variable) const;

  // Reads a block of a numeric variable as doubles. start, count: one a dimension, slowest first.
  // Errors: bad_data if the library fails or the file changed since it was opened.
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const;
  // A whole 0-D or 1-D variable.
  [[nodiscard]] Result<std::vector<double>> read_all(int variable) const;

 private:
  struct Stamp {
    std::uint64_t bytes = 0;
    std::int64_t seconds = 0;
    std::int64_t nanoseconds = 0;
    bool operator==(const Stamp&) const = default;
  };

  File() = default;
  static Stamp stamp_of(int descriptor);
  [[nodiscard]] std::string text(int variable, const char* attribute) const;
  Result<void> look_before_opening();
  Result<void> open_library(const std::string& path);
  Result<void> scan();
  Result<void> scan_dimensions();
  Result<void> scan_variables();
  void scan_groups();
  [[nodiscard]] Error fault(const std::string& what) const;

  std::string name_;
  int descriptor_ = -1;  // ours: sees the same bytes as the library, even if the name moves on
  Stamp stamp_;
  int ncid_ = -1;
  bool classic_ = false;
  std::vector<int> dimension_ids_;
  FileContents contents_;
};

}  // namespace windsplat::data::netcdf
