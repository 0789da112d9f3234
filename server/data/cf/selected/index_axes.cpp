// Finds the coordinates by their values, then hides them.
#include "server/data/cf/selected/index_axes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/curvilinear.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::size_t entries_read = 100'000;  // a longer dimension is no row of a tile
constexpr std::size_t pole = 90;               // degrees

// The same file with other contents.
class RelabelledFile final : public ArrayFile {
 public:
  RelabelledFile(std::unique_ptr<ArrayFile> base, FileContents contents)
      : base_(std::move(base)), contents_(std::move(contents)) {
    if (const auto bytes = base_->stored_bytes()) set_stored_bytes(*bytes);
  }

  [[nodiscard]] const FileContents& contents() const override { return contents_; }
  [[nodiscard]] const std::string& name() const override { return base_->name(); }
  [[nodiscard]] std::string origin() const override { return base_->origin(); }
  [[nodiscard]] std::string format() const override { return base_->format(); }
  [[nodiscard]] std::string identity() const override { return base_->identity(); }
  [[nodiscard]] Numbers numbers(int variable, const char* attribute) const override {
    return base_->numbers(variable, attribute);
  }
  [[nodiscard]] std::string text_of(int variable, const char* attribute) const override {
    return base_->text_of(variable, attribute);
  }
  [[nodiscard]] std::vector<std::size_t> chunk(int variable) const override {
    return base_->chunk(variable);
  }
  [[nodiscard]] std::size_t chunk_cost_bytes(int variable) const override {
    return base_->chunk_cost_bytes(variable);
  }
  [[nodiscard]] Unwritten unwritten(int variable, std::size_t most) const override {
    return base_->unwritten(variable, most);
  }
  void forget_chunks(int variable) const override { base_->forget_chunks(variable); }
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override {
    return base_->read(variable, start, count, out);
  }
  Result<void> read(int variable, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override {
    return base_->read(variable, start, count, out);
  }

 private:
  std::unique_ptr<ArrayFile> base_;
  FileContents contents_;
};

bool is_name_of_fv3(std::string_view name) {
  constexpr auto known =
      std::to_array<std::string_view>({"grid_xt", "grid_yt", "grid_x", "grid_y"});
  return is_one_of(name, known);
}

// Whether something else than the values says that columns x and rows y are counted.
bool are_indices(const FileContents& contents, int x, int y) {
  const bool beyond_pole = contents.dimensions[at(y)].length > pole;
  const bool placed =
      position_on(contents, x, y, true) >= 0 && position_on(contents, x, y, false) >= 0;
  return beyond_pole || placed ||
         (is_name_of_fv3(contents.dimensions[at(x)].name) &&
          is_name_of_fv3(contents.dimensions[at(y)].name));
}

class IndexAxes {
 public:
  explicit IndexAxes(const ArrayFile& file)
      : file_(file),
        roles_(classify_dimensions(file.contents())),
        counted_(file.contents().dimensions.size()) {}

  // The longitudes and latitudes that count the columns and rows of a variable; -1 if they do not.
  std::array<int, 2> of(const FileVariable& variable) {
    const int x = along(variable, AxisKind::longitude);
    const int y = along(variable, AxisKind::latitude);
    const bool may_count = variable.dims.size() > 1 && x >= 0 && y >= 0;
    if (!may_count || !are_indices(file_.contents(), x, y)) return {-1, -1};
    if (!is_counted(y) || !is_counted(x)) return {-1, -1};
    return {roles_[at(x)].coordinate, roles_[at(y)].coordinate};
  }

 private:
  [[nodiscard]] int along(const FileVariable& variable, AxisKind kind) const {
    const auto found = std::find_if(variable.dims.begin(), variable.dims.end(), [&](int d) {
      return roles_[at(d)].coordinate >= 0 && roles_[at(d)].kind == kind;
    });
    return found == variable.dims.end() ? -1 : *found;
  }

  // Whether the coordinate is 1, 2, ... N. One that cannot be read is reported where it is used.
  bool is_counted(int dimension) {
    const std::size_t length = file_.contents().dimensions[at(dimension)].length;
    std::optional<bool>& known = counted_[at(dimension)];
    if (known) return *known;
    known = false;
    if (length < 2 || length > entries_read) return false;
    const auto values = unpacked_values(file_, roles_[at(dimension)].coordinate);
    if (!values) return false;
    for (std::size_t n = 0; n < length; ++n) {
      if ((*values)[n] != static_cast<double>(n + 1)) return false;
    }
    known = true;
    return true;
  }

  const ArrayFile& file_;
  std::vector<DimensionRole> roles_;
  std::vector<std::optional<bool>> counted_;  // per dimension, if its coordinate was read
};

}  // namespace

std::unique_ptr<ArrayFile> without_index_axes(std::unique_ptr<ArrayFile> file) {
  IndexAxes axes(*file);
  FileContents contents = file->contents();
  bool found = false;
  for (const FileVariable& variable : file->contents().variables) {
    const std::array<int, 2> counted = axes.of(variable);
    std::string names;
    for (const int v : counted) {
      if (v < 0 || !contents.variables[at(v)].numeric) continue;
      FileVariable& one = contents.variables[at(v)];
      one.numeric = false;
      one.unread = "its values count the cells, although its unit is " + in_quotes(one.units);
      names += (names.empty() ? "" : " and ") + in_quotes(one.name);
    }
    if (names.empty()) continue;
    found = true;
    contents.notes.push_back(names +
                             " only count columns and rows, in units of degrees: they are taken "
                             "for indices; 2-D longitudes and latitudes, also of a joined file of "
                             "the grid, place the columns");
  }
  if (!found) return file;
  return std::make_unique<RelabelledFile>(std::move(file), std::move(contents));
}

}  // namespace windsplat::data::cf
