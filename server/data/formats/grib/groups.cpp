// Sets of coordinates, and which contain which.
#include "server/data/formats/grib/groups.hpp"

#include <algorithm>
#include <set>
#include <tuple>
#include <utility>

namespace windsplat::data::grib {

namespace {

bool has_overlap(const Group& group) {
  std::set<std::array<double, 3>> seen;
  return std::any_of(group.fields.begin(), group.fields.end(), [&](const auto& one) {
    const Place& at = one.first;
    return !seen.insert({at[member_axis], at[time_axis], at[level_axis_index]}).second;
  });
}

std::vector<double> coordinates(const Group& group, std::size_t axis) {
  std::set<double> found;
  for (const auto& [place, field] : group.fields) found.insert(place.at(axis));
  return {found.begin(), found.end()};
}

// Groups with equal keys share the longest axis that contains theirs.
template <class Key>
void share_axis(std::vector<Group>& groups, std::size_t axis, std::size_t least, const Key& key,
                const char* what, std::vector<std::string>& notes) {
  std::map<decltype(key(groups.front())), std::vector<const Group*>> longest;
  for (const Group& group : groups) longest[key(group)].push_back(&group);
  std::map<const Group*, std::vector<double>> wider;
  for (auto& [one, list] : longest) {
    std::stable_sort(list.begin(), list.end(), [&](const Group* a, const Group* b) {
      return a->axes.at(axis).size() > b->axes.at(axis).size();
    });
    for (const Group* group : list) {
      const auto& own = group->axes.at(axis);
      if (own.size() < least || (group->is_constant && axis == time_axis)) continue;
      const auto contains = [&](const Group* other) {
        const auto& all = other->axes.at(axis);
        return all.size() > own.size() &&
               std::includes(all.begin(), all.end(), own.begin(), own.end());
      };
      const auto found = std::find_if(list.begin(), list.end(), contains);
      if (found != list.end()) wider[group] = (*found)->axes.at(axis);
    }
  }
  for (Group& group : groups) {
    const auto found = wider.find(&group);
    if (found == wider.end()) continue;
    auto& own = group.axes.at(axis);
    notes.push_back(in_quotes(group.header.short_name) + " has " + std::to_string(own.size()) +
                    " of " + std::to_string(found->second.size()) + " " + what +
                    ": others are masked");
    own = found->second;
  }
}

// "u" of "10u".
std::string without_height(const std::string& name) {
  return name.substr(std::min(name.find_first_not_of("0123456789"), name.size()));
}

bool is_wind_above_ground(const Group& group) {
  const std::string base = without_height(group.header.short_name);
  return group.header.level_type == "heightAboveGround" && (base == "u" || base == "v");
}

// Moves the fields of other groups to the first.
void unite(const std::vector<Group*>& list) {
  Group& first = *list.front();
  const bool east = without_height(first.header.short_name) == "u";
  first.header.short_name = east ? "u" : "v";
  first.names.name = east ? "U component of wind" : "V component of wind";
  first.names.standard_name = east ? "eastward_wind" : "northward_wind";
  for (auto other = list.begin() + 1; other != list.end(); ++other) {
    first.repeated += (*other)->repeated;
    for (const auto& [place, field] : (*other)->fields) {
      if (!first.fields.emplace(place, field).second) ++first.repeated;
    }
    (*other)->fields.clear();
  }
}

}  // namespace

void merge_heights(std::vector<Group>& groups) {
  using Key = std::tuple<std::string, std::string, std::size_t, bool>;
  std::map<Key, std::vector<Group*>> winds;
  for (Group& group : groups) {
    if (!is_wind_above_ground(group)) continue;
    const Header& header = group.header;
    const Key key(without_height(header.short_name), header.product.key, group.grid,
                  header.relative_to_grid);
    winds[key].push_back(&group);
  }
  constexpr std::size_t heights_of_a_column = 3;
  for (const auto& [key, list] : winds) {
    std::set<double> heights;
    for (const Group* group : list) {
      for (const auto& [place, field] : group->fields) heights.insert(place[level_axis_index]);
    }
    if (list.size() > 1 && heights.size() >= heights_of_a_column) {
      unite(list);
      continue;
    }
    for (Group* group : list) {
      const std::string& name = group->header.short_name;
      const std::string height = name.substr(0, name.size() - 1);
      if (list.size() > 1 && !height.empty()) group->height = height + "m";
    }
  }
  std::erase_if(groups, [](const Group& group) { return group.fields.empty(); });
}

bool tell_references(std::vector<Group>& groups) {
  const bool overlap = std::any_of(groups.begin(), groups.end(), has_overlap);
  for (Group& group : groups) {
    std::map<Place, std::size_t> fields;
    for (const auto& [place, field] : group.fields) {
      Place at = place;
      if (overlap) {
        at[time_axis] -= at[reference_axis];
      } else {
        at[reference_axis] = 0;
      }
      fields.emplace(at, field);
    }
    group.fields = std::move(fields);
  }
  return overlap;
}

void omit_incomplete_members(Group& group, std::vector<std::string>& notes) {
  std::map<double, std::size_t> counts;
  for (const auto& [place, field] : group.fields) ++counts[place[member_axis]];
  std::size_t most = 0;
  for (const auto& [member, count] : counts) most = std::max(most, count);
  std::string omitted;
  for (const auto& [member, count] : counts) {
    if (count == most) continue;
    omitted += (omitted.empty() ? "" : ", ") + std::to_string(static_cast<long>(member));
    std::erase_if(group.fields,
                  [at = member](const auto& one) { return one.first[member_axis] == at; });
  }
  if (omitted.empty()) return;
  notes.push_back(
      in_quotes(group.header.short_name) +
      ": members of the ensemble with fewer messages than others are omitted: " + omitted);
}

void find_axes(std::vector<Group>& groups, std::vector<std::string>& notes) {
  std::set<double> references;
  for (Group& group : groups) {
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      group.axes.at(axis) = coordinates(group, axis);
    }
    const auto& own = group.axes[reference_axis];
    if (!group.is_constant) references.insert(own.begin(), own.end());
  }
  for (Group& group : groups) {
    auto& own = group.axes[reference_axis];
    if (group.is_constant) continue;
    if (own.size() < references.size()) {
      notes.push_back(in_quotes(group.header.short_name) + " has " + std::to_string(own.size()) +
                      " of " + std::to_string(references.size()) +
                      " reference times: others are masked");
    }
    own.assign(references.begin(), references.end());
  }
  share_axis(
      groups, time_axis, 1, [](const Group& group) { return group.grid; }, "times", notes);
  share_axis(
      groups, level_axis_index, 2,
      [](const Group& group) { return std::pair(group.grid, group.header.level_type); }, "levels",
      notes);
}

void order(std::vector<Group>& groups) {
  std::stable_partition(groups.begin(), groups.end(),
                        [](const Group& group) { return group.header.product.key.empty(); });
  using Key = std::tuple<std::string, std::string, std::size_t>;
  const auto key = [](const Group& group) {
    return Key(group.header.short_name, group.header.level_type, group.grid);
  };
  std::map<Key, std::size_t> counts;
  for (const Group& group : groups) ++counts[key(group)];
  for (Group& group : groups) group.is_distinguished = counts[key(group)] > 1;
}

}  // namespace windsplat::data::grib
