// Evidence for a mesh: each convention in turn.
#include "server/data/cf/mesh/topology.hpp"

#include <algorithm>
#include <sstream>
#include <string_view>

#include "server/base/ascii.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/grid/cell_lists.hpp"
#include "server/data/cf/grid/grid.hpp"
#include "server/data/cf/mesh/delaunay.hpp"

namespace windsplat::data::cf {

namespace {

class TopologyFinder {
 public:
  explicit TopologyFinder(const ArrayFile& file) : file_(file), contents_(file.contents()) {}

  std::optional<Topology> find() {
    for (auto finder : {&TopologyFinder::ugrid, &TopologyFinder::mpas, &TopologyFinder::fvcom,
                        &TopologyFinder::fesom, &TopologyFinder::bounds, &TopologyFinder::scrip,
                        &TopologyFinder::centers}) {
      auto found = (this->*finder)();
      if (found) return found;
    }
    return std::nullopt;
  }

 private:
  using Found = std::optional<Topology>;

  [[nodiscard]] const FileVariable& variable(int v) const { return contents_.variables.at(at(v)); }
  [[nodiscard]] std::size_t length(int d) const { return contents_.dimensions.at(at(d)).length; }

  // A numeric variable of that name and number of dimensions; -1 if there is none.
  [[nodiscard]] int numeric(std::string_view name, std::size_t rank) const {
    const int v = name.empty() ? -1 : variable_named(contents_, name);
    return v >= 0 && variable(v).numeric && variable(v).dims.size() == rank ? v : -1;
  }

  [[nodiscard]] std::vector<int> named_in(int owner, const char* attribute) const {
    std::istringstream words(file_.text_of(owner, attribute));
    std::vector<int> out;
    for (std::string word; words >> word;) {
      const int v = variable_named(contents_, word);
      if (v >= 0) out.push_back(v);
    }
    return out;
  }

  // Longitude and latitude of a list of positions, otherwise its first two.
  void set_positions(const std::vector<int>& listed, Topology& out) const {
    std::array<int, 2> angles{-1, -1};
    std::vector<int> plane;
    for (const int v : listed) {
      if (!variable(v).numeric || variable(v).dims.size() != 1) continue;
      const int side = side_of(variable(v));
      if (side == 0) plane.push_back(v);
      if (side != 0 && angles.at(side < 0 ? 0 : 1) < 0) angles.at(side < 0 ? 0 : 1) = v;
    }
    if (plane.size() >= 2) out.plane_positions = {plane[0], plane[1]};
    out.on_sphere = angles[0] >= 0 && angles[1] >= 0;
    out.node_positions = out.on_sphere ? angles : out.plane_positions;
  }

  // Takes cells and corners of `connectivity`: the dimension of its cells is `cells` or, if that is
  // -1, the longer one.
  [[nodiscard]] bool set_connectivity(int connectivity, int cells, Topology& out) const {
    const std::vector<int>& dims = variable(connectivity).dims;
    if (cells < 0) cells = length(dims[0]) >= length(dims[1]) ? dims[0] : dims[1];
    if (cells != dims[0] && cells != dims[1]) return false;
    out.connectivity = connectivity;
    out.cells = cells;
    if (out.node_positions[0] < 0) return false;
    out.nodes = variable(out.node_positions[0]).dims[0];
    return out.nodes != out.cells && variable(out.node_positions[1]).dims[0] == out.nodes;
  }

