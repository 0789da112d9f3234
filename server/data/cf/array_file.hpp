// Named arrays of numbers with dimensions and attributes: what netCDF, Zarr, GRIB, GrADS, NRRD, ...
// have in common. A reader of such a format implements this; source.hpp makes a dataset of it.
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

// An index into a file's dimensions or variables as one of a vector; not for -1.
inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

// The index of the variable of that name, -1 if there is none.
int variable_named(const FileContents& contents, std::string_view name);

// A numeric attribute, as doubles.
struct Numbers {
  std::vector<double> values;  // empty if the attribute is absent or text
  bool floating = false;       // stored as float or double
};

// Chunks of a variable that were never written: read() gives NaN for them.
struct Unwritten {
  std::size_t chunks = 0;
  std::size_t looked_at = 0;  // chunks that were looked for, from the first; what has none is one
  bool is_all = true;         // whether all chunks were examined
};

class ArrayFile {
 public:
  virtual ~ArrayFile() = default;

  [[nodiscard]] virtual const FileContents& contents() const = 0;
  [[nodiscard]] virtual const std::string& name() const = 0;  // without its folder, for messages
  // The source's name in messages, where it differs from name().
  [[nodiscard]] virtual std::string origin() const { return name(); }
  [[nodiscard]] virtual std::string format() const = 0;  // "netCDF-4", "Zarr v2", ...
  // Differs whenever the numbers may: names, sizes and times of change; not where files lie.
  [[nodiscard]] virtual std::string identity() const = 0;

  // Attributes that the reader does not put into FileVariable: _FillValue, missing_value,
  // valid_min, valid_max, valid_range, scale_factor, add_offset, those of a grid mapping.
  [[nodiscard]] virtual Numbers numbers(int variable, const char* attribute) const = 0;
  // A text attribute, trimmed; empty if it is absent.
  [[nodiscard]] virtual std::string text_of(int variable, const char* attribute) const = 0;
  // Preferred read size along each dimension; 1 where it does not matter.
  [[nodiscard]] virtual std::vector<std::size_t> chunk(int variable) const = 0;

  // Where chunk() is how it is stored: what each chunk costs at least, in decoded bytes.
  [[nodiscard]] virtual std::size_t chunk_cost_bytes(int /*variable*/) const { return 0; }

  // Reads a block of a numeric variable as stored. start, count: one a dimension, slowest first;
  // `out` holds the product of the counts, the last dimension fastest. Errors: bad_data, also where
  // a file changed since it was opened.
  virtual Result<void> read(int variable, const std::vector<std::size_t>& start,
                            const std::vector<std::size_t>& count, double* out) const = 0;
  // The same of a variable of type float32, without a detour.
  virtual Result<void> read(int variable, const std::vector<std::size_t>& start,
                            const std::vector<std::size_t>& count, float* out) const = 0;
  // Looks for at most `most` chunks of a variable, without reading them.
  [[nodiscard]] virtual Unwritten unwritten(int /*variable*/, std::size_t /*most*/) const {
    return {};
  }
  // Frees what the reader caches for a variable between reads.
  virtual void forget_chunks(int /*variable*/) const {}

  // Reads a whole small variable; call charge() first.
  [[nodiscard]] Result<std::vector<double>> read_all(int variable) const;

  // How large the files are, which bounds what charge() grants. Until then there is no bound.
  void set_stored_bytes(std::uint64_t bytes) { stored_bytes_ = bytes; }
  [[nodiscard]] std::optional<std::uint64_t> stored_bytes() const { return stored_bytes_; }
  // Before a variable is decoded to open the dataset, so many bytes of it; each variable is charged
  // once. Errors: bad_data beyond voluntary_bytes_max(); nothing is charged then.
  [[nodiscard]] Result<void> charge(int variable, double bytes) const;

 private:
  std::optional<std::uint64_t> stored_bytes_;
  mutable double charged_bytes_ = 0;
  mutable std::set<int> charged_;
};

// Bytes that reading a block decodes: whole chunks, as they are stored, each as
// chunk_cost_bytes() at least.
double decoded_bytes(const ArrayFile& file, int variable, const std::vector<std::size_t>& start,
                     const std::vector<std::size_t>& count);
// The same of one chunk; of what has none a single value.
double chunk_bytes(const ArrayFile& file, int variable);

}  // namespace windsplat::data::cf
