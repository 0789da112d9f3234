// Names and descriptions of a coordinate -> upward, downward or neither.
#include "server/data/cf/level_direction.hpp"

#include "server/base/ascii.hpp"

namespace windsplat::data::cf {

int direction_of_name(const std::string& standard_name) {
  const std::string& name = standard_name;
  if (name == "depth" || name.starts_with("depth_below_")) return -1;
  return name == "height" || name == "altitude" || name == "geopotential_height" ||
                 name.starts_with("height_above_")
             ? 1
             : 0;
}

int direction_of_levels(const FileVariable& variable) {
  const std::string text =
      lower(variable.name + ' ' + variable.long_name + ' ' + variable.standard_name);
  const auto says = [&](const char* word) { return text.find(word) != std::string::npos; };
  if (says("thick") || says("bounds") || says("bnds")) return 0;
  const std::string positive = lower(variable.positive);
  if (positive == "up" || positive == "down") return positive == "up" ? 1 : -1;
  if (const int known = direction_of_name(variable.standard_name); known != 0) return known;
  const bool is_depth = says("depth");
  const bool is_height = says("height") || says("altitude");
  return is_depth == is_height ? 0 : is_depth ? -1 : 1;
}

}  // namespace windsplat::data::cf
