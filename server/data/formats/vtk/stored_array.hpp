// One array of a VTK file: location and encoding of its values, and a sequential reader. InputFile
// -> bytes -> blocks -> doubles.
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

// Encoding of binary arrays in a file.
struct Coding {
  bool big_endian = false;
  bool has_header = true;  // XML formats: a byte count or a table of blocks precedes the data
  int header_bytes = 4;    // width of its numbers: 4 or 8
  Compressor compressor = Compressor::none;
};

struct StoredArray {
  std::string name;
  bytes::Scalar type = bytes::Scalar::float32;
  int components = 1;
  std::vector<std::string> component_names;  // empty, or one per component
  std::uint64_t tuples = 0;
  Encoding encoding = Encoding::text;
  Coding coding;
  std::uint64_t offset = 0;  // in the file
  std::uint64_t room = 0;    // bytes of the file available to the array

  [[nodiscard]] std::uint64_t values() const {
    return tuples * static_cast<std::uint64_t>(components);
  }
};

// Reads values in the order of the file. Not thread-safe.
class ArrayReader {
 public:
  // Checks the size of the array against the file. Errors: bad_data.
  static Result<ArrayReader> open(std::shared_ptr<const InputFile> file, const StoredArray& array);
  ArrayReader(ArrayReader&&) noexcept;
  ArrayReader& operator=(ArrayReader&&) noexcept;
  ~ArrayReader();

  // Reads the next `count` values, which must exist. Errors: bad_data.
  Result<void> read(double* out, std::size_t count);

 private:
  class Stream;
  explicit ArrayReader(std::unique_ptr<Stream> stream);
  std::unique_ptr<Stream> stream_;
};

// Reads all values; the size must have been checked before. Errors: bad_data.
Result<std::vector<double>> read_all(const std::shared_ptr<const InputFile>& file,
                                     const StoredArray& array);

}  // namespace windsplat::data::vtk
