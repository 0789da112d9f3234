#include "protocol/view/codec_surfaces.hpp"

#include "protocol/limits.hpp"
#include "protocol/view/codec_planes.hpp"

namespace windsplat::protocol {

namespace {

using limits::value_max;

SurfaceColorView read_surface_color(const Json& json, const std::string& pointer, Faults& faults) {
  SurfaceColorView color;
  ObjectReader reader(json, pointer, faults);
  reader.text("map", color.map, 1);
  reader.text("field", color.field, 1);
  reader.numbers("range", color.range, {-value_max, value_max});
  reader.color("constant", color.constant);
  reader.finish();
  check_color_range(color.range, reader);
  return color;
}

std::vector<double> read_levels(const Json& json, const std::string& pointer, Faults& faults) {
  std::vector<double> levels;
  if (!json.is_array() || json.size() > static_cast<std::size_t>(limits::contour_levels_max)) {
    faults.add(pointer,
               "must be an array of at most " + std::to_string(limits::contour_levels_max) +
                   " values, not " +
                   (json.is_array() ? "of " + std::to_string(json.size()) : described(json)));
    return levels;
  }
  for (std::size_t i = 0; i < json.size(); ++i) {
    const std::string at = join_pointer(pointer, i);
    const auto level = read_number(json[i], at, {-value_max, value_max}, faults);
    if (!level) continue;
    if (!levels.empty() && *level <= levels.back()) {
      faults.add(at, "must be greater than the previous level");
    }
    levels.push_back(*level);
  }
  return levels;
}

ContoursView read_contours(const Json& json, const std::string& pointer, Faults& faults) {
  ContoursView contours;
  ObjectReader reader(json, pointer, faults);
  const std::size_t before = faults.count();
  reader.number("interval", contours.interval, {limits::range_width_min, value_max});
  if (const Json* levels = reader.child("levels")) {
    contours.levels = read_levels(*levels, reader.at("levels"), faults);
  }
  if (faults.count() == before && !contours.interval && contours.levels.empty()) {
    faults.add(pointer, "must have an interval, levels, or both");
  }
  reader.number("lineWidth", contours.line_width, {0, limits::radius_max});
  reader.color("lineColor", contours.line_color);
  reader.finish();
  return contours;
}

SurfaceView read_surface(const Json& json, const std::string& pointer, Faults& faults) {
  SurfaceView surface;
  ObjectReader reader(json, pointer, faults);
  reader.text("field", surface.field, 1, Presence::required);
  const std::size_t before = faults.count();
  reader.number("isovalue", surface.isovalue, {-value_max, value_max});
  if (const Json* slice = reader.child("slice", Presence::optional, Null::is_default)) {
    surface.slice = read_slice(*slice, reader.at("slice"), faults);
  }
  if (const Json* plane = reader.child("plane", Presence::optional, Null::is_default)) {
    surface.plane = read_plane(*plane, reader.at("plane"), faults);
  }
  const int cuts = int{surface.isovalue.has_value()} + int{surface.slice.has_value()} +
                   int{surface.plane.has_value()};
  if (faults.count() == before && cuts != 1) {
    faults.add(pointer, "must have one of isovalue, slice and plane, not " + std::to_string(cuts));
  }
  reader.number("opacity", surface.opacity, {0, 1});
  if (const Json* color = reader.child("color")) {
    surface.color = read_surface_color(*color, reader.at("color"), faults);
  }
  if (const Json* contours = reader.child("contours", Presence::optional, Null::is_default)) {
    surface.contours = read_contours(*contours, reader.at("contours"), faults);
  }
  reader.finish();
  if (surface.contours && surface.isovalue && !surface.color.field) {
    faults.add(reader.at("contours"),
               "requires color.field: an isosurface has one value of its own field");
  }
  return surface;
}

Json surface_to_json(const SurfaceView& surface) {
  Json contours;
  if (surface.contours) {
    Json levels = Json::array();
    for (const double level : surface.contours->levels) levels.push_back(canonical_number(level));
    contours = {{"interval", number_or_null(surface.contours->interval)},
                {"levels", std::move(levels)},
                {"lineWidth", canonical_number(surface.contours->line_width)},
                {"lineColor", surface.contours->line_color}};
  }
  return Json{{"field", surface.field},
              {"isovalue", number_or_null(surface.isovalue)},
              {"slice", slice_to_json(surface.slice)},
              {"plane", plane_to_json(surface.plane)},
              {"opacity", canonical_number(surface.opacity)},
              {"color",
               {{"map", surface.color.map},
                {"field", text_or_null(surface.color.field)},
                {"range", numbers_or_null(surface.color.range)},
                {"constant", surface.color.constant}}},
              {"contours", std::move(contours)}};
}

}  // namespace

std::vector<SurfaceView> read_surfaces(const Json& json, const std::string& pointer,
                                       Faults& faults) {
  std::vector<SurfaceView> surfaces;
  if (!json.is_array() || json.size() > static_cast<std::size_t>(limits::surfaces_max)) {
    faults.add(pointer,
               "must be an array of at most " + std::to_string(limits::surfaces_max) +
                   " surfaces, not " +
                   (json.is_array() ? "of " + std::to_string(json.size()) : described(json)));
    return surfaces;
  }
  for (std::size_t i = 0; i < json.size(); ++i) {
    surfaces.push_back(read_surface(json[i], join_pointer(pointer, i), faults));
  }
  return surfaces;
}

Json surfaces_to_json(const std::vector<SurfaceView>& surfaces) {
  Json out = Json::array();
  for (const SurfaceView& surface : surfaces) out.push_back(surface_to_json(surface));
  return out;
}

}  // namespace windsplat::protocol
