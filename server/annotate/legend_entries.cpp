#include "server/annotate/legend_entries.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/annotate/axes.hpp"
#include "server/annotate/labels.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/annotate/section_text.hpp"
#include "server/data/model/stored.hpp"
#include "server/image/tone_map.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"

namespace windsplat::annotate {

double tick_middle(const Tick& tick) {
  const double half = 0.5 * std::min(width_of(tick.text, tick_size), strip_width);
  return std::clamp(tick.at * strip_width, half - tick_overhang,
                    strip_width + tick_overhang - half);
}

namespace {

using Range = std::array<double, 2>;

// `values`: least and greatest value shown.
std::array<bool, 2> beyond_ends(const Range& range, const std::array<float, 2>& values) {
  const double slack = 1e-6 * std::abs(range[1] - range[0]);
  const bool less = static_cast<double>(values[0]) < std::min(range[0], range[1]) - slack;
  const bool more = static_cast<double>(values[1]) > std::max(range[0], range[1]) + slack;
  return range[0] <= range[1] ? std::array{less, more} : std::array{more, less};
}

std::vector<Color> colors_of(const scene::ColorTable& table) {
  constexpr std::size_t shown = 64;
  std::vector<Color> colors;
  for (std::size_t n = 0; n < shown; ++n) {
    const std::size_t at = n * (table.entries.size() - 1) / (shown - 1);
    const auto& [red, green, blue] = table.entries[at];
    colors.push_back({image::srgb_from_linear(red), image::srgb_from_linear(green),
                      image::srgb_from_linear(blue), 1});
  }
  return colors;
}

std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

// How the legend says which end of a line is its head.
std::string end_ahead(const scene::VectorLayer& layer) {
  switch (layer.mark.shape) {
    case scene::LineShape::comet:
      return ", bright end ahead";
    case scene::LineShape::taper:
      return ", pointed end ahead";
    case scene::LineShape::arrow:
      return "";
    case scene::LineShape::line:
      break;
  }
  if (layer.head_desaturation > 0) return ", white end ahead";
  return layer.mark.tail_light < 1 ? ", bright end ahead" : "";
}

// What the values of a field are in this view.
std::string titled(const Subject& subject, const std::string& name) {
  return subject.completed.view().difference ? "difference of " + name : name;
}

std::string field_title(const Subject& subject, const data::FieldInfo* field,
                        const std::string& name) {
  constexpr std::size_t longest = 40;  // characters that fit over a strip
  if (field == nullptr || field->long_name.empty() || field->long_name.size() > longest) {
    return titled(subject, spaced(name));
  }
  return titled(subject, field->long_name);
}

// As many ticks as have room for their numbers, at most six.
std::vector<Tick> strip_ticks(const Range& range) {
  constexpr double apart = 0.7;
  for (int parts = 5;; --parts) {
    std::vector<Tick> ticks = even_ticks(range[0], range[1], parts);
    bool fits = true;
    for (std::size_t n = 1; n < ticks.size(); ++n) {
      const double room = std::abs(tick_middle(ticks[n]) - tick_middle(ticks[n - 1]));
      const double texts =
          width_of(ticks[n - 1].text, tick_size) + width_of(ticks[n].text, tick_size);
      if (0.5 * texts + apart > room) fits = false;
    }
    if (fits || parts == 1) return ticks;
  }
}

// Bearings towards which lines point. Ticks are at quarters of the compass if two or more fit.
std::vector<Tick> compass_ticks(const Range& range) {
  static constexpr std::array<const char*, 4> quarters{"N", "E", "S", "W"};
  constexpr double quarter = 90;
  const double least = std::min(range[0], range[1]);
  const double first = std::ceil(least / quarter - 1e-9);
  std::vector<Tick> ticks;
  for (int n = 0; n < 9; ++n) {
    const double value = (first + n) * quarter;
    if (value > std::max(range[0], range[1]) + 1e-6) break;
    const auto name = static_cast<std::size_t>(std::fmod(std::fmod(first + n, 4) + 4, 4));
    ticks.push_back({value, (value - range[0]) / (range[1] - range[0]), quarters.at(name)});
  }
  if (ticks.size() >= 2) return ticks;
  ticks = strip_ticks(range);
  for (Tick& tick : ticks) tick.text += "\u00b0";
  return ticks;
}

// What the ends of a strip mean whose values are world units, which say nothing of the data.
std::string ends_text(const Range& range, const std::string& low, const std::string& high) {
  const bool ascends = range[0] <= range[1];
  return "from " + (ascends ? low : high) + " to " + (ascends ? high : low);
}

// Colours by world height: the coordinates of the vertical axis where it has some.
void set_heights(const Subject& subject, const Range& range, LegendEntry& entry) {
  const auto map = axis_map(subject, 2);
  const data::Axis axis = drawn_axis(subject, 2);
  entry.ticks.clear();
  if (!map || map->single()) {
    entry.title += "height";
    entry.notes.push_back(ends_text(range, "low", "high"));
    return;
  }
  constexpr double gap = 0.17;
  const auto place = [&](double value) {
    return (map->position(value) - range[0]) / (range[1] - range[0]);
  };
  // Only coordinates of the data: beyond them the colours have no value.
  const auto& world = subject.completed.lattice().positions[2];
  const double low = map->value(std::clamp(range[0], world.front(), world.back()));
  const double high = map->value(std::clamp(range[1], world.front(), world.back()));
  entry.ticks = uneven_ticks(low, high, gap, place);
  entry.title += axis.kind == data::AxisKind::pressure ? "pressure"
                 : axis.kind == data::AxisKind::depth  ? "depth"
                 : axis.kind == data::AxisKind::height ? "height"
                                                       : spaced(axis.name);
  entry.units = unit_text(axis.units);
}

// How lines differ from the colours of the strip besides their heads; empty: they do not.
std::string fading_text(const scene::Scene& scene) {
  std::vector<std::string> by;
  if (scene.vector->magnitude_intensity > 0) by.emplace_back("weaker");
  if (scene.depth_cue.strength > 0) by.emplace_back("farther");
  if (by.empty()) return {};
  return (by.size() == 1 ? by[0] : by[0] + " and " + by[1]) + " lines are darker";
}

// Of the whole field at the step, of which a part of the samples may be held.
std::array<float, 2> range_of(const Subject& subject, const std::string& name,
                              const data::Volume& held) {
  const scene::Scene& scene = subject.scene;
  const data::FieldInfo* const field = subject.info.find(name);
  const bool middles =
      scene.vector && scene.vector->field.get() == &held && scene.vector->field_stride > 1;
  const bool all = !scene.lattice.part && !middles;
  if (all || scene.level != std::array{0, 0, 0} || field == nullptr) return held.range;
  const auto index = static_cast<std::size_t>(field - subject.info.fields.data());
  const auto step = static_cast<std::size_t>(subject.completed.view().step);
  const auto* const stored = data::stored_range(subject.info, index, step);
  return stored == nullptr ? held.range : stored->range;
}

// Of the lines that are drawn.
std::array<float, 2> drawn_magnitudes(const Subject& subject, const scene::VectorLayer& layer) {
  const auto [least, most] =
      range_of(subject, subject.completed.view().vector.field.name, *layer.field);
  return {std::max(least, static_cast<float>(layer.min_magnitude)), most};
}

// How many of the lines drawn have colours that end before their magnitudes.
std::string beyond_text(const scene::VectorLayer& layer, double top) {
  const double drawn = 1 - scene::hidden_share(layer.min_magnitude, *layer.field);
  const double beyond = 1 - scene::hidden_share(top, *layer.field);
  const double percent = drawn > 0 ? 100 * beyond / drawn : 0;
  constexpr double least_percent = 0.1;
  const std::string share =
      percent < least_percent ? "less than 0.1" : number_text_of(std::min(percent, 100.0), 2);
  return share + " % of the lines lie beyond";
}

LegendEntry lines_entry(const Subject& subject) {
  const scene::VectorLayer& layer = *subject.scene.vector;
  const protocol::VectorView& vector = subject.completed.view().vector;
  const data::FieldInfo* const field = subject.info.find(vector.field.name);
  const std::string units = field == nullptr ? std::string() : unit_text(field->units);
  const Range& range = layer.color.range;
  const bool seeded = vector.trace && vector.trace->seeds;
  LegendEntry entry;
  entry.colors = colors_of(layer.color);
  entry.ticks = strip_ticks(range);
  entry.title = titled(subject, spaced(vector.field.name)) + ": ";
  using scene::LineColor;
  switch (layer.color_by) {
    case LineColor::world_z:
      set_heights(subject, range, entry);
      break;
    case LineColor::screen_z:
      entry.title += "distance from the eye";
      entry.ticks.clear();
      entry.notes.push_back(ends_text(range, "near", "far"));
      break;
    case LineColor::rise: {
      const auto percent = static_cast<int>(std::lround(100 * layer.rise_weight));
      entry.title += percent == 100 ? "rise" : "height and rise";
      entry.ticks.clear();
      entry.notes.push_back(percent == 100
                                ? ends_text(range, "sinking", "rising")
                                : ends_text(range, "low and sinking", "high and rising"));
      if (percent < 100) {
        entry.notes.push_back(std::to_string(percent) + " % rise, " +
                              std::to_string(100 - percent) + " % height in the box");
      }
      break;
    }
    case LineColor::magnitude:
      entry.title += "magnitude";
      entry.units = units;
      entry.beyond = beyond_ends(range, drawn_magnitudes(subject, layer));
      // Lines through seeds are too few to count by the values of all samples.
      if (range[0] <= range[1] && entry.beyond[1] && !seeded) {
        entry.notes.push_back(beyond_text(layer, range[1]));
      }
      break;
    case LineColor::direction:
      entry.title += "direction";
      entry.units = "towards";
      entry.ticks = compass_ticks(range);
      break;
    case LineColor::scalar: {
      const std::string name = vector.color.field.value_or("");
      const data::FieldInfo* const scalar = subject.info.find(name);
      entry.title += field_title(subject, scalar, name);
      entry.units = scalar == nullptr ? std::string() : unit_text(scalar->units);
      if (layer.color_field)
        entry.beyond = beyond_ends(range, range_of(subject, name, *layer.color_field));
      break;
    }
    case LineColor::constant:
      entry.title = titled(subject, spaced(vector.field.name));
      entry.ticks.clear();
      break;
  }
  const auto with_units = [&units](double value) {
    return number_text_of(value, 3) + (units.empty() ? "" : " " + units);
  };
  // Lines through seeds are as long as they are followed.
  std::string note =
      seeded ? std::string() : "longest line " + with_units(layer.magnitude_range[1]);
  note += end_ahead(layer);
  if (seeded && !note.empty()) note.erase(0, std::string_view(", ").size());
  if (!note.empty()) entry.notes.push_back(note);
  if (!vector.color.true_colors && layer.color_by != LineColor::constant) {
    const std::string why = fading_text(subject.scene);
    if (!why.empty()) entry.notes.push_back(why);
  }
  if (layer.min_magnitude > 0) {
    entry.notes.push_back("below " + with_units(layer.min_magnitude) + " not drawn");
  }
  return entry;
}

// The curve of a medium's extinction over its strip, highest at the greatest extinction.
std::vector<Point> opacity_curve(const scene::ScalarLayer& layer, double most) {
  const double low = layer.color.range[0];
  const double high = layer.color.range[1];
  std::vector<Point> curve;
  const auto at = [&](std::size_t n) {
    const double x = (layer.extinction[n][0] - low) / (high - low);
    return Point{std::clamp(x, -1.0, 2.0), layer.extinction[n][1] / most};
  };
  for (std::size_t n = 0; n < layer.extinction.size(); ++n) curve.push_back(at(n));
  if (high < low) std::reverse(curve.begin(), curve.end());
  curve.insert(curve.begin(), {std::min(0.0, curve.front().x), curve.front().y});
  curve.push_back({std::max(1.0, curve.back().x), curve.back().y});
  return curve;
}

// The values of the field, without those that are transparent at an end of the opacity curve.
std::array<float, 2> drawn_values(const Subject& subject, const scene::ScalarLayer& layer,
                                  const std::string& name) {
  auto [least, most] = range_of(subject, name, *layer.field);
  const auto& curve = layer.extinction;
  if (curve.empty()) return {least, most};
  if (curve.front()[1] <= 0) least = std::max(least, static_cast<float>(curve.front()[0]));
  if (curve.back()[1] <= 0) most = std::min(most, static_cast<float>(curve.back()[0]));
  return {least, most};
}

LegendEntry medium_entry(const Subject& subject, const scene::ScalarLayer& layer,
                         const std::string& name) {
  const data::FieldInfo* const field = subject.info.find(name);
  LegendEntry entry;
  entry.title = field_title(subject, field, name);
  entry.units = field == nullptr ? std::string() : unit_text(field->units);
  entry.colors = colors_of(layer.color);
  entry.ticks = strip_ticks(layer.color.range);
  entry.beyond = beyond_ends(layer.color.range, drawn_values(subject, layer, name));
  double most = 0;
  for (const auto& [value, extinction] : layer.extinction) most = std::max(most, extinction);
  if (most > 0) {
    entry.opacity = opacity_curve(layer, most);
    entry.notes.push_back("curve: opacity, from none to the greatest");
  } else {
    entry.notes.emplace_back("transparent");
  }
  return entry;
}

// Least and greatest value on the surface; nullopt: none.
std::optional<std::array<float, 2>> values_on(const surface::Mesh& mesh) {
  std::optional<std::array<float, 2>> values;
  for (const float value : mesh.values) {
    if (std::isnan(value)) continue;
    if (!values) values = std::array{value, value};
    values = std::array{std::min((*values)[0], value), std::max((*values)[1], value)};
  }
  return values;
}

// "contours every 5 K and at 273.15 K".
std::string contours_text(const protocol::ContoursView& contours, const std::string& units) {
  const std::string unit = units.empty() ? "" : " " + units;
  std::string text = "contours";
  if (contours.interval) text += " every " + number_text_of(*contours.interval, 3) + unit;
  if (contours.levels.empty()) return text;
  text += contours.interval ? " and at " : " at ";
  constexpr std::size_t levels_named = 4;
  const std::size_t count = contours.levels.size();
  if (count > levels_named) {
    return text + std::to_string(count) + " levels from " +
           number_text_of(contours.levels.front(), 6) + " to " +
           number_text_of(contours.levels.back(), 6) + unit;
  }
  for (std::size_t n = 0; n < count; ++n) {
    text += (n == 0 ? "" : ", ") + number_text_of(contours.levels[n], 6);
  }
  return text + unit;
}

LegendEntry surface_entry(const Subject& subject, const surface::Shown& shown,
                          const protocol::SurfaceView& view) {
  const auto unit_of = [](const data::FieldInfo* field) {
    return field == nullptr ? std::string() : unit_text(field->units);
  };
  const std::string name = scene::color_field_of(view);
  const data::FieldInfo* const cut = subject.info.find(view.field);
  const data::FieldInfo* const field = subject.info.find(name);
  const std::string cut_title = field_title(subject, cut, view.field);
  LegendEntry entry;
  entry.title = name.empty() ? cut_title : field_title(subject, field, name);
  entry.colors = colors_of({shown.range, shown.colors});
  if (!name.empty()) {
    entry.units = unit_of(field);
    entry.ticks = strip_ticks(shown.range);
    if (const auto values = values_on(*shown.mesh)) {
      entry.beyond = beyond_ends(shown.range, *values);
    }
  }
  if (view.isovalue) {
    const std::string units = unit_of(cut);
    entry.notes.push_back("surface where " + (name.empty() ? "it" : cut_title) + " is " +
                          number_text_of(*view.isovalue, 4) + (units.empty() ? "" : " " + units));
  } else {
    entry.notes.push_back(view.plane ? section_text(subject, *view.plane)
                                     : section_text(subject, *view.slice));
  }
  if (view.contours) entry.notes.push_back(contours_text(*view.contours, entry.units));
  if (shown.mesh->triangles.empty()) {
    entry.notes.emplace_back("nothing of it lies in the data shown");
  }
  return entry;
}

}  // namespace

// The layers of the scene correspond to those of the view, without media of zero extinction and
// surfaces that are not seen.
std::vector<LegendEntry> legend_entries(const Subject& subject) {
  std::vector<LegendEntry> entries;
  const auto section = section_of_view(subject);
  const auto add_section = [&section](LegendEntry& entry) {
    if (section) entry.notes.insert(entry.notes.begin(), *section);
  };
  if (subject.scene.vector) {
    entries.push_back(lines_entry(subject));
    add_section(entries.back());
  }
  auto layer = subject.scene.scalars.begin();
  for (const protocol::ScalarView& scalar : subject.completed.view().scalars.value()) {
    if (layer == subject.scene.scalars.end()) break;
    if (layer->extinction != scalar.extinction.value()) continue;
    entries.push_back(medium_entry(subject, *layer, scalar.field));
    add_section(entries.back());
    ++layer;
  }
  auto shown = subject.scene.surfaces.begin();
  for (const protocol::SurfaceView& surface : subject.completed.view().surfaces) {
    if (shown == subject.scene.surfaces.end()) break;
    if (scene::is_seen(surface)) entries.push_back(surface_entry(subject, *shown++, surface));
  }
  return entries;
}

}  // namespace windsplat::annotate
