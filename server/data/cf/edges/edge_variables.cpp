#include "server/data/cf/edges/edge_variables.hpp"

#include <algorithm>
#include <cstddef>
#include <iterator>
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

// Dimensions of a variable beside those that list cells or edges.
std::vector<int> other_dims(const FileVariable& one, const std::vector<int>& lists) {
  std::vector<int> out;
  std::copy_if(one.dims.begin(), one.dims.end(), std::back_inserter(out),
               [&](int d) { return std::count(lists.begin(), lists.end(), d) == 0; });
  return out;
}

// Whether these are the first and the second component of one vector, by their names.
bool are_partners(const FileVariable& first, const FileVariable& second) {
  constexpr std::string_view eastward = "eastward_";
  if (first.standard_name.starts_with(eastward) &&
      has_any_part(first.standard_name, {"wind", "velocity"})) {
    return second.standard_name == "northward_" + first.standard_name.substr(eastward.size());
  }
  constexpr auto usual = std::to_array<std::array<std::string_view, 2>>(
      {{"ureconstructzonal", "ureconstructmeridional"},
       {"velocityzonal", "velocitymeridional"},
       {"u", "v"},
       {"ucx", "ucy"}});
  return std::any_of(usual.begin(), usual.end(), [&](const auto& names) {
    return lower(first.name) == names[0] && lower(second.name) == names[1];
  });
}

// The first component of a vector at the cells, of the times and levels of the normal component;
// -1 if there is none.
int vector_at_cells(const FileVariable& normal, const FileContents& contents,
                    const ListsOfMesh& lists) {
  const std::vector<int> wanted = other_dims(normal, lists.edges);
  const auto fits = [&](const FileVariable& one) {
    return one.numeric && is_speed_on_mesh(one) && one.dims.size() == wanted.size() + 1 &&
           other_dims(one, lists.cells) == wanted;
  };
  const std::vector<FileVariable>& all = contents.variables;
  for (std::size_t v = 0; v < all.size(); ++v) {
    if (fits(all[v]) && std::any_of(all.begin(), all.end(), [&](const FileVariable& other) {
          return fits(other) && are_partners(all[v], other);
        })) {
      return static_cast<int>(v);
    }
  }
  return -1;
}

// Whether a name, description or unit says that values have a size but no direction.
bool is_quantity_without_direction(const FileVariable& one) {
  const std::string units = lower(one.units);
  const std::string text = text_about(one);
  constexpr auto of_temperature = std::to_array<std::string_view>(
      {"k", "kelvin", "c", "celsius", "degc", "deg_c", "degree_c", "degrees_c", "degree_celsius",
       "degrees_celsius", "degf", "deg_f", "fahrenheit"});
  constexpr auto of_mixtures = std::to_array<std::string_view>(
      {"%", "percent", "kg kg-1", "kg/kg", "kg kg^-1", "kg kg^{-1}", "kg kg**-1", "g kg-1", "g/kg",
       "kg m-3", "kg/m3", "kg m^-3", "kg m^{-3}", "kg m**-3", "psu"});
  if (is_one_of(units, of_temperature) || is_one_of(units, of_mixtures)) return true;
  if (metres_in(units)) {
    return has_any_part(text, {"depth", "thickness", "height", "altitude", "elevation"});
  }
  if (pascals_in(units)) return has_any_part(text, {"pressure"});
  return has_any_part(text, {"temperature", "salinity", "density", "humidity", "mixing ratio",
                             "mixing_ratio", "fraction", "concentration", "percent", "tracer"});
}

// Why values are not known to be without a direction, or have no mean; empty if neither.
std::string problem_of_scalar(const FileVariable& one) {
  const std::string units = lower(one.units);
  if (!one.type.starts_with("float") && !one.packed) return "whole numbers have no mean";
  if (units.empty()) return "without a unit, they may be components along each edge or its normal";
  const bool is_angle = units.starts_with("rad") || units.starts_with("deg");
  const bool is_temperature =
      has_any_part(units, {"celsius", "degc", "deg_c", "degree_c", "degrees_c", "degf", "deg_f"});
  if (is_angle && !is_temperature) return "angles have no mean";
  const bool is_rate = has_any_part(units, {"s-1", "/s", "s^-1", "s^{-1}", "s**-1", "s-2", "s^{-2}",
                                            "s^-2", "s**-2", "/day", "day-1", "/h", "h-1", "knot"});
  const bool has_direction = has_any_part(
      text_about(one),
      {"normal",     "tangential", "component",    "velocity", "flux",      "discharge",
       "momentum",   "transport",  "gradient",     "stress",   "direction", "orientation",
       "wind",       "current",    "displacement", "slope",    "tendency",  "difference",
       "derivative", "shear",      "advection"});
  if (is_rate || has_direction) {
    return "they may be components along each edge or its normal, which have no mean";
  }
  if (!is_quantity_without_direction(one)) {
    return "they may be components along each edge or its normal: neither names nor units say "
           "that they have no direction, as temperatures, depths and concentrations";
  }
  return {};
}

}  // namespace

const std::string& EdgeNotes::fault_of_tables(const ArrayFile& file, EdgeTables& tables,
                                              const Topology& topology, const Mesh& mesh,
                                              bool is_normal) {
  if (!fault_) {
    const auto fault = [&] {
      const auto read = read_edges(file, tables, topology, mesh);
      return read ? std::string() : "on the edges of the mesh: " + read.error().message;
    };
    fault_ = fault();
    if (!fault_->empty() && tables.have_normals()) {
      normals_fault_ = *fault_;
      tables.angle = -1;
      tables.normals = {-1, -1};
      fault_ = fault();
    }
  }
  return is_normal && !normals_fault_.empty() ? normals_fault_ : *fault_;
}

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
                     const ListsOfMesh& lists, const Topology& topology, const EdgeTables& tables) {
  const std::string place = "on the edges of the mesh: ";
  EdgeUse out;
  if (!tables.are_known()) {
    out.reason = place + "which cells they belong to is not in the file";
  } else if (is_normal_component(variable, topology)) {
    out.is_normal = true;
    if (is_in_water(variable, contents)) out.missing = MissingNormal::wall;
    const int vector = vector_at_cells(variable, contents, lists);
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
