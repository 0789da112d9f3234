// Tables of edges -> the edge along every side of every cell.
#include "server/data/cf/edges/edges.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

using SpaceVector = MeshEdges::Vector;

// Whole numbers have all their digits.
std::string number_in_file(double value) {
  const bool is_whole = value == std::floor(value) && std::abs(value) < 1e15;
  return is_whole ? std::to_string(static_cast<std::int64_t>(value)) : number_text(value);
}

class EdgeReader {
 public:
  EdgeReader(const ArrayFile& file, const EdgeTables& tables, const Topology& topology,
             const Mesh& mesh)
      : file_(file), tables_(tables), topology_(topology), mesh_(mesh) {}

  Result<MeshEdges> read() {
    out_.count = file_.contents().dimensions.at(at(topology_.edges)).length;
    const auto stored = file_.stored_bytes();
    if (stored && out_.count > entries_max(*stored)) {
      return make_error(ErrorKind::bad_data, "the mesh has " + std::to_string(out_.count) +
                                                 " edges: at most " +
                                                 std::to_string(entries_max(*stored)) +
                                                 " are supported in a file of this size");
    }
    out_.of_sides.assign(mesh_.corners.size(), no_mesh_edge);
    auto done = tables_.nodes >= 0 ? by_nodes() : by_cells();
    if (done && tables_.have_normals()) done = read_normals();
    if (!done) return done.error();
    return std::move(out_);
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return file_.contents().variables.at(at(v));
  }

  // Numbers from 0 of a table of `rows` and something else, row after row; -1 where missing or
  // negative.
  [[nodiscard]] Result<std::vector<std::int64_t>> numbers(int v, int rows, std::size_t most,
                                                          std::size_t& width) const {
    const std::vector<int>& dims = variable(v).dims;
    const bool turned = dims[0] != rows;
    const auto length = [&](int d) { return file_.contents().dimensions.at(at(d)).length; };
    width = length(dims[turned ? 0 : 1]);
    const std::size_t count = length(dims[turned ? 1 : 0]);
    const auto values = unpacked_values(file_, v);
    if (!values) return values.error();
    double largest = 0;
    for (const double value : *values) largest = std::max(largest, std::isnan(value) ? 0 : value);
    const auto stated = file_.numbers(v, "start_index").values;
    const bool from_one = topology_.convention != "UGRID" || largest == static_cast<double>(most);
    const double start = !stated.empty() ? stated[0] : from_one ? 1 : 0;
    std::vector<std::int64_t> out(values->size(), -1);
    for (std::size_t n = 0; n < out.size(); ++n) {
      const double own = (*values)[turned ? n % width * count + n / width : n] - start;
      const bool is_absent = own == -1 || (own < 0 && own + start < 0);
      if (std::isnan(own) || is_absent) continue;
      if (!(own >= 0 && own < static_cast<double>(most)) || own != std::floor(own)) {
        return make_error(ErrorKind::bad_data,
                          in_quotes(variable(v).name) + ": entry " + std::to_string(n / width + 1) +
                              " has the number " + number_in_file(own + start) + ", beyond " +
                              number_in_file(start) + " to " +
                              number_in_file(static_cast<double>(most) - 1 + start));
      }
      out[n] = static_cast<std::int64_t>(own);
    }
    return out;
  }

  // Nodes as a pair, whatever their order.
  static std::uint64_t pair_of(std::uint64_t a, std::uint64_t b) {
    return a < b ? a << 32U | b : b << 32U | a;
  }

  [[nodiscard]] SpaceVector node(std::int64_t number) const {
    const auto n = static_cast<std::size_t>(number);
    return in_space({mesh_.x[n], mesh_.y[n]}, mesh_.on_sphere);
  }

