// One array of a VTK file: location and encoding of its values, and a sequential reader. InputFile
// -> bytes -> blocks -> doubles.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::vtk {

enum class Encoding { text, base64, raw, hdf5 };
enum class Compressor { none, zlib, lz4 };

// Encoding of binary arrays in a file.
struct Coding {
  bool big_endian = false;
  bool has_header = true;  // XML formats: a byte count or a table of blocks precedes the data
  int header_bytes = 4;    // width of its numbers: 4 or 8
  Compressor compressor = Compressor::none;
};

class HdfFile;

// A part of a dataset of an HDF5 file, with as many items along its dimensions.
struct HdfPart {
  std::shared_ptr<HdfFile> file;
  std::string path;
  std::vector<std::uint64_t> start;
  std::vector<std::uint64_t> count;
  std::uint64_t chunk = 1;  // length of a chunk along `along`
  std::size_t along = 0;    // the first dimension of which more than one item is read
};

struct StoredArray {
  std::string name;
  bytes::Scalar type = bytes::Scalar::float32;
  int components = 1;
  std::vector<std::string> component_names;  // empty, or one per component
  std::uint64_t tuples = 0;
  Encoding encoding = Encoding::text;
  Coding coding;
  std::uint64_t offset = 0;            // in the file
  std::uint64_t room = 0;              // bytes of the file available to the array
  std::shared_ptr<const HdfPart> hdf;  // for Encoding::hdf5, in place of what is above

  [[nodiscard]] std::uint64_t values() const {
    return tuples * static_cast<std::uint64_t>(components);
  }
};

// The values of an array in the order of the file.
class ArrayStream {
 public:
  virtual ~ArrayStream() = default;
  // The next `count` values, which must exist. Errors: bad_data.
  virtual Result<void> read(double* out, std::size_t count) = 0;
  // The same, rounded to float.
  virtual Result<void> read(float* out, std::size_t count);
};
std::unique_ptr<ArrayStream> hdf_stream(const StoredArray& array);

// Reads values in the order of the file. Not thread-safe.
class ArrayReader {
 public:
  // Checks the size of the array against the file. Errors: bad_data.
  static Result<ArrayReader> open(std::shared_ptr<const InputFile> file, const StoredArray& array);
  // Reads the next `count` values, which must exist. Errors: bad_data.
  Result<void> read(double* out, std::size_t count) { return stream_->read(out, count); }
  Result<void> read(float* out, std::size_t count) { return stream_->read(out, count); }

 private:
  explicit ArrayReader(std::unique_ptr<ArrayStream> stream) : stream_(std::move(stream)) {}
  std::unique_ptr<ArrayStream> stream_;
};

// Reads all values; the size must have been checked before. Errors: bad_data.
Result<std::vector<double>> read_all(const std::shared_ptr<const InputFile>& file,
                                     const StoredArray& array);

}  // namespace windsplat::data::vtk
