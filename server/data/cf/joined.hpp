// Files of one dataset with different variables (CMIP's ua, va, wap; NEMO's grid_T, grid_U, grid_V)
// -> one ArrayFile on their common dimensions.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/axes.hpp"

namespace windsplat::data::cf {

class JoinedFile final : public ArrayFile {
 public:
  // parts: one or more files or series; the first one's names are kept. Dimensions are common if
  // they have the same coordinates, whatever their names, or the same name and length and no
  // coordinates. Where 2-D longitudes and latitudes of two parts lie half a cell apart, the later
  // part is on faces (FileDimension::centers). Errors: bad_data, naming the part, if its times or
  // positions do not fit, or a variable of the same name is on a horizontal grid of another UUID.
  static Result<std::unique_ptr<JoinedFile>> open(std::string name, std::string origin,
                                                  std::vector<std::unique_ptr<ArrayFile>> parts);

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::string origin() const override { return origin_; }
  [[nodiscard]] std::string format() const override { return parts_.front()->format(); }
  [[nodiscard]] std::string identity() const override;

  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override;
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override;
  void forget_chunks(int variable) const override;

  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;

 private:
  struct Place {
    const ArrayFile* part = nullptr;
    int variable = -1;
  };

  JoinedFile(std::string name, std::string origin)
      : name_(std::move(name)), origin_(std::move(origin)) {}
  Result<void> add(const ArrayFile& part);
  Result<int> dimension_of(const ArrayFile& part, int dimension, const DimensionRole& role,
                           const std::vector<DimensionRole>& known);
  Result<void> place_faces(const ArrayFile& part, std::vector<int>& dimensions);
  Result<void> add_variable(const ArrayFile& part, int variable,
                            const std::vector<int>& dimensions);
  void merge_lists(FileDimension& own, const FileDimension& added);
  [[nodiscard]] const Place& place_of(int variable) const { return places_.at(at(variable)); }

  std::string name_;
  std::string origin_;
  std::vector<std::unique_ptr<ArrayFile>> parts_;
  FileContents contents_;
  std::vector<Place> places_;  // parallel to contents_.variables
};

}  // namespace windsplat::data::cf
