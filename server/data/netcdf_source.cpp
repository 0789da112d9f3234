// Puts together what the cf_* files find out, and reads one field at one step: blocks of the file
// in its own order, unpacked and scattered into x-fastest volumes.
#include "server/data/netcdf_source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "server/base/check.hpp"
#include "server/data/cf_axes.hpp"
#include "server/data/cf_curvilinear.hpp"
#include "server/data/cf_fields.hpp"
#include "server/data/cf_grid.hpp"
#include "server/data/cf_packing.hpp"
#include "server/data/cf_text.hpp"
#include "server/data/cf_time.hpp"
#include "server/data/digest.hpp"
#include "server/data/netcdf_file.hpp"

namespace windsplat::data::netcdf {

namespace {

// Doubles read at a time: 32 MiB where whole chunks are wanted, otherwise 2 MiB.
constexpr std::size_t chunked_values = std::size_t{4} << 20;
constexpr std::size_t plain_values = std::size_t{1} << 18;
constexpr std::size_t axis_max = std::size_t{1} << 24;

// One dimension of a variable on its way into the volume.
struct Way {
  std::size_t first = 0;      // index in the file where reading starts
  std::size_t length = 1;     // how many indices are read
  std::ptrdiff_t stride = 0;  // floats between neighbours in the volume, negative if turned
};

// Unpacks a block (counts, last fastest) into the volume, starting at `out`.
void scatter(const cf::Packing& packing, const double* block, const std::vector<std::size_t>& count,
             const std::vector<Way>& ways, float* out) {
  const std::size_t rank = count.size();
  std::vector<std::size_t> index(rank, 0);
  const std::size_t row = count.back();
  const std::ptrdiff_t row_stride = ways.back().stride;
  for (;;) {
    std::ptrdiff_t offset = 0;
    for (std::size_t d = 0; d + 1 < rank; ++d) {
      offset += static_cast<std::ptrdiff_t>(index[d]) * ways[d].stride;
    }
    for (std::size_t i = 0; i < row; ++i) {
      out[offset + static_cast<std::ptrdiff_t>(i) * row_stride] = cf::unpack(packing, block[i]);
    }
    block += row;
    std::size_t d = rank - 1;
    for (; d > 0; --d) {  // an odometer over all but the last dimension
      if (++index[d - 1] < count[d - 1]) {
        break;
      }
      index[d - 1] = 0;
    }
    if (d == 0) {
      return;
    }
  }
}

// How much of each dimension a block spans: whole inner dimensions, some of one, single outer ones.
std::vector<std::size_t> block_counts(const std::vector<Way>& ways,
                                      const std::vector<std::size_t>& chunk) {
  const bool chunked = std::any_of(chunk.begin(), chunk.end(), [](auto n) { return n > 1; });
  const std::size_t block_values = chunked ? chunked_values : plain_values;
  std::vector<std::size_t> count(ways.size(), 1);
  std::size_t values = 1;
  for (std::size_t d = ways.size(); d-- > 0;) {
    const std::size_t fit = std::max<std::size_t>(1, block_values / values);
    count[d] = std::min(ways[d].length, fit);
    if (count[d] < ways[d].length) {
      // Whole chunks, so that none is decompressed twice.
      if (count[d] > chunk[d]) {
        count[d] -= count[d] % chunk[d];
      }
      break;
    }
    values *= count[d];
  }
  return count;
}

class NetcdfSource final : public Source {
 public:
  explicit NetcdfSource(std::unique_ptr<File> file) : file_(std::move(file)) {}

  Result<void> prepare() {
    roles_ = cf::classify_dimensions(file_->contents());
    auto choice = cf::choose_grid(file_->contents(), roles_);
    if (!choice) {
      return named(choice.error());
    }
    choice_ = std::move(*choice);
    info_.left_out = std::move(choice_.left_out);
    if (auto done = find_axes(); !done) {
      return named(done.error());
    }
    if (auto done = find_steps(); !done) {
      return named(done.error());
    }
    find_fields();
    if (info_.fields.empty()) {
      return named(make_error(ErrorKind::bad_data, "no field fits into the limit of 16 GiB"));
    }
    const std::filesystem::path name(file_->name());
    info_.id = name.stem().native();
    info_.source = name.native();
    info_.title = file_->contents().title.empty() ? info_.id : file_->contents().title;
    info_.format = file_->is_classic() ? "netCDF classic" : "netCDF-4";
    info_.digest = digest_of(file_->identity() + '\n' + WINDSPLAT_VERSION);
    return {};
  }

  [[nodiscard]] const DatasetInfo& info() const override { return info_; }

