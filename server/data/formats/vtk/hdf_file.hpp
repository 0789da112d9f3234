// VTKHDF: an HDF5 file with the group /VTKHDF, its attributes, and parts of its datasets as arrays
// (hdf_file.cpp); its grids as snapshots (vtkhdf.cpp).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/netcdf/hdf5_storage.hpp"
#include "server/data/formats/vtk/stored_array.hpp"
#include "server/data/formats/vtk/unite.hpp"

namespace windsplat::data::vtk {

class HdfFile : public std::enable_shared_from_this<HdfFile> {
 public:
  // Whether the file is HDF5 and has the group. Does not follow links.
  static bool is_vtkhdf(const InputFile& input);
  // The same; nullopt if the file is no HDF5 file that can be opened.
  static std::optional<bool> has_vtkhdf(const InputFile& input);
  // Examines the file like any HDF5 file (see netcdf::scan_storage()). Errors: bad_data.
  static Result<std::shared_ptr<HdfFile>> open(std::shared_ptr<const InputFile> input);
  ~HdfFile();
  HdfFile(const HdfFile&) = delete;
  HdfFile& operator=(const HdfFile&) = delete;

  [[nodiscard]] const std::shared_ptr<const InputFile>& input() const { return input_; }
  // Lengths along the dimensions of a dataset; empty if there is none of this path.
  [[nodiscard]] std::vector<std::uint64_t> lengths(const std::string& path) const;
  // Names of the datasets, and of the groups, directly within a group.
  [[nodiscard]] std::vector<std::string> datasets_in(const std::string& group) const;
  [[nodiscard]] std::vector<std::string> groups_in(const std::string& group) const;

  [[nodiscard]] bool has_attribute(const std::string& group, const char* name) const;
  // Attributes of a group; nullopt if absent, or not of this kind. Texts have at most 64 bytes.
  [[nodiscard]] std::optional<std::string> text(const std::string& group, const char* name) const;
  [[nodiscard]] std::optional<std::vector<double>> numbers(const std::string& group,
                                                           const char* name,
                                                           std::size_t count) const;

  // The part of a dataset from `start` on, with `count` items along each dimension, of which the
  // last ones are components. Errors: bad_data if it lies outside the dataset, the dataset cannot
  // be read or is larger than the file can hold, or is not of numbers.
  Result<StoredArray> array(const std::string& path, std::vector<std::uint64_t> start,
                            std::vector<std::uint64_t> count, int components);
  // `count` numbers of a dataset of one dimension, or of the first column of one of two, from
  // `start` on. Errors: as array(), and for more than 1,048,576.
  Result<std::vector<double>> values(const std::string& path, std::uint64_t start,
                                     std::uint64_t count);

  // Reads a block as numbers; unwritten parts are NaN. Out: double, or float for the type float32.
  // Errors: bad_data.
  template <class Out>
  Result<void> read(const HdfPart& part, bytes::Scalar type, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, Out* out);

 private:
  explicit HdfFile(std::shared_ptr<const InputFile> input) : input_(std::move(input)) {}

  std::shared_ptr<const InputFile> input_;
  netcdf::Handle file_;
  std::map<std::string, netcdf::DatasetStorage> storage_;
  std::map<std::string, netcdf::AbsentChunks> absent_;  // by path
};

// The times of the steps of a file; one step without a time if it has none. Errors: bad_data.
Result<std::vector<std::optional<double>>> times_of(HdfFile& file);

// Whether the file has blocks (PartitionedDataSetCollection, MultiBlockDataSet).
bool has_blocks(const HdfFile& file);
// The grids of a step: of a file with blocks those named `inside`, or all if it is empty. Errors:
// bad_data; not_found for an unknown block.
Result<std::vector<Block>> read_hdf(HdfFile& file, std::size_t step, const std::string& inside);

}  // namespace windsplat::data::vtk