  // UGRID 1.0, 2D triangular and flexible mesh topology.
  Found ugrid() {
    Found best;
    std::ptrdiff_t most = -1;
    for (std::size_t v = 0; v < contents_.variables.size(); ++v) {
      const int mesh = static_cast<int>(v);
      if (lower(variable(mesh).cf_role) != "mesh_topology") continue;
      const auto rank = file_.numbers(mesh, "topology_dimension").values;
      if (rank.size() != 1 || rank[0] != 2) continue;
      Topology out;
      out.convention = "UGRID";
      set_positions(named_in(mesh, "node_coordinates"), out);
      const int cells = numeric(lower_free(file_.text_of(mesh, "face_node_connectivity")), 2);
      if (cells < 0 || !set_connectivity(cells, faces_of(mesh, cells), out)) continue;
      const auto first = file_.numbers(cells, "start_index").values;
      out.start_index = first.empty() ? 0 : first[0];
      out.start_is_assumed = first.empty();
      out.edges = edges_of(mesh);
      out.others = {mesh};
      for (const char* attribute :
           {"node_coordinates", "face_coordinates", "edge_coordinates", "edge_node_connectivity",
            "face_edge_connectivity", "face_face_connectivity", "edge_face_connectivity",
            "boundary_node_connectivity"}) {
        for (const int other : named_in(mesh, attribute)) out.others.push_back(other);
      }
      const auto uses = std::count_if(
          contents_.variables.begin(), contents_.variables.end(), [&](const FileVariable& one) {
            return std::count(one.dims.begin(), one.dims.end(), out.cells) > 0 ||
                   std::count(one.dims.begin(), one.dims.end(), out.nodes) > 0;
          });
      if (uses > most) {
        most = uses;
        best = std::move(out);
      }
    }
    return best;
  }

  [[nodiscard]] static std::string lower_free(const std::string& text) {
    return text.substr(0, text.find(' '));
  }

  // The first dimension of the table unless face_dimension says otherwise. Some writers omit it:
  // then the second one, if data lie on that alone.
  [[nodiscard]] int faces_of(int mesh, int table) const {
    const int named = dimension_named(contents_, file_.text_of(mesh, "face_dimension"));
    if (named >= 0) return named;
    const std::vector<int>& dims = variable(table).dims;
    const auto has_data = [&](int d) {
      return std::any_of(
          contents_.variables.begin(), contents_.variables.end(), [&](const FileVariable& one) {
            return one.numeric && !lower(one.cf_role).ends_with("_connectivity") &&
                   &one != &variable(table) && std::count(one.dims.begin(), one.dims.end(), d) > 0;
          });
    };
    return !has_data(dims[0]) && has_data(dims[1]) ? dims[1] : dims[0];
  }

  [[nodiscard]] int edges_of(int mesh) const {
    const int named = dimension_named(contents_, file_.text_of(mesh, "edge_dimension"));
    if (named >= 0) return named;
    const int v = numeric(lower_free(file_.text_of(mesh, "edge_node_connectivity")), 2);
    if (v < 0) return -1;
    const std::vector<int>& dims = variable(v).dims;
    return length(dims[0]) >= length(dims[1]) ? dims[0] : dims[1];
  }

  // MPAS mesh specification, version 1.0: numbers from 1, radians.
  Found mpas() {
    Topology out;
    out.convention = "MPAS";
    out.node_positions = {numeric("lonVertex", 1), numeric("latVertex", 1)};
    out.plane_positions = {numeric("xVertex", 1), numeric("yVertex", 1)};
    out.degrees = numeric("nEdgesOnCell", 1);
    const int cells = numeric("verticesOnCell", 2);
    if (cells < 0 || out.degrees < 0 || out.node_positions[1] < 0) return std::nullopt;
    if (!set_connectivity(cells, variable(out.degrees).dims[0], out)) return std::nullopt;
    out.edges = dimension_named(contents_, "nEdges");
    out.start_index = 1;
    out.on_sphere = true;
    out.is_radian = true;
    out.others = {out.degrees};
    return out;
  }

  // FVCOM: nv(three, nele), numbers from 1.
  Found fvcom() {
    const int cells = numeric("nv", 2);
    if (cells < 0) return std::nullopt;
    Topology out;
    out.convention = "FVCOM";
    out.node_positions = {numeric("lon", 1), numeric("lat", 1)};
    out.plane_positions = {numeric("x", 1), numeric("y", 1)};
    out.on_sphere = out.node_positions[0] >= 0 && out.node_positions[1] >= 0;
    if (!out.on_sphere) out.node_positions = out.plane_positions;
    if (out.node_positions[0] < 0 || out.node_positions[1] < 0) return std::nullopt;
    if (!set_connectivity(cells, dimension_named(contents_, "nele"), out)) return std::nullopt;
    out.start_index = 1;
    return out;
  }

