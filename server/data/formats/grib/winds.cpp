// Words of descriptions, and prefixes of standard names.
#include "server/data/formats/grib/winds.hpp"

#include <array>
#include <cctype>
#include <cstddef>
#include <utility>

#include "server/base/ascii.hpp"

namespace windsplat::data::grib {

namespace {

constexpr std::string_view eastward = "eastward_";
constexpr std::string_view northward = "northward_";

// Lower-case words and numbers, joined by '_'.
std::string snake(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      out += c;
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  if (out.ends_with('_')) out.pop_back();
  return lower(out);
}

}  // namespace

std::string component_name(std::string_view description) {
  using Pattern = std::pair<std::string_view, std::string_view>;
  constexpr auto patterns = std::to_array<Pattern>({{"u_component_of_", eastward},
                                                    {"v_component_of_", northward},
                                                    {"x_component_of_", eastward},
                                                    {"y_component_of_", northward},
                                                    {"u_component_", eastward},
                                                    {"v_component_", northward},
                                                    {"eastward_", eastward},
                                                    {"northward_", northward}});
  std::string text = snake(description);
  if (text == "geometric_vertical_velocity") return "upward_air_velocity";
  for (const auto& [pattern, prefix] : patterns) {
    const std::size_t at = text.find(pattern);
    if (at == std::string::npos || (at > 0 && text[at - 1] != '_')) continue;
    text.erase(at, pattern.size());
    return text.empty() ? text : std::string(prefix) + text;
  }
  return {};
}

bool tell_by_grid(FileVariable& variable) {
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

}  // namespace windsplat::data::grib
