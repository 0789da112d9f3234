// Messages -> groups -> variables, which share dimensions with equal coordinates.
#include "server/data/formats/grib/file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string_view>

#include "server/data/formats/grib/levels.hpp"
#include "server/data/formats/grib/open.hpp"

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
         a.row_lengths == b.row_lengths && a.mapping.numbers == b.mapping.numbers &&
         a.mapping.texts == b.mapping.texts && close(a.longitude, b.longitude) &&
         close(a.latitude, b.latitude) && close(a.x, b.x, tolerance_m) &&
         close(a.y, b.y, tolerance_m);
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

// The library names winds eastward and northward regardless of the flag of the message. Winds along
// the rows and columns of the grid are x and y in CF, and must not be rotated.
bool tell_by_grid(FileVariable& variable) {
  constexpr std::string_view eastward = "eastward_";
  constexpr std::string_view northward = "northward_";
  std::string& name = variable.standard_name;
  if (name.starts_with(eastward)) {
    name.replace(0, eastward.size(), "x_");
  } else if (name.starts_with(northward)) {
    name.replace(0, northward.size(), "y_");
  } else {
    return false;
  }
  return true;
}

}  // namespace

Result<std::unique_ptr<cf::ArrayFile>> open(std::shared_ptr<const InputFile> input) {
  return File::open(std::move(input));
}