  Result<void> by_nodes() {
    std::size_t width = 0;
    auto nodes = numbers(tables_.nodes, topology_.edges, mesh_.nodes(), width);
    if (!nodes) return nodes.error();
    using Keyed = std::pair<std::uint64_t, std::uint32_t>;
    if (width < 2) {
      return make_error(ErrorKind::bad_data,
                        in_quotes(variable(tables_.nodes).name) + " has no two nodes for an edge");
    }
    std::vector<Keyed> keys;
    keys.reserve(out_.count);
    out_.middles.assign(out_.count, SpaceVector{});
    for (std::size_t e = 0; e < out_.count; ++e) {
      const std::int64_t a = (*nodes)[e * width];
      const std::int64_t b = (*nodes)[e * width + 1];
      if (a < 0 || b < 0) continue;
      keys.emplace_back(pair_of(static_cast<std::uint64_t>(a), static_cast<std::uint64_t>(b)),
                        static_cast<std::uint32_t>(e));
      const SpaceVector one = node(a);
      const SpaceVector two = node(b);
      SpaceVector& middle = out_.middles[e];
      for (std::size_t i = 0; i < 3; ++i) middle.at(i) = (one.at(i) + two.at(i)) / 2;
      if (mesh_.on_sphere) {
        const double length = std::hypot(middle[0], middle[1], middle[2]);
        for (double& part : middle) part /= length;
      }
    }
    std::sort(keys.begin(), keys.end());
    for (std::size_t c = 0; c < mesh_.cells(); ++c) {
      for (std::uint32_t i = mesh_.first[c]; i < mesh_.first[c + 1]; ++i) {
        const std::uint32_t next = i + 1 < mesh_.first[c + 1] ? i + 1 : mesh_.first[c];
        const std::uint64_t key = pair_of(mesh_.corners[i], mesh_.corners[next]);
        const auto found = std::lower_bound(keys.begin(), keys.end(), Keyed(key, 0));
        if (found != keys.end() && found->first == key) out_.of_sides[i] = found->second;
      }
    }
    return check_sides(tables_.nodes);
  }

  Result<void> by_cells() {
    std::size_t width = 0;
    auto edges = numbers(tables_.of_cells, topology_.cells, out_.count, width);
    if (!edges) return edges.error();
    out_.in_order = false;
    for (std::size_t c = 0; c < mesh_.cells(); ++c) {
      const std::size_t sides = std::min<std::size_t>(width, mesh_.first[c + 1] - mesh_.first[c]);
      for (std::size_t i = 0; i < sides; ++i) {
        const std::int64_t own = (*edges)[c * width + i];
        if (own >= 0) out_.of_sides[mesh_.first[c] + i] = static_cast<std::uint32_t>(own);
      }
    }
    const auto x = unpacked_degrees(file_, tables_.middles[0]);
    if (!x) return x.error();
    const auto y = unpacked_degrees(file_, tables_.middles[1]);
    if (!y) return y.error();
    out_.middles.resize(out_.count);
    for (std::size_t e = 0; e < out_.count; ++e)
      out_.middles[e] = in_space({(*x)[e], (*y)[e]}, mesh_.on_sphere);
    return check_sides(tables_.of_cells);
  }

  [[nodiscard]] Result<void> check_sides(int table) const {
    const auto without = static_cast<std::size_t>(
        std::count(out_.of_sides.begin(), out_.of_sides.end(), no_mesh_edge));
    if (without * 2 <= out_.of_sides.size()) return {};
    return make_error(ErrorKind::bad_data,
                      in_quotes(variable(table).name) +
                          " has no edge along most sides of the cells: " + std::to_string(without) +
                          " of " + std::to_string(out_.of_sides.size()));
  }

  Result<void> read_normals() {
    std::array<std::vector<double>, 2> parts;
    if (tables_.angle >= 0) {
      auto angles = unpacked_values(file_, tables_.angle);
      if (!angles) return angles.error();
      const bool in_degrees = lower(variable(tables_.angle).units).starts_with("deg");
      constexpr double circle = 2 * std::numbers::pi;
      for (std::size_t e = 0; e < angles->size(); ++e) {
        const double angle = (*angles)[e] * (in_degrees ? circle / 360 : 1);
        if (!in_degrees && std::abs(angle) > circle + 1e-5) {
          return make_error(ErrorKind::bad_data,
                            in_quotes(variable(tables_.angle).name) + ": edge " +
                                std::to_string(e + 1) + " has the angle " + number_text(angle) +
                                ", more than a circle of 2 pi, and no unit of degrees");
        }
        parts[0].push_back(std::cos(angle));
        parts[1].push_back(std::sin(angle));
      }
    } else {
      for (std::size_t a = 0; a < 2; ++a) {
        auto values = unpacked_values(file_, tables_.normals.at(a));
        if (!values) return values.error();
        parts.at(a) = std::move(*values);
      }
    }
    out_.normals.resize(out_.count);
    for (std::size_t e = 0; e < out_.count; ++e) {
      const double length = std::hypot(parts[0][e], parts[1][e]);
      const double to_east = parts[0][e] / length;
      const double to_north = parts[1][e] / length;
      const auto [east, north] = axes_at(out_.middles[e], mesh_.on_sphere);
      for (std::size_t i = 0; i < 3; ++i) {
        out_.normals[e].at(i) = to_east * east.at(i) + to_north * north.at(i);
      }
    }
    return {};
  }