  // FESOM 2, fesom.mesh.diag.nc: elements(n3, elem) of nodes with lon(nod2), lat(nod2), from 1.
  Found fesom() {
    for (const char* name : {"elements", "elem", "face_nodes"}) {
      const int cells = numeric(name, 2);
      if (cells < 0) continue;
      Topology out;
      out.convention = "FESOM";
      out.node_positions = {numeric("lon", 1), numeric("lat", 1)};
      if (out.node_positions[0] < 0 || out.node_positions[1] < 0) continue;
      if (!set_connectivity(cells, -1, out)) continue;
      if (contents_.dimensions.at(at(out.nodes)).name.starts_with("nod") == false) continue;
      out.on_sphere = true;
      out.start_index = 1;
      out.edges = dimension_named(contents_, "edg_n");
      return out;
    }
    return std::nullopt;
  }

  // CF 1.8, 7.1: longitude and latitude of a list of cells, with bounds of more than two corners.
  Found bounds() {
    const std::vector<bool> lists = find_cell_lists(contents_);
    for (std::size_t d = 0; d < lists.size(); ++d) {
      if (!lists[d]) continue;
      const int cells = static_cast<int>(d);
      Topology out;
      out.convention = "CF bounds";
      out.cells = cells;
      out.on_sphere = true;
      for (std::size_t v = 0; v < contents_.variables.size(); ++v) {
        const FileVariable& one = contents_.variables[v];
        const int side = side_of(one);
        if (one.dims != std::vector{cells} || !one.numeric || side == 0) continue;
        const int corners = numeric(one.bounds, 2);
        if (corners < 0 || variable(corners).dims[0] != cells ||
            length(variable(corners).dims[1]) < 3) {
          continue;
        }
        out.corner_positions.at(side < 0 ? 0 : 1) = corners;
        // Bounds are in the units of their coordinate unless they have their own (CF 7.1).
        out.is_radian = out.is_radian || is_radian(one.units);
        out.others.push_back(static_cast<int>(v));
      }
      // ICON's grid files name the edges so.
      if (numeric("edge_of_cell", 2) >= 0) out.edges = dimension_named(contents_, "edge");
      if (has_corners(out)) return out;
    }
    return std::nullopt;
  }

  // SCRIP grid files (Jones, SCRIP user's guide, 1998); ESMF and CAM use them.
  Found scrip() {
    Topology out;
    out.convention = "SCRIP";
    out.corner_positions = {numeric("grid_corner_lon", 2), numeric("grid_corner_lat", 2)};
    if (out.corner_positions[0] < 0) return std::nullopt;
    out.cells = variable(out.corner_positions[0]).dims[0];
    out.on_sphere = true;
    for (const char* name : {"grid_center_lon", "grid_center_lat", "grid_imask", "grid_area"}) {
      const int v = variable_named(contents_, name);
      if (v >= 0) out.others.push_back(v);
    }
    return has_corners(out) ? Found(std::move(out)) : std::nullopt;
  }

