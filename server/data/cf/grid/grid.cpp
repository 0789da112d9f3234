// Variables -> candidates by layout -> groups on one grid -> the best group.
#include "server/data/cf/grid/grid.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace windsplat::data::cf {

namespace {

struct Candidate {
  int variable = 0;
  Layout layout;
};

struct Group {
  std::array<int, 3> space{};
  int rank = 0;
  bool preferred = false;
  double samples = 0;  // over all variables; only compared, so rounding is harmless
  std::vector<Candidate> members;
};

std::size_t length_of(const FileContents& contents, int dimension) {
  return contents.dimensions.at(static_cast<std::size_t>(dimension)).length;
}

// The words of a blank-separated attribute of all variables, collected once, because a file may
// have thousands of variables with long lists.
std::unordered_set<std::string_view> names_in(const FileContents& contents,
                                              const std::string FileVariable::*attribute) {
  std::unordered_set<std::string_view> out;
  for (const FileVariable& variable : contents.variables) {
    std::string_view rest = variable.*attribute;
    while (!rest.empty()) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      if (end > 0) out.insert(rest.substr(0, end));
      rest.remove_prefix(std::min(end + 1, rest.size()));
    }
  }
  return out;
}

// Names that occur in attributes of variables.
struct Named {
  explicit Named(const FileContents& contents)
      : bounds(names_in(contents, &FileVariable::bounds)),
        grid_mapping(names_in(contents, &FileVariable::grid_mapping)),
        coordinates(names_in(contents, &FileVariable::coordinates)) {}
  std::unordered_set<std::string_view> bounds;
  std::unordered_set<std::string_view> grid_mapping;
  std::unordered_set<std::string_view> coordinates;
};

constexpr const char* coordinate_variable = "coordinate variable";

// Why a variable cannot be a field on any grid; empty if it can.
std::string not_a_field(const FileContents& contents, const std::vector<DimensionRole>& roles,
                        const Named& named, std::size_t v) {
  const FileVariable& variable = contents.variables[v];
  if (!variable.unread.empty()) {
    return variable.unread;
  }
  if (!variable.numeric) {
    return variable.type == "text" ? "text, not numbers" : "not a plain number type";
  }
  const bool is_coordinate = std::any_of(
      roles.begin(), roles.end(),
      [v](const DimensionRole& role) { return role.coordinate == static_cast<int>(v); });
  if (is_coordinate || variable.in_use) {
    return coordinate_variable;
  }
  if (named.bounds.count(variable.name) > 0) {
    return "bounds of a coordinate";
  }
  if (named.grid_mapping.count(variable.name) > 0) {
    return "description of the map projection";
  }
  if (variable.dims.size() >= 2 && is_position(variable)) {
    return "coordinate of more than one dimension: gives the positions of rows and columns";
  }
  if (named.coordinates.count(variable.name) > 0) {
    return "auxiliary coordinate";
  }
  return {};
}

std::string misplaced(const FileContents& contents, const FileVariable& variable,
                      const Layout& layout) {
  if (!layout.problem.empty()) {
    return layout.problem;
  }
  if (layout.rank() < 2) {
    return "fewer than two spatial dimensions";
  }
  for (const int dimension : variable.dims) {
    if (length_of(contents, dimension) == 0) {
      return "its dimension '" +
             printable(contents.dimensions.at(static_cast<std::size_t>(dimension)).name) +
             "' has length 0";
    }
  }
  return {};
}

