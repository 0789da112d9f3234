// Compares members with the first one and combines their times into one axis.
#include "server/data/cf/series.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/mesh/topology.hpp"
#include "server/data/cf/packing.hpp"
#include "server/data/cf/selected/selected_file.hpp"
#include "server/data/cf/time.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::cf {

namespace {

bool same_packing(const Packing& a, const Packing& b) {
  return a.packed == b.packed && same_number(a.scale, b.scale) && same_number(a.offset, b.offset) &&
         a.wrap == b.wrap && same_number(a.valid_min, b.valid_min) &&
         same_number(a.valid_max, b.valid_max) && a.valid_is_unpacked == b.valid_is_unpacked &&
         std::equal(a.missing.begin(), a.missing.end(), b.missing.begin(), b.missing.end(),
                    same_number);
}

constexpr std::size_t compared_max = std::size_t{1} << 24;  // values of a coordinate

// Number of values of a variable, at most compared_max + 1.
std::size_t values_of(const FileContents& contents, int variable) {
  std::size_t values = 1;
  for (const int d : contents.variables.at(at(variable)).dims) {
    const std::size_t length = contents.dimensions.at(at(d)).length;
    if (length == 0) return 0;
    values = values > compared_max / length ? compared_max + 1 : values * length;
  }
  return values;
}

std::vector<std::string> dimension_names(const FileContents& contents, int variable) {
  std::vector<std::string> out;
  for (const int d : contents.variables.at(at(variable)).dims) {
    out.push_back(contents.dimensions.at(at(d)).name);
  }
  return out;
}

// Whether a file holds variables along a time, but no step, as a model writes it when it starts.
bool has_no_step(const FileContents& contents) {
  const std::vector<DimensionRole> roles = classify_dimensions(contents);
  const bool has_time = std::any_of(
      roles.begin(), roles.end(), [](const DimensionRole& one) { return one.role == Role::time; });
  bool is_empty = false;
  for (const FileVariable& variable : contents.variables) {
    if (!variable.numeric || variable.dims.size() < 2) continue;
    for (const int d : variable.dims) {
      const FileDimension& one = contents.dimensions.at(at(d));
      if (has_time ? roles.at(at(d)).role != Role::time : !one.unlimited) continue;
      if (one.length > 0) return false;
      is_empty = true;
    }
  }
  return is_empty;
}

Error misfit(const ArrayFile& file, const ArrayFile& first, const std::string& what) {
  return make_error(ErrorKind::bad_data, in_quotes(file.name()) +
                                             " does not fit into a series with " +
                                             in_quotes(first.name()) + ": " + what);
}

}  // namespace

std::string damaged_files_note(const std::vector<Error>& damaged, std::size_t members) {
  constexpr std::size_t listed_max = 8;
  std::string text =
      std::to_string(damaged.size()) + " of " + std::to_string(members) + damaged_files_mark;
  for (std::size_t n = 0; n < std::min(damaged.size(), listed_max); ++n) {
    text += (n > 0 ? "; " : "") + damaged[n].message;
  }
  if (damaged.size() > listed_max) text += "; ...";
  return text;
}

std::string damage_of(const ArrayFile& series) {
  for (const std::string& note : series.contents().notes) {
    if (note.find(damaged_files_mark) != std::string::npos) return "; " + note;
  }
  return {};
}

Result<std::unique_ptr<SeriesFile>> SeriesFile::open(std::string name, std::size_t members,
                                                     OpenMember open_member, std::string origin) {
  std::unique_ptr<SeriesFile> series(new SeriesFile(std::move(name), std::move(open_member)));
  series->origin_ = std::move(origin);
  std::vector<Error> damaged;
  for (std::size_t m = 0; m < members; ++m) {
    auto opened = series->open_member_(m);
    if (!opened && opened.error().kind != ErrorKind::bad_data) return opened.error();
    if (opened && has_no_step((*opened)->contents())) {
      opened = make_error(ErrorKind::bad_data, in_quotes((*opened)->name()) + " has no time step");
    }
    if (!opened) {
      damaged.push_back(opened.error());
      continue;
    }
    if (auto added = series->add(m, std::move(*opened)); !added) return added.error();
  }
  if (series->members_.empty() && !damaged.empty()) return damaged.front();
  series->sort_steps();
  if (series->steps_.empty()) {
    return make_error(ErrorKind::bad_data, in_quotes(series->name_) + ": no file has a time step");
  }
  series->finish();
  if (!damaged.empty()) series->contents_.notes.push_back(damaged_files_note(damaged, members));
  series->has_damaged_files_ = !damaged.empty();
  return series;
}

std::string SeriesFile::identity() const {
  std::string all;
  for (const Member& member : members_) all += member.identity + '\n';
  return digest_of(all);
}

