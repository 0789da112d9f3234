// Arrays stored in bytes with constant strides: the common representation of NRRD, GrADS, OpenDX
// and raw files. Their readers fill a PlacedFile, which cf/source.hpp converts to a dataset.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/data/bytes/byte_store.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/cf/array_file.hpp"

namespace windsplat::data::bytes {

// Half-open range of the indices of a dimension for which numbers are stored.
struct Stored {
  std::size_t begin = 0;
  std::size_t end = 0;
};

// Location of the numbers of a variable. Variables may share a store.
struct Placement {
  std::shared_ptr<ByteStore> store;
  std::uint64_t offset = 0;  // offset of the number at the first stored indices
  Scalar type = Scalar::float32;
  bool big_endian = false;
  std::vector<std::uint64_t> strides;           // bytes between neighbours, one per dimension
  std::vector<Stored> present;                  // one per dimension; the rest is masked
  bool negated = false;                         // components of vectors along reversed axes
  std::optional<std::array<double, 2>> masked;  // range of stored numbers that are negated, from
                                                // the first to the second
};

// Attributes of a coordinate.
struct AxisLabel {
  std::string units;
  std::string axis;      // "X", "Y", "Z", "T" or empty: by name and units
  std::string positive;  // "up", "down" or empty
  std::string calendar;
};

class PlacedFile final : public cf::ArrayFile {
 public:
  PlacedFile(std::string name, std::string format)
      : name_(std::move(name)), format_(std::move(format)) {}

  void set_title(std::string title) { contents_.title = std::move(title); }
  void add_note(std::string note) { contents_.notes.push_back(std::move(note)); }
  void add_identity(const std::string& identity) { identity_ += identity + '\n'; }
  int add_dimension(std::string name, std::size_t length);
  // Adds the coordinates of a dimension, one per index.
  void add_axis(int dimension, const AxisLabel& label, std::vector<double> coordinates);
  // Adds the numbers of a field; the type is that of the placement. `missing`: stored numbers.
  void add_array(FileVariable variable, Placement placement, std::vector<double> missing);

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string format() const override { return format_; }
  [[nodiscard]] std::string identity() const override { return identity_; }
  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;

 private:
  struct Entry {
    std::vector<double> values;  // values of a coordinate
    std::optional<Placement> placement;
    std::vector<double> missing;
  };
  template <class T>
  Result<void> read_any(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, T* out) const;
  template <class T>
  Result<void> read_run(const Placement& placement, std::uint64_t offset, std::uint64_t stride,
                        std::size_t count, T* out) const;

  std::string name_;
  std::string format_;
  std::string identity_;
  FileContents contents_;
  std::vector<Entry> entries_;  // one per variable
};

}  // namespace windsplat::data::bytes