// Error text for a file without fields, explained by the variable with the most dimensions.
std::string nothing_to_show(const FileContents& contents, const std::vector<LeftOut>& left_out) {
  std::string text =
      "there is no numeric variable with two or three spatial dimensions; stations in a list, and "
      "cells without their outlines, are not supported";
  const FileVariable* most = nullptr;
  for (const FileVariable& variable : contents.variables) {
    if (!variable.unread.empty() && variable.dims.size() >= 2) {
      return "no field can be read: " + in_quotes(variable.name) + " is " + variable.unread;
    }
    if (variable.numeric && (most == nullptr || variable.dims.size() > most->dims.size())) {
      most = &variable;
    }
  }
  constexpr std::size_t listed_max = 16;
  std::size_t count = 0;
  for (const LeftOut& left : left_out) {
    if (!left.reason.starts_with("group") || ++count > listed_max) continue;
    text += (count == 1 ? "; it has the groups " : ", ") + in_quotes(left.name);
  }
  if (count > listed_max) text += ", ...";
  if (most == nullptr || most->dims.empty()) return text;
  const auto empty = std::find_if(most->dims.begin(), most->dims.end(),
                                  [&](int d) { return length_of(contents, d) == 0; });
  if (empty != most->dims.end() && most->dims.size() > 2) {
    return "it has no values: the dimension " +
           in_quotes(contents.dimensions.at(static_cast<std::size_t>(*empty)).name) + " of " +
           in_quotes(most->name) + " has length 0";
  }
  text += ": " + in_quotes(most->name) + " is of ";
  const char* separator = "";
  for (const int dimension : most->dims) {
    text += separator + std::to_string(length_of(contents, dimension));
    separator = " x ";
  }
  const auto left = std::find_if(left_out.begin(), left_out.end(),
                                 [&](const LeftOut& one) { return one.name == most->name; });
  if (left != left_out.end()) text += ", " + left->reason;
  return text;
}

double samples_of(const FileContents& contents, const std::array<int, 3>& space) {
  double samples = 1;
  for (const int dimension : space) {
    samples *= dimension < 0 ? 1.0 : static_cast<double>(length_of(contents, dimension));
  }
  return samples;
}

void add_to_group(const FileContents& contents, std::vector<Group>& groups, Candidate candidate) {
  const auto& space = candidate.layout.space;
  auto at = std::find_if(groups.begin(), groups.end(),
                         [&](const Group& group) { return group.space == space; });
  if (at == groups.end()) {
    groups.push_back({space, candidate.layout.rank(), false, 0, {}});
    at = groups.end() - 1;
  }
  at->preferred = at->preferred ||
                  contents.variables.at(static_cast<std::size_t>(candidate.variable)).preferred;
  at->samples += samples_of(contents, space);
  at->members.push_back(std::move(candidate));
}

// For example "another grid (lev 14, lat 64, lon 128)".
std::string grid_text(const FileContents& contents, const std::array<int, 3>& space) {
  std::string text = "on another grid (";
  const char* separator = "";
  for (auto dimension = space.rbegin(); dimension != space.rend(); ++dimension) {
    if (*dimension >= 0) {
      text += separator +
              printable(contents.dimensions.at(static_cast<std::size_t>(*dimension)).name) + ' ' +
              std::to_string(length_of(contents, *dimension));
      separator = ", ";
    }
  }
  return text + ")";
}

// The time dimension of most members; the first one on a tie.
int common_time(const std::vector<Candidate>& members) {
  int best = -1;
  std::ptrdiff_t best_count = 0;
  for (const Candidate& member : members) {
    const int time = member.layout.time;
    const auto count = std::count_if(members.begin(), members.end(),
                                     [time](const Candidate& m) { return m.layout.time == time; });
    if (time >= 0 && count > best_count) {
      best = time;
      best_count = count;
    }
  }
  return best;
}

// Says how to show the grids that are not chosen, by one variable of each.
void tell_other_grids(const FileContents& contents, const std::vector<Group>& groups,
                      GridChoice& choice) {
  constexpr std::size_t listed_max = 8;
  std::string text;
  std::size_t count = 0;
  for (const Group& group : groups) {
    if (group.space == choice.space || ++count > listed_max) continue;
    const auto first = static_cast<std::size_t>(group.members.front().variable);
    text += (count == 1 ? "" : ", ") + printable(contents.variables[first].name);
  }
  if (count == 0) return;
  const std::string field = contents.has_selection ? "&field=" : "?field=";
  choice.note =
      (count == 1 ? "fields on another grid are shown by appending " + field
                  : "fields on " + std::to_string(count) + " other grids are shown by appending " +
                        field + "NAME to the file's name, with the name of one of them: ") +
      text +
      (count == 1           ? " to the file's name"
       : count > listed_max ? ", ..."
                            : "");
}