const FileVariable* SeriesFile::time_coordinate() const {
  for (std::size_t v = 0; v < variables_.size(); ++v) {
    if (variables_[v].in_first == time_coordinate_) return &contents_.variables[v];
  }
  return nullptr;
}

std::vector<double> SeriesFile::times() const {
  std::vector<double> out;
  out.reserve(steps_.size());
  for (const Step& step : steps_) out.push_back(step.time);
  return out;
}

void SeriesFile::keep_steps(const std::vector<std::size_t>& kept) {
  const std::size_t lost = steps_.size() - kept.size();
  if (lost == 0) return;
  std::vector<Step> steps;
  steps.reserve(kept.size());
  for (const std::size_t step : kept) steps.push_back(steps_.at(step));
  steps_ = std::move(steps);
  contents_.dimensions.at(at(time_of_all_)).length = steps_.size();
  contents_.notes.push_back(in_quotes(origin()) + ": " + std::to_string(lost) +
                            (lost == 1 ? " step is" : " steps are") +
                            " left out, which other parts do not have");
}

Result<void> SeriesFile::begin() {
  const FileContents& contents = first_->contents();
  const std::vector<DimensionRole> roles = classify_dimensions(contents);
  // Files of a mesh, or of data on a mesh in another file, are joined before they have a lattice.
  const auto topology = find_topology(*first_);
  const auto lists = grid_of_lists(*first_);
  auto choice = topology && lists ? Result<GridChoice>(*lists) : choose_grid(contents, roles);
  if (!choice && lists) choice = *lists;
  if (!choice) {
    return make_error(choice.error().kind,
                      in_quotes(first_->name()) + ": " + choice.error().message);
  }
  if (topology) parts_of_mesh_ = variables_of(*topology);
  space_ = choice->space;
  time_ = choice->time;
  dropped_.resize(contents.variables.size());
  as_values_.resize(contents.variables.size());
  if (time_ >= 0) {
    time_coordinate_ = roles.at(at(time_)).coordinate;
    return {};
  }
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    if (variable.dims.empty() && variable.numeric &&
        (variable.standard_name == "time" || variable.name == "time")) {
      time_coordinate_ = static_cast<int>(v);
    }
  }
  return {};
}

// Whether the values of the first member are used for all members.
bool SeriesFile::is_static(std::size_t in_first) const {
  const FileVariable& variable = first_->contents().variables[in_first];
  if (static_cast<int>(in_first) == time_coordinate_) return false;
  if (time_ >= 0) {
    return std::find(variable.dims.begin(), variable.dims.end(), time_) == variable.dims.end();
  }
  const auto is_part =
      std::count(parts_of_mesh_.begin(), parts_of_mesh_.end(), static_cast<int>(in_first)) > 0;
  return variable.dims.size() < 2 || !variable.numeric || is_position(variable) || is_part;
}

Result<void> SeriesFile::add(std::size_t index, std::unique_ptr<ArrayFile> opened) {
  const std::size_t member = members_.size();
  const bool is_first = member == 0;
  const ArrayFile& file = *opened;
  if (is_first) {
    first_ = std::move(opened);
    if (auto begun = begin(); !begun) return begun;
  }
  members_.push_back({index, file.identity(), {}, false});
  if (!is_first) {
    if (auto fine = check_space(file); !fine) return fine;
    if (auto fine = check_values(file); !fine) return fine;
    compare_variables(file, members_.back());
  }
  return add_times(member, file);
}

Result<void> SeriesFile::check_space(const ArrayFile& file) const {
  const std::string differs = differing_entry(first_->contents(), file.contents());
  if (!differs.empty()) return misfit(file, *first_, differs);
  for (const int d : space_) {
    if (d < 0) continue;
    const FileDimension& own = first_->contents().dimensions.at(at(d));
    const int other = dimension_named(file.contents(), own.name);
    if (other < 0) {
      return misfit(file, *first_,
                    "it has no dimension " + in_quotes(own.name) +
                        "; files with different variables are joined by a list in braces, "
                        "'{a,b}_*.nc'");
    }
    const std::size_t length = file.contents().dimensions.at(at(other)).length;
    if (length != own.length) {
      return misfit(file, *first_,
                    "its dimension " + in_quotes(own.name) + " has length " +
                        std::to_string(length) + ", not " + std::to_string(own.length));
    }
  }
  return {};
}

