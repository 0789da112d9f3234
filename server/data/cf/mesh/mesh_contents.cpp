// Goes through the variables of a file with a mesh.
#include "server/data/cf/mesh/mesh_contents.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/cf/edges/edge_variables.hpp"
#include "server/data/cf/grid/cell_lists.hpp"

namespace windsplat::data::cf {

namespace {

// The dimensions of a file that list what a mesh consists of.
struct MeshDimensions {
  std::vector<int> cells;
  std::vector<int> nodes;
  std::vector<int> edges;
  std::vector<int> foreign;  // lists of cells of other grids
  [[nodiscard]] static bool has(const std::vector<int>& all, int d) {
    return std::find(all.begin(), all.end(), d) != all.end();
  }
};

// Dimensions of other names but the same length are those of data joined with a grid file.
MeshDimensions dimensions_of(const FileContents& contents, const Topology& topology,
                             const Mesh& mesh) {
  MeshDimensions out;
  const std::vector<bool> lists = find_cell_lists(contents);
  const bool has_nodes = topology.nodes >= 0;
  for (std::size_t d = 0; d < contents.dimensions.size(); ++d) {
    const int id = static_cast<int>(d);
    const FileDimension& own = contents.dimensions[d];
    constexpr auto usual =
        std::to_array<std::string_view>({"ncells", "ncol", "cell", "cells", "ncol_d"});
    const bool is_list = lists[d] || is_one_of(lower(own.name), usual);
    const bool is_other = id != topology.cells && id != topology.nodes && id != topology.edges;
    const bool counts_cells = topology.cells >= 0 && own.length == mesh.cells();
    const bool counts_nodes = has_nodes && own.length == mesh.nodes();
    const int listed = topology.cells >= 0 ? topology.cells : topology.nodes;
    const bool is_foreign = are_of_different_grids(own, contents.dimensions[at(listed)]);
    // Lists of GRIB are cells by definition.
    const bool may_be_nodes = own.is_list ? topology.by_neighbours : !counts_cells;
    const bool may_be_cells = own.is_list || !counts_nodes;
    const bool is_alias = is_other && is_list && !is_foreign;
    const bool as_cells = is_alias && counts_cells && may_be_cells;
    const bool as_nodes = is_alias && counts_nodes && may_be_nodes;
    if (own.is_list && is_other && !as_cells && !as_nodes) out.foreign.push_back(id);
    if (id == topology.cells || as_cells) out.cells.push_back(id);
    if (id == topology.nodes || as_nodes) out.nodes.push_back(id);
    const bool counts_edges =
        topology.edges >= 0 && own.length == contents.dimensions[at(topology.edges)].length;
    // ICON's files number their lists: ncells_2.
    const bool may_be_edges = lists[d] || lower(own.name).starts_with("ncells_");
    const bool as_edges =
        is_other && may_be_edges && !own.is_list && counts_edges && !as_cells && !as_nodes;
    if (id == topology.edges || as_edges) out.edges.push_back(id);
  }
  return out;
}

// Dimensions of a variable that are among the lists.
std::ptrdiff_t lists_among(const FileVariable& variable, const std::vector<int>& lists) {
  return std::count_if(variable.dims.begin(), variable.dims.end(),
                       [&](int d) { return MeshDimensions::has(lists, d); });
}

class ContentsMaker {
 public:
  ContentsMaker(const ArrayFile& file, const Topology& topology, const Mesh& mesh,
                const MeshLattice& lattice)
      : file_(file),
        topology_(topology),
        mesh_(mesh),
        lattice_(lattice),
        contents_(out_.contents),
        dimensions_(dimensions_of(file.contents(), topology, mesh)),
        parts_of_mesh_(variables_of(topology)) {
    contents_ = file.contents();
    contents_.variables.clear();
    out_.edges = find_edge_tables(file, topology);
    const EdgeTables& edges = out_.edges;
    for (const int v : {edges.nodes, edges.of_cells, edges.middles[0], edges.middles[1],
                        edges.angle, edges.normals[0], edges.normals[1]}) {
      if (v >= 0) parts_of_mesh_.push_back(v);
    }
  }

