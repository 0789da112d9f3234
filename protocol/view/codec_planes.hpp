// Parts that several objects of a view have: layers, planes, ranges of colours <-> JSON tree.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

std::string number_text(double value);

template <std::size_t N>
Json numbers_to_json(const std::array<double, N>& values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(canonical_number(value));
  return out;
}

template <std::size_t N>
Json numbers_or_null(const std::optional<std::array<double, N>>& values) {
  return values ? numbers_to_json(*values) : Json(nullptr);
}

inline Json text_or_null(const std::optional<std::string>& value) {
  return value ? Json(*value) : Json(nullptr);
}

void check_direction(const Vec3& direction, const std::string& pointer, Faults& faults);
// Descending ranges reverse the map. The ends must differ enough for the slope to be finite.
void check_color_range(const std::optional<Range>& range, ObjectReader& reader);

SliceView read_slice(const Json& json, const std::string& pointer, Faults& faults);
PlaneView read_plane(const Json& json, const std::string& pointer, Faults& faults);
Json slice_to_json(const std::optional<SliceView>& slice);
Json plane_to_json(const std::optional<PlaneView>& plane);

}  // namespace windsplat::protocol