// Why a preferred variable is no field; empty if none is preferred.
std::optional<Error> not_shown(const FileContents& contents, const std::vector<LeftOut>& left_out) {
  for (const FileVariable& variable : contents.variables) {
    if (!variable.preferred) continue;
    std::string text = in_quotes(variable.name) + " cannot be shown";
    for (const LeftOut& left : left_out) {
      if (left.name == variable.name)
        return make_error(ErrorKind::bad_data, text + ": " + left.reason);
    }
    return make_error(ErrorKind::bad_data, text);
  }
  return std::nullopt;
}

Result<void> check_size(const FileContents& contents, const GridChoice& choice) {
  const double samples = samples_of(contents, choice.space);
  if (samples > static_cast<double>(grid_samples_max)) {
    return make_error(ErrorKind::bad_data,
                      "the grid has more than " + std::to_string(grid_samples_max) + " samples");
  }
  if (choice.time >= 0 && length_of(contents, choice.time) > 10'000'000) {
    return make_error(ErrorKind::bad_data, "there are more than 10000000 time steps");
  }
  return {};
}

}  // namespace

std::vector<std::string> reasons_of_no_field(const FileContents& contents,
                                             const std::vector<DimensionRole>& roles) {
  const Named named(contents);
  std::vector<std::string> out;
  out.reserve(contents.variables.size());
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    out.push_back(not_a_field(contents, roles, named, v));
  }
  return out;
}

Result<GridChoice> choose_grid(const FileContents& contents,
                               const std::vector<DimensionRole>& roles) {
  GridChoice choice;
  std::vector<Group> groups;
  std::vector<std::string> reasons = reasons_of_no_field(contents, roles);
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& variable = contents.variables[v];
    std::string& reason = reasons[v];
    if (reason.empty()) {
      Candidate candidate{static_cast<int>(v), lay_out(contents, roles, variable)};
      reason = misplaced(contents, variable, candidate.layout);
      if (reason.empty()) {
        add_to_group(contents, groups, std::move(candidate));
      }
    }
    // Coordinate variables are in use, so they are not listed as omitted.
    if (!reason.empty() && reason != coordinate_variable) {
      choice.left_out.push_back({variable.name, std::move(reason)});
    }
  }
  choice.left_out.insert(choice.left_out.end(), contents.left_out.begin(), contents.left_out.end());
  for (const std::string& group : contents.groups) {
    choice.left_out.push_back({group, "group: to open it, append '#' and its name to the file's"});
  }
  if (groups.empty()) {
    return make_error(ErrorKind::bad_data, nothing_to_show(contents, choice.left_out));
  }
  const auto best =
      std::max_element(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
        return std::tuple(a.preferred, a.rank, a.samples) <
               std::tuple(b.preferred, b.rank, b.samples);
      });
  if (const auto wanted = not_shown(contents, choice.left_out); wanted && !best->preferred) {
    return *wanted;
  }
  choice.space = best->space;
  choice.time = common_time(best->members);
  for (const Candidate& member : best->members) {
    const FileVariable& variable = contents.variables[static_cast<std::size_t>(member.variable)];
    if (variable.preferred && member.layout.time >= 0) choice.time = member.layout.time;
  }
  for (const Candidate& member : best->members) {
    if (member.layout.time >= 0 && member.layout.time != choice.time) {
      choice.left_out.push_back({contents.variables[static_cast<std::size_t>(member.variable)].name,
                                 "on another time axis"});
    } else {
      choice.variables.push_back(member.variable);
    }
  }
  tell_other_grids(contents, groups, choice);
  for (const Group& group : groups) {
    if (group.space != choice.space) {
      for (const Candidate& member : group.members) {
        choice.left_out.push_back(
            {contents.variables[static_cast<std::size_t>(member.variable)].name,
             grid_text(contents, group.space)});
      }
    }
  }
  if (auto fine = check_size(contents, choice); !fine) {
    return fine.error();
  }
  return choice;
}

}  // namespace windsplat::data::cf
