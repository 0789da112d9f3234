// One array of a VTK file: where its values lie and how they are written, and a reader that hands
// them out one after another. InputFile -> bytes -> blocks -> doubles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::vtk {

enum class Encoding { text, base64, raw };
enum class Compressor { none, zlib, lz4 };

// How a file writes binary arrays.
struct Coding {
  bool big_endian = false;
  bool has_header = true;  // the XML formats put a byte count or a table of blocks before the data
  int header_bytes = 4;    // a number's width there: 4 or 8
  Compressor compressor = Compressor::none;
};

struct StoredArray {
  std::string name;
  bytes::Scalar type = bytes::Scalar::float32;
  int components = 1;
  std::vector<std::string> component_names;  // empty, or one a component
  std::uint64_t tuples = 0;
  Encoding encoding = Encoding::text;
  Coding coding;
  std::uint64_t offset = 0;  // in the file
  std::uint64_t room = 0;    // bytes of the file that the array may take at most

  [[nodiscard]] std::uint64_t values() const {
    return tuples * static_cast<std::uint64_t>(components);
  }
};

// Values in the file's order. Not thread-safe.
class ArrayReader {
 public:
  // Checks that the file can hold what the array claims. Errors: bad_data.
  static Result<ArrayReader> open(std::shared_ptr<const InputFile> file, const StoredArray& array);
  ArrayReader(ArrayReader&&) noexcept;
  ArrayReader& operator=(ArrayReader&&) noexcept;
  ~ArrayReader();

  // The next `count` values, no more than there are. Errors: bad_data.
  Result<void> read(double* out, std::size_t count);

 private:
  class Stream;
  explicit ArrayReader(std::unique_ptr<Stream> stream);
  std::unique_ptr<Stream> stream_;
};

// All values at once; only for arrays whose size was judged before. Errors: bad_data.
Result<std::vector<double>> read_all(const std::shared_ptr<const InputFile>& file,
                                     const StoredArray& array);

}  // namespace windsplat::data::vtk
