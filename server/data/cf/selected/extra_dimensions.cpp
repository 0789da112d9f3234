#include "server/data/cf/selected/extra_dimensions.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include "server/base/ascii.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/cf/grid/grid.hpp"

namespace windsplat::data::cf {

namespace {

// Which of several dimensions is the time axis of a variable: the highest.
enum class TimeRank { none, reference, time, lead };

bool is_corner(std::string_view name) {
  constexpr auto known_names = std::to_array<std::string_view>(
      {"bnds", "bounds", "nv", "nbnd", "nbnds", "vertices", "corners", "nvertex", "strlen", "bnd"});
  return is_one_of(lower(name), known_names);
}

class Search {
 public:
  Search(const FileContents& contents, const std::vector<bool>& fixed)
      : contents_(contents),
        fixed_(fixed),
        roles_(classify_dimensions(contents)),
        proposed_(fixed.size()),
        sure_(fixed.size()),
        used_(fixed.size()),
        times_(fixed.size()) {}

  ExtraDimensions run() {
    const std::vector<std::string> reasons = reasons_of_no_field(contents_, roles_);
    for (std::size_t v = 0; v < reasons.size(); ++v) {
      if (reasons[v].empty()) look_at(contents_.variables[v]);
    }
    ExtraDimensions out;
    for (std::size_t d = 0; d < fixed_.size(); ++d) {
      const bool chosen = proposed_[d] && (sure_[d] || !used_[d]);
      if (chosen) out.chosen.push_back(static_cast<int>(d));
      if (times_[d] && !chosen) out.times.push_back(static_cast<int>(d));
    }
    return out;
  }

 private:
  [[nodiscard]] Role role(int d) const { return roles_[at(d)].role; }
  [[nodiscard]] bool is_space(int d) const {
    return role(d) == Role::x || role(d) == Role::y || role(d) == Role::z;
  }

  [[nodiscard]] TimeRank time_rank(int d) const {
    if (is_lead_time(contents_, roles_, d)) return TimeRank::lead;
    if (role(d) == Role::time) return TimeRank::time;
    const int coordinate = roles_[at(d)].coordinate;
    const bool refers = coordinate >= 0 && contents_.variables[at(coordinate)].standard_name ==
                                               "forecast_reference_time";
    return refers ? TimeRank::reference : TimeRank::none;
  }

  // The dimension that is the time axis of a variable; -1: none.
  [[nodiscard]] int time_of(const std::vector<int>& dims) const {
    int time = -1;
    for (const int d : dims) {
      const TimeRank rank = time_rank(d);
      if (rank != TimeRank::none && (time < 0 || rank >= time_rank(time))) time = d;
    }
    const bool by_place = time < 0 && !dims.empty() && role(dims.front()) == Role::unknown &&
                          contents_.dimensions[at(dims.front())].unlimited;
    return by_place ? dims.front() : time;
  }

  void look_at(const FileVariable& variable) {
    std::vector<int> dims;
    for (const int d : variable.dims) {
      if (contents_.dimensions[at(d)].length > 1 && !fixed_[at(d)]) dims.push_back(d);
    }
    const int time = time_of(dims);
    std::ptrdiff_t known = 0;  // spatial dimensions
    std::vector<int> unknown;
    for (const int d : dims) {
      known += d != time && is_space(d) ? 1 : 0;
      if (d != time && role(d) == Role::unknown && time_rank(d) == TimeRank::none) {
        unknown.push_back(d);
      }
    }
    const auto has = [&](Role wanted) {
      return std::any_of(dims.begin(), dims.end(), [&](int d) { return role(d) == wanted; });
    };
    const auto all = known + static_cast<std::ptrdiff_t>(unknown.size());
    if (all < 2) return;
    const std::ptrdiff_t excess =
        has(Role::x) && has(Role::y) ? std::clamp<std::ptrdiff_t>(all - 3, 0, all - known) : 0;
    unknown.resize(static_cast<std::size_t>(excess));
    bool is_forecast = false;
    for (const int d : dims) {
      const bool by_time = d != time && time_rank(d) != TimeRank::none;
      const bool member = d != time && role(d) == Role::other && !roles_[at(d)].is_list &&
                          !is_corner(contents_.dimensions[at(d)].name);
      const bool surplus = std::find(unknown.begin(), unknown.end(), d) != unknown.end();
      is_forecast = is_forecast || by_time;
      if (by_time || member || surplus) {
        proposed_[at(d)] = true;
        sure_[at(d)] = sure_[at(d)] || (by_time && time_rank(time) == TimeRank::lead);
      } else {
        used_[at(d)] = true;
      }
    }
    if (time >= 0 && (is_forecast || role(time) != Role::time)) times_[at(time)] = true;
  }

  const FileContents& contents_;
  const std::vector<bool>& fixed_;
  std::vector<DimensionRole> roles_;
  std::vector<bool> proposed_;
  std::vector<bool> sure_;  // chosen even if another variable has it as its time
  std::vector<bool> used_;  // an axis of a variable
  std::vector<bool> times_;
};

}  // namespace

bool is_lead_time(const FileContents& contents, const std::vector<DimensionRole>& roles,
                  int dimension) {
  constexpr auto known_names = std::to_array<std::string_view>(
      {"step", "lead", "leads", "leadtime", "lead_time", "forecast_period", "forecast_hour",
       "fhour", "prognosis_period"});
  const DimensionRole& role = roles.at(at(dimension));
  if (role.role == Role::x || role.role == Role::y || role.role == Role::z) return false;
  if (role.coordinate >= 0) {
    const FileVariable& variable = contents.variables.at(at(role.coordinate));
    if (!variable.standard_name.empty()) return variable.standard_name == "forecast_period";
  }
  return is_one_of(lower(contents.dimensions.at(at(dimension)).name), known_names);
}

ExtraDimensions find_extra_dimensions(const FileContents& contents,
                                      const std::vector<bool>& fixed) {
  return Search(contents, fixed).run();
}

}  // namespace windsplat::data::cf