  // Longitudes and latitudes of a list, and nothing about its cells.
  Found centers() {
    const std::vector<DimensionRole> roles = classify_dimensions(contents_);
    Topology out;
    for (std::size_t d = 0; d < roles.size(); ++d) {
      const int list = static_cast<int>(d);
      const std::size_t longest = out.nodes < 0 ? centers_min - 1 : length(out.nodes);
      const bool is_of_edges =
          lower(contents_.dimensions[d].name).find("edge") != std::string::npos;
      if (!roles[d].is_list || is_of_edges || length(list) <= longest) continue;
      std::array<int, 2> positions{-1, -1};
      bool has_data = false;
      for (std::size_t v = 0; v < contents_.variables.size(); ++v) {
        const FileVariable& one = contents_.variables[v];
        if (!one.numeric || std::count(one.dims.begin(), one.dims.end(), list) != 1) continue;
        if (!one.mesh.empty() || lower(one.cf_role).ends_with("_connectivity")) return std::nullopt;
        const int side = one.dims.size() == 1 ? side_of(one) : 0;
        if (side == 0) {
          has_data = true;
        } else if (positions.at(side < 0 ? 0 : 1) < 0) {
          positions.at(side < 0 ? 0 : 1) = static_cast<int>(v);
        }
      }
      if (!has_data || positions[0] < 0 || positions[1] < 0) continue;
      out.nodes = list;
      out.node_positions = positions;
    }
    if (out.nodes < 0) return std::nullopt;
    const auto shown = choose_grid(contents_, roles);
    if (shown && shown->space[0] >= 0 && shown->space[1] >= 0) return std::nullopt;
    out.convention = "positions of cells";
    out.by_neighbours = true;
    out.on_sphere = true;
    return out;
  }

  [[nodiscard]] bool has_corners(const Topology& out) const {
    return out.corner_positions[0] >= 0 && out.corner_positions[1] >= 0 &&
           variable(out.corner_positions[0]).dims == variable(out.corner_positions[1]).dims;
  }

  const ArrayFile& file_;
  const FileContents& contents_;
};

}  // namespace

std::optional<Topology> find_topology(const ArrayFile& file) { return TopologyFinder(file).find(); }

std::vector<int> variables_of(const Topology& topology) {
  std::vector<int> out = topology.others;
  out.push_back(topology.connectivity);
  out.push_back(topology.degrees);
  for (const auto& pair :
       {topology.node_positions, topology.plane_positions, topology.corner_positions}) {
    out.insert(out.end(), pair.begin(), pair.end());
  }
  std::erase(out, -1);
  return out;
}

std::optional<GridChoice> grid_of_lists(const ArrayFile& file) {
  const FileContents& contents = file.contents();
  const auto topology = find_topology(file);
  std::vector<bool> lists = find_cell_lists(contents);
  if (topology) {
    for (const int d : {topology->cells, topology->nodes, topology->edges}) {
      if (d >= 0) lists[at(d)] = true;
    }
  }
  const std::vector<int> parts = topology ? variables_of(*topology) : std::vector<int>();
  const std::vector<DimensionRole> roles = classify_dimensions(contents);
  std::vector<std::size_t> uses(contents.dimensions.size(), 0);  // as time
  std::vector<bool> used(contents.dimensions.size(), false);     // as list
  for (std::size_t v = 0; v < contents.variables.size(); ++v) {
    const FileVariable& one = contents.variables[v];
    if (!one.numeric || one.dims.size() < 2 ||
        std::count(parts.begin(), parts.end(), static_cast<int>(v)) > 0) {
      continue;
    }
    const auto list =
        std::find_if(one.dims.begin(), one.dims.end(), [&](int d) { return bool{lists[at(d)]}; });
    if (list == one.dims.end()) continue;
    used[at(*list)] = true;
    const int first = one.dims.front();
    const bool by_place =
        roles[at(first)].role == Role::unknown && contents.dimensions[at(first)].unlimited;
    if (roles[at(first)].role == Role::time || by_place) ++uses[at(first)];
  }
  GridChoice out;
  std::size_t lists_found = 0;
  for (std::size_t d = 0; d < used.size() && lists_found < out.space.size(); ++d) {
    if (used[d]) out.space.at(lists_found++) = static_cast<int>(d);
  }
  const auto most = std::max_element(uses.begin(), uses.end());
  if (most != uses.end() && *most > 0) out.time = static_cast<int>(most - uses.begin());
  return lists_found > 0 ? std::optional(std::move(out)) : std::nullopt;
}

}  // namespace windsplat::data::cf