  Result<MeshContents> make() {
    add_lattice();
    if (auto done = add_levels(); !done) return done.error();
    add_variables();
    edge_notes_.tell(contents_.notes);
    if (auto fine = check_grid(); !fine) return fine.error();
    tell_unknown_grid();
    add_heights();
    name_mesh_variables(contents_, topology_.convention);
    out_.cell_dimensions = dimensions_.cells;
    return std::move(out_);
  }

 private:
  // A name that no dimension of the file has, nor a variable that is kept.
  [[nodiscard]] std::string free_name(std::string name) const {
    const FileContents& all = file_.contents();
    const auto is_taken = [&] {
      const int v = variable_named(all, name);
      return dimension_named(all, name) >= 0 ||
             (v >= 0 && !describes_mesh(v, all.variables[at(v)]));
    };
    while (is_taken()) name += "_lattice";
    return name;
  }

  void add_lattice() {
    const FileContents& all = file_.contents();
    const int position = topology_.plane_positions[0];
    const std::string plane_units =
        position < 0 ? std::string() : all.variables[at(position)].units;
    for (const bool is_x : {false, true}) {
      const LatticeAxis& axis = is_x ? lattice_.x : lattice_.y;
      FileVariable variable;
      variable.name = free_name(mesh_.on_sphere ? (is_x ? "lon" : "lat") : (is_x ? "x" : "y"));
      variable.type = "float64";
      variable.numeric = true;
      variable.standard_name = mesh_.on_sphere
                                   ? (is_x ? "longitude" : "latitude")
                                   : (is_x ? "projection_x_coordinate" : "projection_y_coordinate");
      variable.units = mesh_.on_sphere ? (is_x ? "degrees_east" : "degrees_north") : plane_units;
      variable.axis = is_x ? "X" : "Y";
      MeshPart own;
      for (std::size_t i = 0; i < axis.count; ++i) own.values.push_back(axis.at(i));
      FileDimension dimension;
      dimension.name = variable.name;
      dimension.length = axis.count;
      add_coordinate(std::move(dimension), std::move(variable), std::move(own));
    }
  }

  void add_coordinate(FileDimension dimension, FileVariable variable, MeshPart own) {
    variable.dims = {static_cast<int>(contents_.dimensions.size())};
    contents_.dimensions.push_back(std::move(dimension));
    contents_.variables.push_back(std::move(variable));
    out_.parts.push_back(std::move(own));
  }

  [[nodiscard]] std::vector<int> lattice_dims() const {
    const int first = static_cast<int>(file_.contents().dimensions.size());
    return {first, first + 1};
  }

  Result<void> add_levels() {
    auto levels = levels_of_mesh(file_, topology_);
    if (!levels) return levels.error();
    for (MeshLevels& found : *levels) {
      FileVariable& variable = found.variable;
      variable.name = contents_.dimensions.at(at(found.dimension)).name;
      variable.type = "float64";
      variable.numeric = true;
      variable.dims = {found.dimension};
      variable.axis = "Z";
      replaced_.push_back(variable.name);
      contents_.variables.push_back(std::move(variable));
      MeshPart own;
      own.values = std::move(found.values);
      out_.parts.push_back(std::move(own));
    }
    return {};
  }

  // Tables with a dimension that counts the parts of a cell or node describe the mesh.
  [[nodiscard]] bool describes_mesh(int v, const FileVariable& variable) const {
    if (std::find(parts_of_mesh_.begin(), parts_of_mesh_.end(), v) != parts_of_mesh_.end()) {
      return true;
    }
    constexpr auto counts = std::to_array<std::string_view>(
        {"three", "four", "two", "maxnode", "maxelem", "maxedges", "maxedges2", "vertexdegree",
         "nv", "vertices", "ne", "no", "nc", "grid_corners", "bnds"});
    const bool is_table = std::any_of(variable.dims.begin(), variable.dims.end(), [&](int d) {
      return is_one_of(lower(contents_.dimensions.at(at(d)).name), counts);
    });
    const bool is_place =
        variable.dims.size() == 1 &&
        (side_of(variable) != 0 || describes_mesh_of(topology_.convention, variable.name));
    const bool listed = std::any_of(variable.dims.begin(), variable.dims.end(), [&](int d) {
      return MeshDimensions::has(dimensions_.cells, d) ||
             MeshDimensions::has(dimensions_.nodes, d) || MeshDimensions::has(dimensions_.edges, d);
    });
    return listed && (is_table || is_place || lower(variable.cf_role).ends_with("_connectivity"));
  }