  Result<Volume> read(std::size_t field, std::size_t step) override {
    WINDSPLAT_CHECK(field < plans_.size() && step < info_.steps.size());
    const std::vector<int>& variables = plans_[field];
    Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(variables.size());
    volume.values.resize(volume.samples() * variables.size());
    for (std::size_t c = 0; c < variables.size(); ++c) {
      float* out = volume.values.data() + c * volume.samples();
      if (auto done = read_component(variables[c], step, out); !done) {
        return done.error();
      }
    }
    finish_volume(volume);
    return volume;
  }

 private:
  [[nodiscard]] Error named(Error error) const {
    error.message = cf::in_quotes(file_->name()) + ": " + error.message;
    return error;
  }

  [[nodiscard]] const FileDimension& dimension(int id) const {
    return file_->contents().dimensions.at(static_cast<std::size_t>(id));
  }

  // Unpacked values of a 0-D or 1-D variable.
  [[nodiscard]] Result<std::vector<double>> unpacked(int variable) const {
    auto values = file_->read_all(variable);
    if (values) {
      const cf::Packing packing = cf::packing_of(*file_, variable);
      for (double& value : *values) {
        value = cf::unpack_double(packing, value);
      }
    }
    return values;
  }

  Result<void> find_axes() {
    auto bearing = cf::find_bearing(*file_, roles_, choice_);
    if (!bearing) {
      return bearing.error();
    }
    for (std::size_t which = 0; which < 3; ++which) {
      if (choice_.space.at(which) < 0) {
        info_.grid.axes.at(which) = flat_axis(which);
        continue;
      }
      if (auto done = find_axis(which); !done) {
        return done;
      }
      if (which < 2 && bearing->is_curvilinear) {
        turned_.at(which) = bearing->turned.at(which);
      }
    }
    info_.grid.columns = std::move(bearing->columns);
    return {};
  }

  // The axis of a dimension that the data lack.
  [[nodiscard]] Axis flat_axis(std::size_t which) const {
    constexpr std::array<const char*, 3> known_names{"x", "y", "z"};
    Axis axis;
    axis.name = known_names.at(which);
    const bool over_globe = which == 2 && info_.grid.axes[0].kind == AxisKind::longitude;
    axis.kind = over_globe ? AxisKind::level : AxisKind::cartesian;
    axis.coordinates = {0};
    return axis;
  }

  Result<void> find_axis(std::size_t which) {
    const int id = choice_.space.at(which);
    const cf::DimensionRole& role = roles_.at(static_cast<std::size_t>(id));
    if (dimension(id).length > axis_max) {
      return make_error(ErrorKind::bad_data, "the dimension " + cf::in_quotes(dimension(id).name) +
                                                 " is longer than " + std::to_string(axis_max));
    }
    std::vector<double> coordinates;
    if (role.coordinate >= 0) {
      auto read = unpacked(role.coordinate);
      if (!read) {
        return read.error();
      }
      coordinates = std::move(*read);
    } else {
      info_.left_out.push_back(
          {dimension(id).name, "dimension without a coordinate variable: placed by index"});
    }
    auto oriented = cf::orient_axis(file_->contents(), role, id, static_cast<int>(which),
                                    std::move(coordinates), info_.grid.axes[0].kind);
    if (!oriented) {
      return oriented.error();
    }
    info_.grid.axes.at(which) = std::move(oriented->axis);
    turned_.at(which) = oriented->turned;
    return {};
  }

  Result<void> find_steps() {
    const auto& variables = file_->contents().variables;
    int coordinate = -1;
    std::size_t count = 1;
    if (choice_.time >= 0) {
      count = dimension(choice_.time).length;
      coordinate = roles_.at(static_cast<std::size_t>(choice_.time)).coordinate;
    } else {
      for (std::size_t v = 0; v < variables.size(); ++v) {
        if (variables[v].dims.empty() && variables[v].numeric &&
            (variables[v].standard_name == "time" || variables[v].name == "time")) {
          coordinate = static_cast<int>(v);
        }
      }
    }
    std::vector<double> values;
    if (coordinate >= 0) {
      auto read = unpacked(coordinate);
      if (!read) {
        return read.error();
      }
      values = std::move(*read);
    }
    const bool complete = !values.empty() && std::all_of(values.begin(), values.end(),
                                                         [](double v) { return std::isfinite(v); });
    if (complete) {
      const auto& variable = variables[static_cast<std::size_t>(coordinate)];
      auto decoded = cf::decode_time(values, variable.units, variable.calendar);
      info_.steps = std::move(decoded.steps);
      info_.time_units = variable.units;
      info_.time_calendar = variable.calendar;
      if (!decoded.reason.empty()) {
        info_.left_out.push_back({variable.name, "time is shown as a number: " + decoded.reason});
      }
      return {};
    }
    if (choice_.time >= 0) {
      info_.left_out.push_back({dimension(choice_.time).name,
                                coordinate >= 0 ? "time has missing values: steps are counted"
                                                : "dimension without a coordinate variable: steps "
                                                  "are counted"});
    }
    for (std::size_t i = 0; i < count; ++i) {
      info_.steps.push_back({static_cast<double>(i), std::to_string(i)});
    }
    return {};
  }

