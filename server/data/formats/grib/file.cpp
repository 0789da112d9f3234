// Messages -> groups -> variables, which share dimensions with equal coordinates.
#include "server/data/formats/grib/file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "server/data/formats/grib/header_cache.hpp"
#include "server/data/formats/grib/levels.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/formats/grib/winds.hpp"

namespace windsplat::data::grib {

namespace {

constexpr const char* mapping_name = "map_projection";
constexpr std::size_t groups_max = 8192;
constexpr std::size_t grids_max = 256;

// Tolerates rounding: edition 1 stores thousandths of a degree, edition 2 millionths.
bool is_same(const Grid& a, const Grid& b) {
  using List = std::vector<double>;
  const auto close = [](const List& left, const List& right, double tolerance = 1e-3) {
    return std::equal(left.begin(), left.end(), right.begin(), right.end(),
                      [tolerance](double l, double r) { return std::abs(l - r) < tolerance; });
  };
  constexpr double tolerance_m = 100;  // about a thousandth of a degree
  return a.type == b.type && a.problem == b.problem && a.columns == b.columns && a.rows == b.rows &&
         a.row_lengths == b.row_lengths && a.uuid == b.uuid &&
         a.mapping.numbers == b.mapping.numbers && a.mapping.texts == b.mapping.texts &&
         close(a.longitude, b.longitude) && close(a.latitude, b.latitude) &&
         close(a.x, b.x, tolerance_m) && close(a.y, b.y, tolerance_m);
}

FileVariable latitude_axis(const char* standard_name) {
  FileVariable out;
  out.standard_name = standard_name;
  out.units = out.standard_name == "latitude" ? "degrees_north" : "degrees";
  return out;
}

FileVariable plane_axis(const char* standard_name) {
  FileVariable out;
  out.standard_name = standard_name;
  out.units = "m";
  return out;
}

FileVariable longitude_axis(const char* standard_name) {
  FileVariable out;
  out.standard_name = standard_name;
  out.units = out.standard_name == "longitude" ? "degrees_east" : "degrees";
  return out;
}

std::string name_on_grid(const char* name, std::size_t grid) {
  return grid == 0 ? name : name + ("_" + std::to_string(grid + 1));
}

}  // namespace

Result<std::unique_ptr<cf::ArrayFile>> open(std::shared_ptr<const InputFile> input) {
  return File::open(std::move(input));
}

Result<std::unique_ptr<cf::ArrayFile>> File::open(std::shared_ptr<const InputFile> input) {
  std::unique_ptr<File> file(new File(std::move(input)));
  if (auto done = file->scan(); !done) return done.error();
  if (auto done = file->add_variables(); !done) return done.error();
  if (auto fine = file->check_any_field(); !fine) return fine.error();
  return std::unique_ptr<cf::ArrayFile>(std::move(file));
}

Result<std::size_t> File::grid_of(const std::vector<unsigned char>& message,
                                  const std::string& key) {
  if (const auto known = grid_keys_.find(key); known != grid_keys_.end()) return known->second;
  if (grid_keys_.size() >= grids_max) {
    return input_->fault("has more than " + std::to_string(grids_max) + " grids");
  }
  auto grid = read_grid(message);
  if (!grid) return input_->fault("has a message that " + grid.error().message);
  const auto at = std::find_if(grids_.begin(), grids_.end(),
                               [&](const Grid& other) { return is_same(other, *grid); });
  const auto index = static_cast<std::size_t>(at - grids_.begin());
  if (at == grids_.end()) grids_.push_back(std::move(*grid));
  grid_keys_.emplace(key, index);
  return index;
}

Result<void> File::add_message(std::size_t field, const std::vector<unsigned char>& message,
                               const Header& header) {
  const auto grid = grid_of(message, header.grid_key);
  if (!grid) return grid.error();
  const std::string key = header.short_name + '\n' + header.level_type + '\n' + header.product.key +
                          '\n' + std::to_string(*grid);
  const auto [known, is_new] = group_keys_.emplace(key, groups_.size());
  if (is_new) {
    if (groups_.size() >= groups_max) {
      return input_->fault("has more than " + std::to_string(groups_max) + " variables");
    }
    auto names = read_names(message);
    if (!names) return input_->fault("has a message that " + names.error().message);
    groups_.push_back({header, std::move(*names), *grid, {}, 0, false, false, {}, {}});
  }
  Group& group = groups_[known->second];
  const Place place{header.member, header.reference, header.hours, header.level};
  if (!group.fields.emplace(place, field).second) ++group.repeated;
  return {};
}

Result<void> File::scan() {
  auto places = find_fields(*input_);
  if (!places) return places.error();
  places_ = std::move(*places);
  if (places_.empty()) return input_->fault("contains no GRIB fields");
  std::set<int> editions;
  std::map<std::string, std::size_t> unread;
  HeaderCache headers;
  for (std::size_t f = 0; f < places_.size(); ++f) {
    editions.insert(places_[f].edition);
    const auto head = read_head(*input_, places_[f]);
    if (!head) return head.error();
    if (const auto known = headers.find(places_[f].edition, *head)) {
      if (auto done = add_message(f, {}, *known); !done) return done;
      continue;
    }
    const auto message = read_message(*input_, places_[f]);
    if (!message) return message.error();
    const auto header = read_header(*message);
    if (!header) {
      ++unread[header.error().message];
      continue;
    }
    if (auto done = add_message(f, *message, *header); !done) return done;
    headers.remember(places_[f].edition, *head, *header);
  }
  for (const auto& [reason, count] : unread) {
    contents_.notes.push_back(std::to_string(count) + " messages left out: each " + reason);
  }
  format_ = editions.size() == 2 ? "GRIB 1 and 2" : "GRIB " + std::to_string(*editions.begin());
  return {};
}

// If no field can be read, returns the reason instead of a missing field.
Result<void> File::check_any_field() const {
  if (std::any_of(contents_.variables.begin(), contents_.variables.end(),
                  [](const FileVariable& one) { return one.numeric; })) {
    return {};
  }
  if (groups_.empty()) {
    return input_->fault("has no field that can be read" +
                         (contents_.notes.empty() ? std::string() : ": " + contents_.notes[0]));
  }
  const Group& group = groups_.front();
  return input_->fault("has no field that can be read: " + in_quotes(group.header.short_name) +
                       " is " + grids_[group.grid].problem);
}

Result<void> File::add_variables() {
  merge_heights(groups_);
  fix_constants();
  by_lead_time_ = tell_references(groups_);
  order(groups_);
  for (Group& group : groups_) omit_incomplete_members(group, contents_.notes);
  find_axes(groups_, contents_.notes);
  for (std::size_t g = 0; g < groups_.size(); ++g) add_field(g);
  find_faces_of_layers();
  return add_hybrid_levels();
}

// Returns the dimension with these coordinates, adding it if necessary.
int File::axis(const std::string& name, const std::vector<double>& values,
               const FileVariable& like) {
  std::string free = name;
  for (int n = 2;; ++n) {
    const auto at = std::find_if(contents_.variables.begin(), contents_.variables.end(),
                                 [&](const FileVariable& known) { return known.name == free; });
    if (at == contents_.variables.end()) break;
    const auto v = static_cast<std::size_t>(at - contents_.variables.begin());
    if (held_[v].group < 0 && held_[v].numbers == values && at->dims.size() == 1) {
      return at->dims[0];
    }
    free = name + "_" + std::to_string(n);
  }
  contents_.dimensions.push_back({.name = free, .length = values.size()});
  FileVariable variable = like;
  variable.name = free;
  variable.type = "float64";
  variable.numeric = true;
  variable.dims = {static_cast<int>(contents_.dimensions.size()) - 1};
  contents_.variables.push_back(std::move(variable));
  held_.push_back({values, -1, {}, -1, false, {}});
  return static_cast<int>(contents_.dimensions.size()) - 1;
}

// Latitude and longitude, or y and x of a map projection.
std::vector<int> File::grid_dimensions(std::size_t g) {
  if (const auto known = grid_dims_.find(g); known != grid_dims_.end()) return known->second;
  const Grid& grid = grids_[g];
  return grid_dims_[g] = grid.is_list ? add_list(g) : grid.projected ? add_plane(g) : add_axes(g);
}

std::vector<int> File::add_axes(std::size_t g) {
  const Grid& grid = grids_[g];
  const std::vector<std::size_t>& lengths = grid.row_lengths;
  if (!lengths.empty()) {
    contents_.notes.push_back("the rows of the reduced Gaussian grid have " +
                              std::to_string(*std::min_element(lengths.begin(), lengths.end())) +
                              " to " + std::to_string(grid.columns) +
                              " points: interpolated linearly along each row to " +
                              std::to_string(grid.columns) + " samples, vectors by components");
  }
  if (!grid.rotated) {
    return {axis("latitude", grid.latitude, latitude_axis("latitude")),
            axis("longitude", grid.longitude, longitude_axis("longitude"))};
  }
  add_mapping(g);
  return {axis(name_on_grid("rlat", g), grid.latitude, latitude_axis("grid_latitude")),
          axis(name_on_grid("rlon", g), grid.longitude, longitude_axis("grid_longitude"))};
}

void File::add_mapping(std::size_t g) {
  FileVariable mapping;
  mapping.name = name_on_grid(mapping_name, g);
  mapping.unread = "description of the map projection";
  contents_.variables.push_back(std::move(mapping));
  held_.push_back({});
  held_.back().mapped_grid = static_cast<int>(g);
}

std::vector<int> File::add_plane(std::size_t g) {
  add_mapping(g);
  return {axis(name_on_grid("y", g), grids_[g].y, plane_axis("projection_y_coordinate")),
          axis(name_on_grid("x", g), grids_[g].x, plane_axis("projection_x_coordinate"))};
}

// The dimension of one of the axes of a group.
int File::group_axis(const Group& group, AxisIndex axis_index) {
  FileVariable like;
  std::string name;
  if (axis_index == level_axis_index) {
    const std::string& type = group.header.level_type;
    return axis(type.empty() ? "level" : type, group.axes[axis_index], level_axis(type));
  }
  if (axis_index == member_axis) {
    name = "number";
    like.standard_name = "realization";
    like.units = "1";
  } else if (axis_index == time_axis && by_lead_time_) {
    name = "step";
    like.standard_name = "forecast_period";
    like.units = "hours";
  } else {
    like.standard_name = axis_index == time_axis ? "time" : "forecast_reference_time";
    name = like.standard_name;
    like.units = "hours since 1970-01-01 00:00:00";
    like.calendar = "proleptic_gregorian";
  }
  return axis(name, group.axes[axis_index], like);
}

std::string File::free_name(const Group& group) const {
  const Header& header = group.header;
  std::string name = header.short_name;
  if (group.is_distinguished && !header.product.suffix.empty()) {
    name += "_" + header.product.suffix;
  }
  const auto taken = [&] { return cf::variable_named(contents_, name) >= 0; };
  if (taken()) name += "_" + header.level_type;
  const std::string base = name;
  for (int n = 2; taken(); ++n) name = base + "_" + std::to_string(n);
  return name;
}

void File::name_field(const Group& group, FileVariable& variable) {
  const Product& product = group.header.product;
  variable.name = free_name(group);
  variable.long_name = group.names.name;
  variable.units = group.names.units;
  if (product.linear) {
    variable.standard_name = group.names.standard_name.empty() ? component_name(group.names.name)
                                                               : group.names.standard_name;
    if (group.is_distinguished) variable.process = product.suffix;
    const bool both = !variable.process.empty() && !group.height.empty();
    variable.process = group.height + (both ? "_" : "") + variable.process;
  } else {
    variable.process = variable.name;  // not a component
  }
  if (!product.words.empty()) variable.long_name += " (" + product.words + ")";
  const Grid& grid = grids_[group.grid];
  const bool is_turned = grid.projected || grid.rotated;
  if (group.header.relative_to_grid && is_turned && tell_by_grid(variable)) {
    contents_.notes.push_back(in_quotes(variable.name) +
                              " is along the rows or columns of its grid, not to east or north");
  }
}

void File::add_field(std::size_t g) {
  const Group& group = groups_[g];
  FileVariable variable;
  name_field(group, variable);
  variable.type = "float32";
  variable.unread = grids_[group.grid].problem;
  variable.numeric = variable.unread.empty();
  Content held;
  held.group = static_cast<int>(g);
  if (variable.numeric) {
    for (const AxisIndex one : {member_axis, reference_axis, time_axis, level_axis_index}) {
      const bool is_needed = one == time_axis ? !group.is_constant : group.axes[one].size() > 1;
      if (!is_needed) continue;
      variable.dims.push_back(group_axis(group, one));
      held.axes.push_back(one);
    }
    const auto grid = grid_dimensions(group.grid);
    variable.dims.insert(variable.dims.end(), grid.begin(), grid.end());
    if (grids_[group.grid].rotated || grids_[group.grid].projected) {
      variable.grid_mapping = name_on_grid(mapping_name, group.grid);
    }
  }
  if (group.repeated > 0) {
    contents_.notes.push_back(in_quotes(variable.name) + ": " + std::to_string(group.repeated) +
                              " more messages of the same members, times and levels are omitted; "
                              "the first ones are used");
  }
  contents_.variables.push_back(std::move(variable));
  held_.push_back(std::move(held));
}

cf::Numbers File::numbers(int variable, const char* attribute) const {
  const int at = held_.at(static_cast<std::size_t>(variable)).mapped_grid;
  if (at < 0) return {};
  const auto& numbers = grids_[static_cast<std::size_t>(at)].mapping.numbers;
  const auto found = numbers.find(attribute);
  return found == numbers.end() ? cf::Numbers() : cf::Numbers{found->second, true};
}

std::string File::text_of(int variable, const char* attribute) const {
  const Content& held = held_.at(static_cast<std::size_t>(variable));
  if (std::string_view(attribute) == "formula_terms") return held.formula;
  const int at = held.mapped_grid;
  if (at < 0) return {};
  const auto& texts = grids_[static_cast<std::size_t>(at)].mapping.texts;
  const auto found = texts.find(attribute);
  return found == texts.end() ? "" : found->second;
}

std::vector<std::size_t> File::chunk(int variable) const {
  const auto& dims = contents_.variables.at(static_cast<std::size_t>(variable)).dims;
  std::vector<std::size_t> out(dims.size(), 1);
  const Content& held = held_.at(static_cast<std::size_t>(variable));
  if (held.group < 0) return out;
  for (std::size_t d = held.axes.size(); d < dims.size(); ++d) {
    out[d] = contents_.dimensions[static_cast<std::size_t>(dims[d])].length;
  }
  return out;
}

void File::forget_chunks(int /*variable*/) const {
  const std::lock_guard lock(mutex_);
  last_values_ = {};
}

Result<const std::vector<float>*> File::values_of(std::size_t field, const Grid& grid) const {
  if (last_values_.empty() || last_field_ != field) {
    const auto message = read_message(*input_, places_[field]);
    if (!message) return message.error();
    auto values = read_values(*message, grid);
    if (!values) return input_->fault("has a message that " + values.error().message);
    last_values_ = std::move(*values);
    last_field_ = field;
  }
  return &last_values_;
}

template <class Out>
Result<void> File::read_block(int variable, const std::vector<std::size_t>& start,
                              const std::vector<std::size_t>& count, Out* out) const {
  const Content& held = held_.at(static_cast<std::size_t>(variable));
  const auto& dims = contents_.variables[static_cast<std::size_t>(variable)].dims;
  const std::size_t columns = contents_.dimensions[static_cast<std::size_t>(dims.back())].length;
  const std::size_t row_at = held.axes.size();
  const bool has_rows = row_at + 2 == dims.size();
  const std::size_t rows = has_rows ? count[row_at] : 1;
  const std::size_t first_row = has_rows ? start[row_at] : 0;
  const auto copy_rows = [&](const auto* from) {
    for (std::size_t j = 0; j < rows; ++j) {
      const auto* row = from + (first_row + j) * columns + start.back();
      out = std::transform(row, row + count.back(), out, [&](auto value) {
        return static_cast<Out>(held.is_logarithm ? std::exp(value) : value);
      });
    }
  };
  if (held.group < 0) {
    copy_rows(held.numbers.data());
    return {};
  }
  const std::lock_guard lock(mutex_);
  if (auto same = input_->check_unchanged(); !same) return same;
  const Group& group = groups_[static_cast<std::size_t>(held.group)];
  std::size_t fields = 1;
  for (std::size_t d = 0; d < held.axes.size(); ++d) fields *= count[d];
  for (std::size_t n = 0; n < fields; ++n) {
    Place place{};
    for (std::size_t one = 0; one < axis_count; ++one) place.at(one) = group.axes.at(one).front();
    std::size_t rest = n;
    for (std::size_t d = held.axes.size(); d-- > 0; rest /= count[d]) {
      place.at(held.axes[d]) = group.axes.at(held.axes[d])[start[d] + rest % count[d]];
    }
    const auto at = group.fields.find(place);
    if (at == group.fields.end()) {
      out = std::fill_n(out, rows * count.back(), std::numeric_limits<Out>::quiet_NaN());
      continue;
    }
    const auto values = values_of(at->second, grids_[group.grid]);
    if (!values) return values.error();
    copy_rows((*values)->data());
  }
  return {};
}

Result<void> File::read(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, double* out) const {
  return read_block(variable, start, count, out);
}

Result<void> File::read(int variable, const std::vector<std::size_t>& start,
                        const std::vector<std::size_t>& count, float* out) const {
  return read_block(variable, start, count, out);
}

}  // namespace windsplat::data::grib
