#include "server/data/cf/mesh/position_checks.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <string>
#include <string_view>

#include "server/base/ascii.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"

namespace windsplat::data::cf {

Result<void> check_one_time(const ArrayFile& file, int list) {
  const auto& all = file.contents().variables;
  for (std::size_t v = 0; v < all.size(); ++v) {
    const FileVariable& one = all[v];
    if (one.dims != std::vector{list}) continue;
    const std::string role = lower(one.cf_role);
    bool differs = role == "trajectory_id" || role == "profile_id";
    if (!differs && one.numeric && lower(one.units).find(" since ") != std::string::npos) {
      auto values = unpacked_values(file, static_cast<int>(v));
      if (!values) return values.error();
      std::erase_if(*values, [](double time) { return !std::isfinite(time); });
      differs = std::adjacent_find(values->begin(), values->end(), std::not_equal_to<>()) !=
                values->end();
    }
    if (!differs) continue;
    return make_error(ErrorKind::bad_data,
                      "the positions without outlines are those of trajectories or profiles: " +
                          in_quotes(one.name) + " tells them apart, and they are not one instant");
  }
  return {};
}

bool are_radians(const std::array<std::vector<double>, 2>& positions) {
  constexpr double close = 0.95;
  std::array<double, 2> least{1e9, 1e9};
  std::array<double, 2> most{-1e9, -1e9};
  for (std::size_t a = 0; a < 2; ++a) {
    for (const double value : positions.at(a)) {
      least.at(a) = std::min(least.at(a), value);
      most.at(a) = std::max(most.at(a), value);
    }
  }
  const auto spans = [&](std::size_t a, double whole) {
    const double span = most.at(a) - least.at(a);
    return span > close * whole && span < whole + 1e-5;
  };
  constexpr double half_turn = std::numbers::pi;
  return spans(0, 2 * half_turn) && spans(1, half_turn) && most[1] < half_turn / 2 + 1e-5;
}

bool is_unitless(std::string_view units) { return units.empty() || units == "1" || units == "-"; }

Result<void> check_units(const FileContents& contents, const std::array<int, 2>& variables,
                         const std::array<std::vector<double>, 2>& positions) {
  const auto& all = contents.variables;
  const std::array limits{2 * std::numbers::pi, std::numbers::pi / 2};
  std::array<bool, 2> open{};  // could be degrees or radians
  bool in_radians = false;
  for (std::size_t a = 0; a < 2; ++a) {
    const FileVariable& one = all.at(at(variables.at(a)));
    bool has_units = false;
    for (const FileVariable& other : all) {
      if (is_unitless(other.units) || (&other != &one && other.bounds != one.name)) continue;
      has_units = true;
      in_radians = in_radians || is_radian(other.units);
    }
    const bool is_degrees =
        std::any_of(positions.at(a).begin(), positions.at(a).end(),
                    [&](double value) { return std::abs(value) > limits.at(a) + 1e-5; });
    open.at(a) = !has_units && !is_degrees;
  }
  const bool is_ambiguous = in_radians ? open[0] || open[1] : open[0] && open[1];
  if (!is_ambiguous) return {};
  return make_error(ErrorKind::bad_data,
                    "the positions in " + in_quotes(all.at(at(variables[0])).name) + " and " +
                        in_quotes(all.at(at(variables[1])).name) +
                        " have no units and could be degrees or radians: they need the attribute "
                        "'units', such as degrees_east and degrees_north, or radian");
}

}  // namespace windsplat::data::cf