  void add_variables() {
    const std::vector<FileVariable>& all = file_.contents().variables;
    for (std::size_t v = 0; v < all.size(); ++v) {
      const int id = static_cast<int>(v);
      FileVariable variable = all[v];
      if (std::count(replaced_.begin(), replaced_.end(), variable.name) > 0 ||
          describes_mesh(id, variable)) {
        if (variable.dims.size() > 1 && variable.numeric) {
          contents_.left_out.push_back({variable.name, "describes the mesh"});
        }
        continue;
      }
      MeshPart own;
      own.base = id;
      if (variable.numeric && lists_among(variable, dimensions_.edges) == 1) {
        add_on_edges(std::move(variable), std::move(own));
        continue;
      }
      place(variable, own);
      contents_.variables.push_back(std::move(variable));
      out_.parts.push_back(std::move(own));
    }
  }

  void add_on_edges(FileVariable variable, MeshPart own) {
    const EdgeUse use =
        use_of_edges(variable, file_.contents(), {dimensions_.cells, dimensions_.edges}, topology_,
                     find_edge_tables(file_, topology_));
    const std::string reason =
        !use.reason.empty()
            ? use.reason
            : edge_notes_.fault_of_tables(file_, out_.edges, topology_, mesh_, use.is_normal);
    if (!reason.empty()) {
      variable.numeric = false;
      variable.unread = reason;
      contents_.variables.push_back(std::move(variable));
      out_.parts.push_back(std::move(own));
      return;
    }
    edge_notes_.add(variable.name, use);
    own.missing = use.missing;
    const auto add = [&](FileVariable one, EdgePart part) {
      MeshPart placed = own;
      placed.edges = part;
      resample(one, placed, dimensions_.edges, MeshLocation::face);
      contents_.variables.push_back(std::move(one));
      out_.parts.push_back(std::move(placed));
    };
    if (!use.is_normal) {
      add(std::move(variable), EdgePart::mean);
      return;
    }
    const auto components = components_of_normal(variable, file_.contents(), mesh_.on_sphere);
    add(components[0], EdgePart::east);
    add(components[1], EdgePart::north);
  }

  void place(FileVariable& variable, MeshPart& own) const {
    if (lists_among(variable, dimensions_.edges) > 0) {
      variable.numeric = false;
      if (variable.unread.empty()) variable.unread = "a table of edges of the mesh";
      return;
    }
    if (lists_among(variable, dimensions_.foreign) > 0) {
      variable.numeric = false;
      variable.unread = problem_of_foreign(variable);
      return;
    }
    const auto on_cells = lists_among(variable, dimensions_.cells);
    if (!variable.numeric || on_cells + lists_among(variable, dimensions_.nodes) != 1) return;
    if (on_cells == 1) {
      resample(variable, own, dimensions_.cells, MeshLocation::face);
    } else {
      resample(variable, own, dimensions_.nodes, MeshLocation::node);
    }
  }

  // lists: one of them is a dimension of the variable, in whose place y and x follow.
  void resample(FileVariable& variable, MeshPart& own, const std::vector<int>& lists,
                MeshLocation location) const {
    own.location = location;
    const auto list = std::find_if(variable.dims.begin(), variable.dims.end(),
                                   [&](int d) { return MeshDimensions::has(lists, d); });
    own.list = static_cast<std::size_t>(list - variable.dims.begin());
    variable.dims.erase(list);
    for (const int d : lattice_dims()) variable.dims.push_back(d);
    variable.type = "float32";
    variable.packed = false;
    variable.is_unsigned = false;
    variable.layers_apart = false;
    variable.mesh.clear();
    variable.coordinates.clear();
  }