  void find_fields() {
    auto plans = cf::find_fields(file_->contents(), choice_.variables, info_.grid.axes[2].kind);
    for (cf::FieldPlan& plan : plans) {
      const std::size_t bytes = info_.grid.samples() * plan.variables.size() * sizeof(float);
      if (bytes > cf::volume_bytes_max) {
        info_.left_out.push_back({plan.info.name, "more than 16 GiB a step"});
        continue;
      }
      info_.fields.push_back(std::move(plan.info));
      plans_.push_back(std::move(plan.variables));
    }
  }

  // How each dimension of a variable is read, and where its index 0 lands in the volume.
  [[nodiscard]] std::vector<Way> ways_of(int variable, std::size_t step,
                                         std::ptrdiff_t& origin) const {
    const auto dims = info_.grid.dims();
    const std::array<std::ptrdiff_t, 3> strides{1, dims[0],
                                                static_cast<std::ptrdiff_t>(dims[0]) * dims[1]};
    std::vector<Way> ways;
    origin = 0;
    for (const int id : file_->contents().variables[static_cast<std::size_t>(variable)].dims) {
      Way way;
      const auto* at = std::find(choice_.space.begin(), choice_.space.end(), id);
      if (at != choice_.space.end()) {
        const auto axis = static_cast<std::size_t>(at - choice_.space.begin());
        way.length = dimension(id).length;
        way.stride = strides.at(axis);
        if (turned_.at(axis)) {
          origin += static_cast<std::ptrdiff_t>(way.length - 1) * way.stride;
          way.stride = -way.stride;
        }
      } else if (id == choice_.time) {
        way.first = step;
      }
      ways.push_back(way);
    }
    return ways;
  }

  Result<void> read_component(int variable, std::size_t step, float* out) {
    std::ptrdiff_t origin = 0;
    const std::vector<Way> ways = ways_of(variable, step, origin);
    const std::size_t rank = ways.size();
    const std::vector<std::size_t> chunk = file_->chunk(variable);
    const std::vector<std::size_t> block = block_counts(ways, chunk);
    const cf::Packing packing = cf::packing_of(*file_, variable);
    std::size_t values = 1;
    for (const std::size_t n : block) {
      values *= n;
    }
    std::vector<double> buffer(values);
    std::vector<std::size_t> index(rank, 0);  // of the block's corner, from each way's first
    for (;;) {
      std::vector<std::size_t> start(rank);
      std::vector<std::size_t> count(rank);
      std::ptrdiff_t corner = origin;
      for (std::size_t d = 0; d < rank; ++d) {
        start[d] = ways[d].first + index[d];
        count[d] = std::min(block[d], ways[d].length - index[d]);
        corner += static_cast<std::ptrdiff_t>(index[d]) * ways[d].stride;
      }
      if (auto done = file_->read(variable, start, count, buffer.data()); !done) {
        return done;
      }
      scatter(packing, buffer.data(), count, ways, out + corner);
      std::size_t d = rank;
      for (; d > 0; --d) {
        index[d - 1] += block[d - 1];
        if (index[d - 1] < ways[d - 1].length) {
          break;
        }
        index[d - 1] = 0;
      }
      if (d == 0) {
        if (!hold_other_steps(variable, chunk)) file_->forget_chunks(variable);
        return {};
      }
    }
  }

  // The next step may then find what this one decompressed.
  [[nodiscard]] bool hold_other_steps(int variable, const std::vector<std::size_t>& chunk) const {
    const auto& dims = file_->contents().variables[static_cast<std::size_t>(variable)].dims;
    const auto time = std::find(dims.begin(), dims.end(), choice_.time);
    return time != dims.end() && chunk[static_cast<std::size_t>(time - dims.begin())] > 1;
  }

  std::unique_ptr<File> file_;
  std::vector<cf::DimensionRole> roles_;
  cf::GridChoice choice_;
  std::array<bool, 3> turned_{false, false, false};
  DatasetInfo info_;
  std::vector<std::vector<int>> plans_;  // a field's variables, parallel to info_.fields
};

}  // namespace

Result<std::unique_ptr<Source>> open_source(const std::string& path) {
  auto file = File::open(path);
  if (!file) {
    return file.error();
  }
  auto source = std::make_unique<NetcdfSource>(std::move(*file));
  if (auto done = source->prepare(); !done) {
    return done.error();
  }
  return std::unique_ptr<Source>(std::move(source));
}

}  // namespace windsplat::data::netcdf
