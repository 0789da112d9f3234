// Parameters change the view as its own keys would; preset and orbit follow once it is completed.
#include "server/api/pictures/frame_query.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/limits.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/step_of_time.hpp"
#include "server/scene/colormap.hpp"
#include "server/scene/defaults.hpp"

namespace windsplat::api {
namespace {

struct Part {
  std::string_view name;  // as the key of the view
  bool protocol::AnnotationsView::*shown;
};
using Annotations = protocol::AnnotationsView;
constexpr std::array parts{
    Part{"box", &Annotations::box},
    Part{"axes", &Annotations::axes},
    Part{"north", &Annotations::north},
    Part{"scaleBar", &Annotations::scale_bar},
    Part{"legend", &Annotations::legend},
    Part{"title", &Annotations::title},
    Part{"stepTime", &Annotations::step_time},
    Part{"contourLabels", &Annotations::contour_labels},
};

std::optional<Orbit> read_orbit(http::QueryReader& query) {
  const auto azimuth = read_number(query, parameters::azimuth);
  const auto elevation = read_number(query, parameters::elevation);
  const auto zoom = read_number(query, parameters::zoom);
  if (!azimuth && !elevation && !zoom) return std::nullopt;
  Orbit orbit;
  orbit.azimuth = azimuth.value_or(orbit.azimuth);
  orbit.elevation = elevation.value_or(orbit.elevation);
  orbit.zoom = zoom.value_or(orbit.zoom);
  return orbit;
}

// The parameters that change keys of the view; absent: unchanged.
struct Changes {
  std::optional<std::string> step;
  std::optional<std::string> width;
  std::optional<std::string> height;
  TimeQuery time;
  std::optional<std::string> fields;
  std::optional<std::string> color_map;
  std::optional<std::string> annotate;
};

Changes read_changes(http::QueryReader& query) {
  Changes out;
  out.step = query.integer(parameters::step.name);
  out.width = query.integer(parameters::width.name);
  out.height = query.integer(parameters::height.name);
  out.time = read_time(query);
  out.fields = read_text(query, parameters::drawn_fields);
  out.color_map = read_text(query, parameters::color_map);
  out.annotate = read_text(query, parameters::annotate);
  return out;
}

Error refuse_field(const std::string& why) {
  return make_error(ErrorKind::invalid, "query parameter 'field': " + why);
}

// The named fields, each once: at most one vector.
Result<std::vector<const data::FieldInfo*>> find_fields(const data::DatasetInfo& info,
                                                        const std::string& names) {
  std::vector<const data::FieldInfo*> out;
  std::size_t vectors = 0;
  for (const std::string_view name : http::split_list(names, ',')) {
    const data::FieldInfo* const field = info.find(std::string(name));
    if (field == nullptr) {
      return refuse_field("there is no field '" + printable(name, 60) + "'" +
                          data::absence_text(info, std::string(name)));
    }
    if (std::find(out.begin(), out.end(), field) != out.end()) {
      return refuse_field("'" + printable(name, 60) + "' is named twice");
    }
    out.push_back(field);
    vectors += field->kind == data::FieldKind::vector ? 1 : 0;
  }
  if (vectors > 1) return refuse_field("names more than one vector field");
  if (out.size() - vectors > std::size_t{protocol::limits::scalars_max}) {
    return refuse_field("names more than " + std::to_string(protocol::limits::scalars_max) +
                        " scalar fields");
  }
  return out;
}

// Draws these fields and no others: a vector as lines, scalars as media. What the view says of a
// medium or surface of one of them is kept.
Result<void> draw_fields(protocol::View& view, const data::DatasetInfo& info,
                         const std::string& names) {
  const auto fields = find_fields(info, names);
  if (!fields) return fields.error();
  view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  const auto before = view.scalars.value_or(std::vector<protocol::ScalarView>{});
  view.scalars.emplace();
  for (const data::FieldInfo* field : *fields) {
    if (field->kind == data::FieldKind::vector) {
      view.vector.field = {protocol::FieldChoice::Kind::named, field->name};
      continue;
    }
    const auto same = std::find_if(before.begin(), before.end(),
                                   [&](const auto& medium) { return medium.field == field->name; });
    view.scalars->push_back(same == before.end() ? protocol::ScalarView{} : *same);
    view.scalars->back().field = field->name;
  }
  std::erase_if(view.surfaces, [&](const protocol::SurfaceView& surface) {
    return std::none_of(fields->begin(), fields->end(),
                        [&](const data::FieldInfo* field) { return field->name == surface.field; });
  });
  return {};
}

// The map of all that is coloured by one: lines, media and surfaces.
Result<void> color_by(protocol::View& view, const data::DatasetInfo& info, const std::string& map) {
  if (!scene::has_color_map(map)) {
    std::string list;
    for (const scene::ColorMap& known : scene::color_maps()) {
      list += (list.empty() ? "" : ", ") + known.name;
    }
    return make_error(ErrorKind::invalid, "query parameter 'colormap': there is no map '" +
                                              printable(map, 60) + "'; maps: " + list);
  }
  view.vector.color.map = map;
  if (!view.scalars) {
    view.scalars.emplace();
    for (const std::string& name : scene::default_scalars(info)) {
      view.scalars->emplace_back().field = name;
    }
  }
  for (protocol::ScalarView& medium : *view.scalars) medium.color.map = map;
  for (protocol::SurfaceView& surface : view.surfaces) surface.color.map = map;
  return {};
}

// All annotations, none, or those of a list and no others.
Result<void> annotate(protocol::View& view, const std::string& asked) {
  const bool all = asked == "true" || asked == "1";
  for (const Part& part : parts) view.annotations.*part.shown = all;
  if (all || asked == "false" || asked == "0") return {};
  for (const std::string_view name : http::split_list(asked, ',')) {
    const auto* const part =
        std::find_if(parts.begin(), parts.end(), [&](const Part& one) { return one.name == name; });
    if (part == parts.end()) {
      std::string list;
      for (const Part& one : parts) list += ", " + std::string(one.name);
      return make_error(ErrorKind::invalid,
                        "query parameter 'annotate' must be true, false or a list of parts, not '" +
                            printable(name, 60) + "'; parts: " + list.substr(2));
    }
    view.annotations.*part->shown = true;
  }
  return {};
}

// The view with all changes.
Result<protocol::View> changed(const protocol::ViewDocument& base, const Changes& changes,
                               const data::DatasetInfo& info) {
  const auto document =
      base.patched(protocol::view_text(changes.step, changes.width, changes.height));
  if (!document) return document.error();
  protocol::View view = document->view();
  const auto step = step_of(changes.time, changes.step.has_value(), info);
  if (!step) return step.error();
  if (*step) view.step = static_cast<int>(**step);
  if (changes.fields) {
    if (const auto ok = draw_fields(view, info, *changes.fields); !ok) return ok.error();
  }
  if (changes.color_map) {
    if (const auto ok = color_by(view, info, *changes.color_map); !ok) return ok.error();
  }
  if (changes.annotate) {
    if (const auto ok = annotate(view, *changes.annotate); !ok) return ok.error();
  }
  return view;
}

}  // namespace

Result<std::optional<double>> read_dots_per_inch(http::QueryReader& query, frame::Format format) {
  auto out = read_number(query, parameters::dpi);
  if (out && (format == frame::Format::jpeg || format == frame::Format::npy)) {
    return make_error(ErrorKind::invalid,
                      "query parameter 'dpi' is of PNG, PDF and SVG; the picture asked for is "
                      "JPEG or NPY: see Accept, or the end of the address");
  }
  return out;
}

Result<Picture> read_picture(const http::Request& request, frame::Format format,
                             const protocol::ViewDocument& base, const data::DatasetInfo& info) {
  http::QueryReader query(request.query);
  Picture picture;
  picture.encoding.format = format;
  picture.encoding.quality = jpeg_quality_default;
  picture.encoding.describe = true;
  const Changes changes = read_changes(query);
  picture.orbit = read_orbit(query);
  picture.preset = read_text(query, parameters::preset).value_or("");
  if (format == frame::Format::jpeg) {
    picture.encoding.quality =
        read_integer(query, parameters::quality).value_or(jpeg_quality_default);
  }
  const auto dots_per_inch = read_dots_per_inch(query, format);
  if (const auto ok = query.finish(); !ok) return ok.error();
  if (!dots_per_inch) return dots_per_inch.error();
  picture.encoding.dots_per_inch = *dots_per_inch;
  auto view = changed(base, changes, info);
  if (!view) return view.error();
  picture.view = std::move(*view);
  return picture;
}

}  // namespace windsplat::api