  [[nodiscard]] std::string problem_of_foreign(const FileVariable& variable) const {
    const auto list = std::find_if(variable.dims.begin(), variable.dims.end(), [&](int d) {
      return MeshDimensions::has(dimensions_.foreign, d);
    });
    const auto described = [&](int d) {
      const FileDimension& one = file_.contents().dimensions.at(at(d));
      return std::to_string(one.length) + " cells" +
             (one.grid_uuid.empty() ? std::string() : " of the UUID " + one.grid_uuid);
    };
    return "on a horizontal grid of " + described(*list) + ", but the grid that is given has " +
           described(topology_.cells >= 0 ? topology_.cells : topology_.nodes);
  }

  // That all fields which need a grid file lie on other grids than the mesh, if so.
  [[nodiscard]] Result<void> check_grid() const {
    std::string problem;
    for (std::size_t v = 0; v < out_.parts.size(); ++v) {
      const int base = out_.parts[v].base;
      if (base < 0) continue;
      const auto& dims = file_.contents().variables[at(base)].dims;
      const bool is_listed = std::any_of(dims.begin(), dims.end(), [&](int d) {
        return file_.contents().dimensions[at(d)].is_list;
      });
      if (is_listed && out_.parts[v].location) return {};
      const FileVariable& one = contents_.variables[v];
      const bool is_foreign = std::any_of(dims.begin(), dims.end(), [&](int d) {
        return MeshDimensions::has(dimensions_.foreign, d);
      });
      if (problem.empty() && is_foreign) problem = in_quotes(one.name) + " is " + one.unread;
    }
    if (problem.empty()) return {};
    return make_error(ErrorKind::bad_data, problem);
  }

  void tell_unknown_grid() {
    const auto& dimensions = file_.contents().dimensions;
    for (const int d : dimensions_.cells) {
      const bool is_known = !dimensions.at(at(d)).grid_uuid.empty() &&
                            !dimensions.at(at(topology_.cells)).grid_uuid.empty();
      if (!dimensions.at(at(d)).is_list || is_known) continue;
      contents_.notes.push_back(
          "the horizontal grid is taken for that of the fields since it has as many cells: one of "
          "the files has no uuidOfHGrid");
      return;
    }
  }

  void add_heights() {
    out_.heights = sigma_heights_of(file_.contents(), topology_);
    if (out_.heights.sigma < 0 || variable_named(contents_, "height") >= 0) return;
    const std::vector<FileVariable>& all = file_.contents().variables;
    FileVariable variable;
    variable.name = "height";
    variable.type = "float32";
    variable.numeric = true;
    variable.dims = {all[at(out_.heights.surface)].dims[0], all[at(out_.heights.sigma)].dims[0]};
    for (const int d : lattice_dims()) variable.dims.push_back(d);
    variable.standard_name = "altitude";
    variable.long_name = "height of the layer, zeta + siglay (h + zeta)";
    variable.units = "m";
    contents_.variables.push_back(std::move(variable));
    MeshPart own;
    own.location = MeshLocation::node;
    out_.parts.push_back(std::move(own));
  }

  const ArrayFile& file_;
  const Topology& topology_;
  const Mesh& mesh_;
  const MeshLattice& lattice_;
  MeshContents out_;
  FileContents& contents_;
  MeshDimensions dimensions_;
  std::vector<int> parts_of_mesh_;  // variables of the file
  EdgeNotes edge_notes_;
  std::vector<std::string> replaced_;  // variables in whose place there are other coordinates
};

}  // namespace

MeshLocation MeshContents::most() const {
  std::ptrdiff_t surplus = 0;
  for (const MeshPart& one : parts) {
    if (one.location) surplus += *one.location == MeshLocation::face ? 1 : -1;
  }
  return surplus < 0 ? MeshLocation::node : MeshLocation::face;
}

Result<MeshContents> contents_on_lattice(const ArrayFile& file, const Topology& topology,
                                         const Mesh& mesh, const MeshLattice& lattice) {
  return ContentsMaker(file, topology, mesh, lattice).make();
}

}  // namespace windsplat::data::cf
