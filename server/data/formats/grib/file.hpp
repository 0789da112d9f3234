// The fields of a GRIB file combined into arrays over member, time, level, row and column.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/array_file.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/grib/fields.hpp"
#include "server/data/formats/grib/groups.hpp"
#include "server/data/formats/grib/index.hpp"

namespace windsplat::data::grib {

class File final : public cf::ArrayFile {
 public:
  static Result<std::unique_ptr<cf::ArrayFile>> open(std::shared_ptr<const InputFile> input);

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return input_->name(); }
  [[nodiscard]] std::string format() const override { return format_; }
  [[nodiscard]] std::string identity() const override { return input_->identity(); }
  [[nodiscard]] cf::Numbers numbers(int variable, const char* attribute) const override;
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override;
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override;
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override;
  void forget_chunks(int variable) const override;

 private:
  // Content of a variable: numbers, the fields of a group, or the mapping of a grid.
  struct Content {
    std::vector<double> numbers;
    int group = -1;
    std::vector<AxisIndex> axes;  // of a group: those of its dimensions before rows and columns
    int mapped_grid = -1;
    bool is_logarithm = false;  // of a group: its values are logarithms of those of the variable
    std::string formula;        // of a coordinate: its formula_terms
  };

  explicit File(std::shared_ptr<const InputFile> input) : input_(std::move(input)) {}
  Result<void> scan();
  // message: may be empty if its header is that of an earlier one apart from times.
  Result<void> add_message(std::size_t field, const std::vector<unsigned char>& message,
                           const Header& header);
  Result<std::size_t> grid_of(const std::vector<unsigned char>& message, const std::string& key);
  Result<void> add_variables();
  [[nodiscard]] Result<void> check_any_field() const;
  std::vector<int> grid_dimensions(std::size_t grid);
  std::vector<int> add_axes(std::size_t grid);
  std::vector<int> add_plane(std::size_t grid);
  std::vector<int> add_list(std::size_t grid);
  void fix_constants();
  void find_faces_of_layers();
  void add_mapping(std::size_t grid);
  int axis(const std::string& name, const std::vector<double>& values, const FileVariable& like);
  int group_axis(const Group& group, AxisIndex axis_index);
  std::string free_name(const Group& group) const;
  void name_field(const Group& group, FileVariable& variable);
  void add_field(std::size_t group);
  Result<void> add_hybrid_levels();
  Result<std::vector<double>> coefficients_of(const Group& group) const;
  int surface_pressure(std::size_t grid);
  template <class Out>
  Result<void> read_block(int variable, const std::vector<std::size_t>& start,
                          const std::vector<std::size_t>& count, Out* out) const;
  Result<const std::vector<float>*> values_of(std::size_t field, const Grid& grid) const;

  std::shared_ptr<const InputFile> input_;
  std::string format_;
  std::vector<FieldPlace> places_;
  std::vector<Grid> grids_;
  std::map<std::string, std::size_t>
      grid_keys_;  // keyed by the bytes of the grid definition; several keys may describe one grid
  std::vector<Group> groups_;
  std::map<std::string, std::size_t> group_keys_;
  bool by_lead_time_ = false;  // times of groups are hours after their reference time
  std::map<std::size_t, std::vector<int>> grid_dims_;
  std::vector<Content> held_;  // parallel to the variables
  FileContents contents_;

  mutable std::mutex mutex_;  // guards the last decoded field
  mutable std::size_t last_field_ = 0;
  mutable std::vector<float> last_values_;
};

}  // namespace windsplat::data::grib
