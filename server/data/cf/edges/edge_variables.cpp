#include "server/data/cf/edges/edge_variables.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

bool has_any_part(const std::string& text, const std::vector<std::string_view>& parts) {
  return std::any_of(parts.begin(), parts.end(),
                     [&](std::string_view part) { return text.find(part) != std::string::npos; });
}

std::string text_about(const FileVariable& one) {
  return lower(one.name + ' ' + one.standard_name + ' ' + one.long_name);
}

// MPAS writes "m s^{-1}".
bool is_speed_on_mesh(const FileVariable& one) {
  return is_speed(one.units) || one.units == "m s^{-1}" || one.units.empty();
}

bool is_normal_component(const FileVariable& one, const Topology& topology) {
  if (!is_speed_on_mesh(one)) return false;
  const std::string name = lower(one.name);
  const bool is_mpas = topology.convention == "MPAS" && (name == "u" || name == "normalvelocity");
  const bool is_icon = topology.convention == "CF bounds" && name == "vn";
  return is_mpas || is_icon || lower(one.standard_name) == "normal_velocity";
}

// Models of the ocean: MPAS-Ocean, and levels that are depths.
bool is_in_water(const FileVariable& normal, const FileContents& contents) {
  return variable_named(contents, "layerThickness") >= 0 ||
         variable_named(contents, "refBottomDepth") >= 0 ||
         lower(normal.name) == "normalvelocity" ||
         std::any_of(normal.dims.begin(), normal.dims.end(), [&](int d) {
           return lower(contents.dimensions.at(at(d)).name).starts_with("depth");
         });
}

// The first component of a vector at the cells; -1 if there is none.
int vector_at_cells(const FileContents& contents, const std::vector<int>& cells) {
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& one = contents.variables[v];
    const bool is_there = std::any_of(one.dims.begin(), one.dims.end(), [&](int d) {
      return std::count(cells.begin(), cells.end(), d) > 0;
    });
    constexpr auto usual =
        std::to_array<std::string_view>({"ureconstructzonal", "velocityzonal", "u", "ucx"});
    const bool is_eastward = one.standard_name.starts_with("eastward_") &&
                             has_any_part(one.standard_name, {"wind", "velocity"});
    if (is_there && one.numeric && is_speed_on_mesh(one) &&
        (is_eastward || is_one_of(lower(one.name), usual))) {
      return static_cast<int>(v);
    }
  }
  return -1;
}

// Why values may depend on the direction of an edge or have no mean; empty if they do not.
std::string problem_of_scalar(const FileVariable& one) {
  const std::string units = lower(one.units);
  if (!one.type.starts_with("float") && !one.packed) return "whole numbers have no mean";
  if (units.empty()) return "without a unit, they may be components along each edge or its normal";
  const bool is_angle = units.starts_with("rad") || units.starts_with("deg");
  const bool is_temperature =
      has_any_part(units, {"celsius", "degc", "deg_c", "degf", "fahrenheit"});
  if (is_angle && !is_temperature) return "angles have no mean";
  const bool is_rate = has_any_part(
      units, {"s-1", "/s", "s^-1", "s^{-1}", "s**-1", "s-2", "s^{-2}", "/day", "day-1", "knot"});
  const bool is_of_flow =
      has_any_part(text_about(one), {"normal", "tangential", "component", "velocity", "flux",
                                     "discharge", "momentum", "transport", "gradient", "stress",
                                     "direction", "orientation", "wind", "current"});
  if (is_rate || is_of_flow) {
    return "they may be components along each edge or its normal, which have no mean";
  }
  return {};
}

}  // namespace

void EdgeNotes::add(const std::string& name, const EdgeUse& use) {
  const auto append = [&](std::string& told) {
    told += (told.empty() ? "" : ", ") + in_quotes(name);
  };
  append(use.is_normal ? normals_ : means_);
  if (use.missing == MissingNormal::wall) append(walls_);
}

void EdgeNotes::tell(std::vector<std::string>& notes) const {
  if (!means_.empty()) {
    notes.push_back("on the edges of the mesh, averaged to its cells: " + means_);
  }
  if (!normals_.empty()) {
    notes.push_back("normal to the edges of the mesh: " + normals_ +
                    "; drawn are the vectors at the cells whose components are nearest to these");
  }
  if (!walls_.empty()) {
    notes.push_back("missing components count as 0, the flow through a coast or the bottom: " +
                    walls_);
  }
}

EdgeUse use_of_edges(const FileVariable& variable, const FileContents& contents,
                     const std::vector<int>& cells, const Topology& topology,
                     const EdgeTables& tables) {
  const std::string place = "on the edges of the mesh: ";
  EdgeUse out;
  if (!tables.are_known()) {
    out.reason = place + "which cells they belong to is not in the file";
  } else if (is_normal_component(variable, topology)) {
    out.is_normal = true;
    if (is_in_water(variable, contents)) out.missing = MissingNormal::wall;
    const int vector = vector_at_cells(contents, cells);
    if (vector >= 0) {
      out.reason = place + "the file has vectors at the cells, with the component " +
                   in_quotes(contents.variables[at(vector)].name);
    } else if (!tables.have_normals()) {
      out.reason = place + "components along the normals of the edges, whose directions are not " +
                   "in the file";
    }
  } else if (const std::string problem = problem_of_scalar(variable); !problem.empty()) {
    out.reason = place + problem;
  }
  return out;
}

std::array<FileVariable, 2> components_of_normal(const FileVariable& normal,
                                                 const FileContents& contents, bool on_sphere) {
  const bool in_water = is_in_water(normal, contents);
  std::array<FileVariable, 2> out{normal, normal};
  for (const bool is_first : {true, false}) {
    FileVariable& one = out.at(is_first ? 0 : 1);
    const std::string axis = is_first ? "x" : "y";
    const std::string way = is_first ? "eastward" : "northward";
    one.name += '_' + (on_sphere ? way : axis);
    if (on_sphere) {
      one.standard_name = way + (in_water ? "_sea_water_velocity" : "_wind");
    } else {
      one.standard_name = in_water ? "sea_water_" + axis + "_velocity" : axis + "_wind";
    }
    one.long_name = (on_sphere ? way : axis) + " component from " + in_quotes(normal.name) +
                    " normal to the edges";
    if (!is_speed(one.units)) one.units = "m s-1";
  }
  return out;
}

}  // namespace windsplat::data::cf