  const ArrayFile& file_;
  const EdgeTables& tables_;
  const Topology& topology_;
  const Mesh& mesh_;
  MeshEdges out_;
};

}  // namespace

MeshEdges::Vector in_space(const PlanePoint& place, bool on_sphere) {
  if (!on_sphere) return {place[0], place[1], 0};
  constexpr double degree = std::numbers::pi / 180;
  const double from_axis = std::cos(place[1] * degree);
  return {from_axis * std::cos(place[0] * degree), from_axis * std::sin(place[0] * degree),
          std::sin(place[1] * degree)};
}

std::array<MeshEdges::Vector, 2> axes_at(const MeshEdges::Vector& place, bool on_sphere) {
  const double from_axis = std::hypot(place[0], place[1]);
  if (!on_sphere || from_axis == 0) return {SpaceVector{1, 0, 0}, SpaceVector{0, 1, 0}};
  const double cosine = place[0] / from_axis;
  const double sine = place[1] / from_axis;
  return {SpaceVector{-sine, cosine, 0},
          SpaceVector{-place[2] * cosine, -place[2] * sine, from_axis}};
}

EdgeTables find_edge_tables(const ArrayFile& file, const Topology& topology) {
  const FileContents& contents = file.contents();
  const auto on = [&](const std::string& name, std::size_t rank) {
    const int v = name.empty() ? -1 : variable_named(contents, name);
    if (v < 0) return -1;
    const FileVariable& one = contents.variables[at(v)];
    const bool fits = one.numeric && one.dims.size() == rank &&
                      std::count(one.dims.begin(), one.dims.end(), topology.edges) == 1;
    return fits ? v : -1;
  };
  EdgeTables out;
  if (topology.edges < 0) return out;
  if (topology.convention == "UGRID") {
    std::istringstream words(file.text_of(topology.others.front(), "edge_node_connectivity"));
    std::string name;
    words >> name;
    out.nodes = on(name, 2);
  } else if (topology.convention == "MPAS") {
    out.nodes = on("verticesOnEdge", 2);
    out.angle = on("angleEdge", 1);
    out.middles = {on("lonEdge", 1), on("latEdge", 1)};
  } else if (topology.convention == "CF bounds") {
    const int v = variable_named(contents, "edge_of_cell");
    const bool fits = v >= 0 && contents.variables[at(v)].numeric &&
                      contents.variables[at(v)].dims.size() == 2 &&
                      std::count(contents.variables[at(v)].dims.begin(),
                                 contents.variables[at(v)].dims.end(), topology.cells) == 1;
    out.middles = {on("elon", 1), on("elat", 1)};
    if (fits && out.middles[0] >= 0 && out.middles[1] >= 0) out.of_cells = v;
    out.normals = {on("zonal_normal_primal_edge", 1), on("meridional_normal_primal_edge", 1)};
    if (out.normals[1] < 0) out.normals[0] = -1;
  }
  return out;
}

Result<const float*> EdgeValues::at_cells(const ArrayFile& file, const Mesh& mesh, EdgePart part,
                                          MissingNormal missing, const float* values) {
  if (!weights_) {
    const auto edges = read_edges(file, tables_, topology_, mesh);
    if (!edges) return edges.error();
    weights_.emplace(mesh, *edges);
  }
  cells_.resize(mesh.cells());
  weights_->gather(part, missing, values, cells_.data());
  return cells_.data();
}

Result<MeshEdges> read_edges(const ArrayFile& file, const EdgeTables& tables,
                             const Topology& topology, const Mesh& mesh) {
  return EdgeReader(file, tables, topology, mesh).read();
}

}  // namespace windsplat::data::cf