Result<std::unique_ptr<cf::ArrayFile>> File::open(std::shared_ptr<const InputFile> input) {
  std::unique_ptr<File> file(new File(std::move(input)));
  if (auto done = file->scan(); !done) return done.error();
  file->add_variables();
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

Result<void> File::scan() {
  auto places = find_fields(*input_);
  if (!places) return places.error();
  places_ = std::move(*places);
  if (places_.empty()) return input_->fault("contains no GRIB fields");
  std::set<int> editions;
  std::map<std::string, std::size_t> unread;
  for (std::size_t f = 0; f < places_.size(); ++f) {
    editions.insert(places_[f].edition);
    const auto message = read_message(*input_, places_[f]);
    if (!message) return message.error();
    const auto header = read_header(*message);
    if (!header) {
      ++unread[header.error().message];
      continue;
    }
    const auto grid = grid_of(*message, header->grid_key);
    if (!grid) return grid.error();
    auto at = std::find_if(groups_.begin(), groups_.end(), [&](const Group& group) {
      return group.header.short_name == header->short_name &&
             group.header.level_type == header->level_type && group.grid == *grid;
    });
    if (at == groups_.end()) {
      if (groups_.size() >= groups_max) {
        return input_->fault("has more than " + std::to_string(groups_max) + " variables");
      }
      groups_.push_back({*header, *grid, {}, 0});
      at = groups_.end() - 1;
    }
    if (!at->fields.emplace(Place{header->member, header->hours, header->level}, f).second)
      ++at->repeated;
  }
  for (const auto& [reason, count] : unread) {
    contents_.notes.push_back(std::to_string(count) + " messages left out: each " + reason);
  }
  format_ = editions.size() == 2 ? "GRIB 1 and 2" : "GRIB " + std::to_string(*editions.begin());
  return {};
}

// If no field can be read, returns the reason instead of a missing field.
Result<void> File::check_any_field() const {
  for (const Content& held : held_) {
    if (!held.numbers.empty()) return {};
  }
  if (groups_.empty()) {
    return input_->fault("has no field that can be read" +
                         (contents_.notes.empty() ? std::string() : ": " + contents_.notes[0]));
  }
  const Group& group = groups_.front();
  return input_->fault("has no field that can be read: " + in_quotes(group.header.short_name) +
                       " is " + grids_[group.grid].problem);
}

void File::add_variables() {
  for (std::size_t g = 0; g < groups_.size(); ++g) add_field(g);
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
  held_.push_back({values, -1, {}, {}, {}});
  return static_cast<int>(contents_.dimensions.size()) - 1;
}

// Latitude and longitude, or y and x of a map projection.
std::vector<int> File::grid_dimensions(std::size_t g) {
  if (const auto known = grid_dims_.find(g); known != grid_dims_.end()) return known->second;
  return grid_dims_[g] = grids_[g].projected ? add_plane(g) : add_axes(g);
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

// Keeps the members of an ensemble that have as many messages as the one with the most.
void File::omit_incomplete_members(Group& group) {
  std::map<double, std::size_t> counts;
  for (const auto& [place, field] : group.fields) ++counts[place[0]];
  std::size_t most = 0;
  for (const auto& [member, count] : counts) most = std::max(most, count);
  std::string omitted;
  for (const auto& [member, count] : counts) {
    if (count == most) continue;
    omitted += (omitted.empty() ? "" : ", ") + std::to_string(static_cast<long>(member));
    std::erase_if(group.fields, [at = member](const auto& one) { return one.first[0] == at; });
  }
  if (omitted.empty()) return;
  contents_.notes.push_back(in_quotes(group.header.short_name) +
                            ": members of the ensemble with fewer messages than others are "
                            "omitted: " +
                            omitted);
}

void File::add_field(std::size_t g) {
  omit_incomplete_members(groups_[g]);
  const Group& group = groups_[g];
  const Header& header = group.header;
  FileVariable variable;
  variable.name = header.short_name;
  const auto taken = [&] {
    return std::any_of(contents_.variables.begin(), contents_.variables.end(),
                       [&](const FileVariable& known) { return known.name == variable.name; });
  };
  if (taken()) variable.name += "_" + header.level_type;
  const std::string base = variable.name;
  for (int n = 2; taken(); ++n) variable.name = base + "_" + std::to_string(n);
  variable.type = "float32";
  variable.standard_name = header.standard_name;
  variable.long_name = header.name;
  variable.units = header.units;
  variable.unread = grids_[group.grid].problem;
  variable.numeric = variable.unread.empty();
  Content held;
  held.group = static_cast<int>(g);
  std::set<double> members;
  std::set<double> times;
  std::set<double> levels;
  for (const auto& [place, field] : group.fields) {
    members.insert(place[0]);
    times.insert(place[1]);
    levels.insert(place[2]);
  }
  held.members.assign(members.begin(), members.end());
  held.times.assign(times.begin(), times.end());
  held.levels.assign(levels.begin(), levels.end());
  if (variable.numeric) {
    if (members.size() > 1) {
      FileVariable number;
      number.standard_name = "realization";
      number.units = "1";
      variable.dims.push_back(axis("number", held.members, number));
    }
    FileVariable time;
    time.standard_name = "time";
    time.units = "hours since 1970-01-01 00:00:00";
    time.calendar = "proleptic_gregorian";
    variable.dims.push_back(axis("time", held.times, time));
    if (levels.size() > 1) {
      variable.dims.push_back(axis(header.level_type.empty() ? "level" : header.level_type,
                                   held.levels, level_axis(header.level_type)));
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
  const Grid& on_grid = grids_[group.grid];
  const bool is_turned = on_grid.projected || on_grid.rotated;
  if (header.relative_to_grid && is_turned && tell_by_grid(variable)) {
    contents_.notes.push_back(in_quotes(variable.name) +
                              " is along the rows or columns of its grid, not to east or north");
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
  const int at = held_.at(static_cast<std::size_t>(variable)).mapped_grid;
  if (at < 0) return {};
  const auto& texts = grids_[static_cast<std::size_t>(at)].mapping.texts;
  const auto found = texts.find(attribute);
  return found == texts.end() ? "" : found->second;
}

std::vector<std::size_t> File::chunk(int variable) const {
  const auto& dims = contents_.variables.at(static_cast<std::size_t>(variable)).dims;
  std::vector<std::size_t> out(dims.size(), 1);
  const Content& held = held_.at(static_cast<std::size_t>(variable));
  if (held.group < 0 || dims.size() < 2) return out;
  for (std::size_t d = dims.size() - 2; d < dims.size(); ++d) {
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
  const std::size_t rank = dims.size();
  const std::size_t columns = contents_.dimensions[static_cast<std::size_t>(dims.back())].length;
  const std::size_t rows = rank < 2 ? 1 : count[rank - 2];
  const std::size_t first_row = rank < 2 ? 0 : start[rank - 2];
  const auto copy_rows = [&](const auto* from) {
    for (std::size_t j = 0; j < rows; ++j) {
      const auto* row = from + (first_row + j) * columns + start.back();
      out = std::transform(row, row + count.back(), out,
                           [](auto value) { return static_cast<Out>(value); });
    }
  };
  if (held.group < 0) {
    copy_rows(held.numbers.data());
    return {};
  }
  const std::lock_guard lock(mutex_);
  if (auto same = input_->check_unchanged(); !same) return same;
  const Group& group = groups_[static_cast<std::size_t>(held.group)];
  const std::size_t time = held.members.size() > 1 ? 1 : 0;
  const bool has_levels = held.levels.size() > 1;
  const std::size_t members = time == 0 ? 1 : count[0];
  const std::size_t levels = has_levels ? count[time + 1] : 1;
  for (std::size_t n = 0; n < members * count[time] * levels; ++n) {
    const std::size_t m = n / levels / count[time];
    const std::size_t t = n / levels % count[time];
    const std::size_t l = n % levels;
    const Place place{held.members[time == 0 ? 0 : start[0] + m], held.times[start[time] + t],
                      held.levels[has_levels ? start[time + 1] + l : 0]};
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
