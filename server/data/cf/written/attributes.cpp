#include "server/data/cf/written/attributes.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>

#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

WrittenAttributes with_texts(
    std::initializer_list<std::pair<const char*, std::string>> attributes) {
  WrittenAttributes out;
  for (const auto& [name, text] : attributes) {
    if (!text.empty()) out.emplace_back(name, text);
  }
  return out;
}

std::string component_standard_name(const DatasetInfo& info, const FieldInfo& field,
                                    std::size_t component) {
  if (field.kind == FieldKind::scalar) {
    return field.standard_name;
  }
  if (field.name != "wind") {
    return {};
  }
  const bool on_globe = info.grid.axes[0].kind == AxisKind::longitude;
  if (component == 0) {
    return on_globe ? "eastward_wind" : "x_wind";
  }
  if (component == 1) {
    return on_globe ? "northward_wind" : "y_wind";
  }
  const bool is_omega = pascals_per_second_in(field.component_units.at(2)).has_value();
  return std::string(is_omega ? omega_name : "upward_air_velocity");
}

void add_coordinates(const DatasetInfo& info, WrittenAttributes& to) {
  if (!info.grid.columns) return;
  const auto names = position_names(info);
  to.emplace_back("coordinates", names[0] + ' ' + names[1]);
}

std::string component_units(const FieldInfo& field, std::size_t component) {
  return component < field.component_units.size() ? field.component_units[component] : field.units;
}

}  // namespace

std::vector<WrittenVariable> written_variables(const DatasetInfo& info) {
  std::vector<WrittenVariable> out;
  for (const FieldKind kind : {FieldKind::vector, FieldKind::scalar}) {
    for (std::size_t f = 0; f < info.fields.size(); ++f) {
      if (info.fields[f].kind != kind || info.fields[f].derived) continue;
      for (std::size_t c = 0; c < info.fields[f].components.size(); ++c) {
        const std::string& name = info.fields[f].components[c];
        const bool is_planned = std::any_of(
            out.begin(), out.end(), [&](const WrittenVariable& v) { return v.name == name; });
        if (!is_planned) out.push_back({name, f, c});
      }
    }
  }
  return out;
}

WrittenAttributes dataset_attributes(const DatasetInfo& info) {
  return with_texts(
      {{"Conventions", "CF-1.8"},
       {"title", info.title},
       {"source", std::string("windsplat ") + WINDSPLAT_VERSION + ", " + info.source}});
}

bool has_times(const DatasetInfo& info) {
  return info.steps.size() > 1 || !info.time_units.empty();
}

WrittenAttributes time_attributes(const DatasetInfo& info) {
  return with_texts({{"axis", "T"},
                     {"standard_name", "time"},
                     {"units", info.time_units},
                     {"calendar", info.time_calendar}});
}

std::string axis_name(const DatasetInfo& info, std::size_t which) {
  constexpr std::array<const char*, 3> known_names{"x", "y", "z"};
  const std::string& name = info.grid.axes.at(which).name;
  return name.empty() ? known_names.at(which) : name;
}

// With the words of CF where the axis has none.
WrittenAttributes axis_attributes(const Axis& axis, std::size_t which) {
  constexpr std::array<const char*, 3> letters{"X", "Y", "Z"};
  std::string standard_name = axis.standard_name;
  std::string units = axis.units;
  std::string positive;
  const auto silent = [&](const char* name, const char* unit) {
    if (standard_name.empty()) standard_name = name;
    if (units.empty()) units = unit;
  };
  const bool falls =
      axis.coordinates.size() > 1 && axis.coordinates.back() < axis.coordinates.front();
  switch (axis.kind) {
    case AxisKind::longitude:
      silent("longitude", "degrees_east");
      break;
    case AxisKind::latitude:
      silent("latitude", "degrees_north");
      break;
    case AxisKind::pressure:
      silent("air_pressure", "hPa");
      positive = "down";
      break;
    case AxisKind::height:
      silent("height", "m");
      positive = "up";
      break;
    case AxisKind::depth:
      silent("depth", "m");
      positive = "down";
      break;
    case AxisKind::level:
      silent("", "level");
      positive = falls ? "down" : "up";
      break;
    case AxisKind::cartesian:
      break;
  }
  return with_texts({{"axis", letters.at(which)},
                     {"standard_name", standard_name},
                     {"units", units},
                     {"positive", positive}});
}

std::array<std::string, 2> position_names(const DatasetInfo& info) {
  const std::vector<WrittenVariable> variables = written_variables(info);
  const auto is_taken = [&](const std::string& name) {
    for (std::size_t a = 0; a < 3; ++a) {
      if (axis_name(info, a) == name) return true;
    }
    return std::any_of(variables.begin(), variables.end(),
                       [&](const WrittenVariable& v) { return v.name == name; });
  };
  std::array<std::string, 2> out{"longitude", "latitude"};
  for (std::string& name : out) {
    while (is_taken(name)) name += "_of_columns";
  }
  return out;
}

WrittenAttributes longitude_attributes() {
  return with_texts({{"standard_name", "longitude"}, {"units", "degrees_east"}});
}

WrittenAttributes latitude_attributes() {
  return with_texts({{"standard_name", "latitude"}, {"units", "degrees_north"}});
}

WrittenAttributes ground_attributes(const Ground& ground) {
  const bool land = ground.kind == GroundKind::land;
  return with_texts({{"standard_name", land ? "surface_altitude" : "sea_floor_depth_below_geoid"},
                     {"units", "m"},
                     {"positive", land ? "up" : "down"}});
}

WrittenAttributes variable_attributes(const DatasetInfo& info, const WrittenVariable& variable) {
  const FieldInfo& field = info.fields.at(variable.field);
  const bool scalar = field.kind == FieldKind::scalar;
  const std::string mark = field.name + ' ' + std::to_string(variable.component);
  return with_texts({{"units", component_units(field, variable.component)},
                     {"standard_name", component_standard_name(info, field, variable.component)},
                     {"long_name", scalar ? field.long_name : ""},
                     {"windsplat_vector", scalar ? "" : mark}});
}

WrittenAttributes placed_attributes(const DatasetInfo& info, const WrittenVariable& variable) {
  WrittenAttributes out = variable_attributes(info, variable);
  add_coordinates(info, out);
  return out;
}

WrittenAttributes mean_attributes(const DatasetInfo& info, const WrittenVariable& variable) {
  const FieldInfo& field = info.fields.at(variable.field);
  WrittenAttributes out;
  if (field.kind == FieldKind::scalar) {
    out = placed_attributes(info, variable);
  } else {
    const bool is_wind = field.name == "wind";
    out = with_texts({{"units", field.units},
                      {"standard_name", is_wind ? "wind_speed" : ""},
                      {"long_name", "magnitude of " + field.name}});
    add_coordinates(info, out);
  }
  out.emplace_back("cell_methods", "area: mean");
  return out;
}

}  // namespace windsplat::data::cf