// Compares spatial coordinates of any rank, and other variables along an axis.
Result<void> SeriesFile::check_values(const ArrayFile& file) const {
  const FileContents& contents = first_->contents();
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    const bool places = variable.dims.size() == 1 || is_position(variable);
    const bool in_space = std::all_of(variable.dims.begin(), variable.dims.end(), [&](int d) {
      return std::find(space_.begin(), space_.end(), d) != space_.end();
    });
    const int other = variable_named(file.contents(), variable.name);
    if (!variable.numeric || !places || variable.dims.empty() || !in_space || other < 0 ||
        values_of(contents, static_cast<int>(v)) > compared_max) {
      continue;
    }
    if (!file.contents().variables[at(other)].numeric ||
        dimension_names(contents, static_cast<int>(v)) != dimension_names(file.contents(), other)) {
      return misfit(file, *first_,
                    in_quotes(variable.name) + " is not numeric or has other dimensions");
    }
    auto own = unpacked_values(*first_, static_cast<int>(v));
    auto others = unpacked_values(file, other);
    if (!own) return own.error();
    if (!others) return others.error();
    const auto differ =
        std::mismatch(own->begin(), own->end(), others->begin(), others->end(), same_place);
    if (differ.first != own->end() || differ.second != others->end()) {
      const auto index = differ.first - own->begin();
      std::string what = "its coordinate " + in_quotes(variable.name) + " differs at index " +
                         std::to_string(index);
      if (differ.first != own->end() && differ.second != others->end()) {
        what += ": " + number_text(*differ.second) + ", not " + number_text(*differ.first);
      }
      return misfit(file, *first_, what);
    }
  }
  return {};
}

void SeriesFile::compare_variables(const ArrayFile& file, Member& member) {
  const FileContents& own = first_->contents();
  const FileContents& others = file.contents();
  std::vector<int> indices;
  bool same = true;
  for (std::size_t v = 0; v < own.variables.size(); ++v) {
    const FileVariable& variable = own.variables[v];
    const int other = variable_named(others, variable.name);
    indices.push_back(other);
    same = same && other == static_cast<int>(v);
    if (is_static(v) || static_cast<int>(v) == time_coordinate_ || !dropped_[v].empty()) continue;
    if (other < 0) {
      dropped_[v] = "not in all files: " + in_quotes(file.name()) + " lacks it";
      continue;
    }
    const FileVariable& found = others.variables[at(other)];
    bool fits = dimension_names(own, static_cast<int>(v)) == dimension_names(others, other) &&
                variable.numeric == found.numeric;
    for (std::size_t d = 0; fits && d < variable.dims.size(); ++d) {
      fits = variable.dims[d] == time_ || own.dimensions[at(variable.dims[d])].length ==
                                              others.dimensions[at(found.dims[d])].length;
    }
    if (!fits || variable.units != found.units) {
      dropped_[v] = "its " + std::string(fits ? "units" : "dimensions") + " differ in " +
                    in_quotes(file.name());
    } else if (variable.numeric) {
      const bool alike =
          variable.type == found.type && variable.is_unsigned == found.is_unsigned &&
          same_packing(packing_of(*first_, static_cast<int>(v)), packing_of(file, other));
      as_values_[v] = as_values_[v] || !alike;
    }
  }
  for (const FileVariable& variable : others.variables) {
    const bool listed =
        std::any_of(contents_.left_out.begin(), contents_.left_out.end(),
                    [&](const LeftOut& left) { return left.name == variable.name; });
    if (variable_named(own, variable.name) < 0 && variable.dims.size() > 1 && !listed) {
      contents_.left_out.push_back(
          {variable.name, "not in all files: " + in_quotes(first_->name()) + " lacks it"});
    }
  }
  if (!same) member.variables = std::move(indices);
}

Result<void> SeriesFile::add_times(std::size_t member, const ArrayFile& file) {
  const FileContents& own = first_->contents();
  std::size_t records = 1;
  if (time_ >= 0) {
    const int time = dimension_named(file.contents(), own.dimensions[at(time_)].name);
    if (time < 0) {
      return misfit(file, *first_,
                    "it has no dimension " + in_quotes(own.dimensions[at(time_)].name));
    }
    records = file.contents().dimensions[at(time)].length;
  }
  if (steps_.size() + records > 10'000'000) {
    return make_error(ErrorKind::bad_data, "there are more than 10000000 time steps");
  }
  if (time_coordinate_ < 0) {
    for (std::size_t r = 0; r < records; ++r) {
      steps_.push_back({member, r, static_cast<double>(steps_.size())});
    }
    return {};
  }
  const FileVariable& coordinate = own.variables[at(time_coordinate_)];
  const int other = variable_named(file.contents(), coordinate.name);
  if (other < 0) return misfit(file, *first_, "it has no " + in_quotes(coordinate.name));
  const FileVariable& found = file.contents().variables[at(other)];
  members_[member].has_single_times = found.type == "float32";
  auto values = found.numeric && values_of(file.contents(), other) == records
                    ? unpacked_values(file, other)
                    : std::vector<double>();
  if (!values) return values.error();
  const bool complete = std::all_of(values->begin(), values->end(),
                                    [](double value) { return std::isfinite(value); });
  if (values->size() != records || !complete) {
    return misfit(file, *first_, "some of its steps have no time");
  }
  const auto times = convert_times(*values, {found.units, found.calendar},
                                   {coordinate.units, coordinate.calendar});
  if (!times) {
    return misfit(file, *first_,
                  "its times, in " + in_quotes(found.units) + " (calendar " +
                      in_quotes(found.calendar) + "), cannot be expressed in " +
                      in_quotes(coordinate.units) + " (calendar " + in_quotes(coordinate.calendar) +
                      ")");
  }
  for (std::size_t r = 0; r < records; ++r) steps_.push_back({member, r, (*times)[r]});
  return {};
}

