// Named arrays of numbers with dimensions and attributes: the common interface of readers of
// netCDF, Zarr, GRIB, GrADS, NRRD, ...; source.hpp converts it to a dataset.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/contents.hpp"

namespace windsplat::data::cf {

// Converts a non-negative index of a dimension or variable.
inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

// The index of the variable of that name, -1 if there is none.
int variable_named(const FileContents& contents, std::string_view name);

// The index of the dimension of that name, -1 if there is none.
int dimension_named(const FileContents& contents, std::string_view name);

// A numeric attribute, as doubles.
struct Numbers {
  std::vector<double> values;  // empty if the attribute is absent or text
  bool floating = false;       // stored as float or double
};

// Chunks of a variable that were never written: read() gives NaN for them.
struct Unwritten {
  std::size_t chunks = 0;
  std::size_t looked_at =
      0;               // chunks examined, from the first; an unchunked variable counts as one
  bool is_all = true;  // whether all chunks were examined
};

// A block of a variable. start, count: one per dimension, slowest first.
struct Block {
  int variable = 0;
  std::vector<std::size_t> start;
  std::vector<std::size_t> count;
};

class ArrayFile {
 public:
  virtual ~ArrayFile() = default;

  [[nodiscard]] virtual const FileContents& contents() const = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;  // without its folder, for messages
  // The source's name in messages, where it differs from name().
  [[nodiscard]] virtual std::string origin() const { return name(); }
  [[nodiscard]] virtual std::string format() const = 0;  // "netCDF-4", "Zarr v2", ...
  // Changes if the data may have changed: names, sizes and modification times, without folders.
  [[nodiscard]] virtual std::string identity() const = 0;

  // Attributes that are not in FileVariable: _FillValue, missing_value, valid_min, valid_max,
  // valid_range, scale_factor, add_offset and those of grid mappings.
  [[nodiscard]] virtual Numbers numbers(int variable, const char* attribute) const = 0;
  // A text attribute, trimmed; empty if it is absent.
  [[nodiscard]] virtual std::string text_of(int variable, const char* attribute) const = 0;
  // Preferred read size along each dimension; 1: any.
  [[nodiscard]] virtual std::vector<std::size_t> chunk(int variable) const = 0;

  // If the variable is stored in chunks of this size: the least cost of a chunk, in decoded bytes.
  [[nodiscard]] virtual std::size_t chunk_cost_bytes(int /*variable*/) const { return 0; }

  // Reads a block of a numeric variable as stored. start, count: one per dimension, slowest first.
  // `out` holds the product of the counts, last dimension fastest. Errors: bad_data, including a
  // file that changed since it was opened.
  virtual Result<void> read(int variable, const std::vector<std::size_t>& start,
                            const std::vector<std::size_t>& count, double* out) const = 0;
  // The same for a variable of type float32, without conversion.
  virtual Result<void> read(int variable, const std::vector<std::size_t>& start,
                            const std::vector<std::size_t>& count, float* out) const = 0;
  // A hint of what is read next, in this order and perhaps in smaller blocks; replaces the last
  // one.
  virtual void expect(const std::vector<Block>& /*blocks*/) const {}
  // Checks which chunks of a variable were written, for at most `most` chunks, without reading
  // them.
  [[nodiscard]] virtual Unwritten unwritten(int /*variable*/, std::size_t /*most*/) const {
    return {};
  }
  // Frees what the reader caches for a variable between reads.
  virtual void forget_chunks(int /*variable*/) const {}

  // Reads a whole small variable; call charge() first.
  [[nodiscard]] Result<std::vector<double>> read_all(int variable) const;

  // Total size of the files, which limits charge(). No limit until set.
  void set_stored_bytes(std::uint64_t bytes) { stored_bytes_ = bytes; }
  [[nodiscard]] std::optional<std::uint64_t> stored_bytes() const { return stored_bytes_; }
  // Call before decoding `bytes` of a variable to open the dataset. Each variable is charged once.
  // Errors: bad_data beyond voluntary_bytes_max(), without charging.
  [[nodiscard]] Result<void> charge(int variable, double bytes) const;

 private:
  std::optional<std::uint64_t> stored_bytes_;
  mutable double charged_bytes_ = 0;
  mutable std::set<int> charged_;
};

// Which of the variables have chunks that were never written, as a note; empty: none is known.
std::string unwritten_note(const ArrayFile& file, const std::vector<int>& variables);

// Bytes decoded to read a block, in whole chunks of at least chunk_cost_bytes() each.
double decoded_bytes(const ArrayFile& file, int variable, const std::vector<std::size_t>& start,
                     const std::vector<std::size_t>& count);
// The same for one chunk; for unchunked variables, for one value.
double chunk_bytes(const ArrayFile& file, int variable);

}  // namespace windsplat::data::cf