void SeriesFile::sort_steps() {
  std::stable_sort(steps_.begin(), steps_.end(),
                   [](const Step& a, const Step& b) { return a.time < b.time; });
  std::vector<Step> kept;
  std::size_t twice = 0;   // times that occur in two files
  std::size_t within = 0;  // times that are repeated within one file
  for (const Step& step : steps_) {
    const bool again =
        !kept.empty() && step.time - kept.back().time <= 1e-12 * std::max(1.0, std::abs(step.time));
    if (again) {
      ++(step.member != kept.back().member ? twice : within);
      kept.back() = step;
    } else {
      kept.push_back(step);
    }
  }
  if (twice > 0) {
    contents_.notes.push_back(std::to_string(twice) +
                              (twice == 1 ? " time occurs" : " times occur") +
                              " in more than one file: those of the later file are shown");
  }
  if (within > 0) {
    contents_.notes.push_back(std::to_string(within) + (within == 1 ? " time is" : " times are") +
                              " repeated within one file: the last of each is shown");
  }
  steps_ = std::move(kept);
}

// Builds the contents from the first member and the comparison with the others.
void SeriesFile::finish() {
  const FileContents& own = first_->contents();
  contents_.title = own.title;
  contents_.dimensions = own.dimensions;
  contents_.groups = own.groups;
  contents_.choices = own.choices;
  contents_.notes.insert(contents_.notes.begin(), own.notes.begin(), own.notes.end());
  contents_.left_out.insert(contents_.left_out.begin(), own.left_out.begin(), own.left_out.end());
  const bool has_single_times =
      std::any_of(members_.begin(), members_.end(),
                  [](const Member& member) { return member.has_single_times; });
  for (std::size_t v = 0; v < own.variables.size(); ++v) {
    FileVariable variable = own.variables[v];
    if (!dropped_[v].empty()) {
      contents_.left_out.push_back({variable.name, dropped_[v]});
      continue;
    }
    const bool is_time = static_cast<int>(v) == time_coordinate_;
    if (as_values_[v] || is_time) {
      variable.type = is_time && !has_single_times ? "float64" : "float32";
      variable.packed = false;
      variable.is_unsigned = false;
    }
    Variable way;
    way.in_first = static_cast<int>(v);
    way.as_values = as_values_[v] || is_time;
    const auto time = std::find(variable.dims.begin(), variable.dims.end(), time_);
    if (time_ >= 0 && time != variable.dims.end()) {
      way.time_axis = static_cast<int>(time - variable.dims.begin());
    }
    contents_.variables.push_back(std::move(variable));
    variables_.push_back(way);
  }
  if (time_ >= 0) {
    time_of_all_ = time_;
    contents_.dimensions[at(time_)].length = steps_.size();
  } else {
    add_time_dimension();
  }
  contents_.notes.push_back(std::to_string(members_.size()) +
                            (members_.size() == 1 ? " file" : " files") + " joined along time");
}

// Adds a time dimension for members that are single steps.
void SeriesFile::add_time_dimension() {
  FileDimension dimension;
  dimension.name = time_coordinate_ >= 0 ? first_->contents().variables[at(time_coordinate_)].name
                                         : std::string("time");
  for (int n = 1; dimension_named(contents_, dimension.name) >= 0; ++n) {
    dimension.name = "time_" + std::to_string(n);
  }
  dimension.length = steps_.size();
  dimension.unlimited = true;
  const auto added = static_cast<int>(contents_.dimensions.size());
  contents_.dimensions.push_back(std::move(dimension));
  time_of_all_ = added;
  for (std::size_t v = 0; v < variables_.size(); ++v) {
    if (is_static(at(variables_[v].in_first))) continue;
    FileVariable& variable = contents_.variables[v];
    variable.dims.insert(variable.dims.begin(), added);
    variables_[v].time_axis = 0;
    if (variables_[v].in_first == time_coordinate_) variable.axis = "T";
  }
}

}  // namespace windsplat::data::cf
