// Numbers or positions of corners -> checked polygons.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/cf/coordinates.hpp"
#include "server/data/cf/grid/axes.hpp"
#include "server/data/cf/mesh/centers.hpp"
#include "server/data/cf/mesh/delaunay.hpp"
#include "server/data/cf/mesh/position_checks.hpp"
#include "server/data/cf/mesh/topology.hpp"
#include "server/data/cf/time.hpp"

namespace windsplat::data::cf {

namespace {

constexpr std::uint32_t no_node = std::numeric_limits<std::uint32_t>::max();

Error bad_cell(const std::string& name, std::size_t cell, const std::string& what) {
  return make_error(ErrorKind::bad_data,
                    in_quotes(name) + ": cell " + std::to_string(cell + 1) + ' ' + what);
}

// Adds the corners of one cell without repetitions, which some writers use as padding.
Result<void> add_cell(std::vector<std::uint32_t>& cell, std::size_t number, const std::string& name,
                      Mesh& mesh) {
  cell.erase(std::unique(cell.begin(), cell.end()), cell.end());
  while (cell.size() > 1 && cell.front() == cell.back()) cell.pop_back();
  if (cell.size() < 3) {
    return bad_cell(name, number,
                    "has fewer than three different corners: " + std::to_string(cell.size()));
  }
  if (mesh.first.empty()) mesh.first.push_back(0);
  mesh.corners.insert(mesh.corners.end(), cell.begin(), cell.end());
  mesh.first.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  return {};
}

Result<void> check_width(std::size_t width, const std::string& name) {
  if (width >= 3 && width <= mesh_corners_max) return {};
  return make_error(ErrorKind::bad_data, in_quotes(name) + " has " + std::to_string(width) +
                                             " corners for a cell: supported are 3 to " +
                                             std::to_string(mesh_corners_max));
}

std::string two_digits(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.2g", value);
  return text.data();
}

class MeshReader {
 public:
  MeshReader(const ArrayFile& file, const Topology& topology, std::vector<std::string>& notes)
      : file_(file), from_(topology), notes_(notes) {}

  Result<Mesh> read() {
    for (const int d : {from_.cells, from_.nodes}) {
      if (auto fine = check_length(d); !fine) return fine.error();
    }
    if (from_.by_neighbours) return by_neighbours();
    auto mesh = from_.connectivity >= 0 ? by_numbers() : by_corners();
    if (!mesh) return mesh;
    if (auto fine = check_positions(*mesh); !fine) return fine.error();
    return mesh;
  }

 private:
  [[nodiscard]] const FileVariable& variable(int v) const {
    return file_.contents().variables.at(at(v));
  }
  [[nodiscard]] std::size_t length(int d) const {
    return file_.contents().dimensions.at(at(d)).length;
  }

  [[nodiscard]] Result<void> check_length(int d) const {
    const auto stored = file_.stored_bytes();
    if (d < 0) return {};
    const std::size_t most =
        stored ? entries_max(*stored) : std::numeric_limits<std::uint32_t>::max();
    if (length(d) > 0 && length(d) <= most) return {};
    return make_error(ErrorKind::bad_data, "the dimension " +
                                               in_quotes(file_.contents().dimensions[at(d)].name) +
                                               " of the mesh has " + std::to_string(length(d)) +
                                               " entries: between 1 and " + std::to_string(most) +
                                               " are supported in a file of this size");
  }

  // The values of a table of cells and corners, cell after cell.
  [[nodiscard]] Result<std::vector<double>> by_cell(int v, std::size_t& width) const {
    const std::vector<int>& dims = variable(v).dims;
    const bool turned = dims[0] != from_.cells;
    width = length(dims[turned ? 0 : 1]);
    if (auto fine = check_width(width, variable(v).name); !fine) return fine.error();
    auto values = unpacked_values(file_, v);
    if (!values || !turned) return values;
    const std::size_t cells = length(from_.cells);
    std::vector<double> out(values->size());
    for (std::size_t c = 0; c < cells; ++c) {
      for (std::size_t i = 0; i < width; ++i) out[c * width + i] = (*values)[i * cells + c];
    }
    return out;
  }

  Result<Mesh> by_numbers() {
    std::size_t width = 0;
    auto numbers = by_cell(from_.connectivity, width);
    if (!numbers) return numbers.error();
    const std::string& name = variable(from_.connectivity).name;
    if (from_.degrees >= 0) {
      auto degrees = unpacked_values(file_, from_.degrees);
      if (!degrees) return degrees.error();
      for (std::size_t c = 0; c < degrees->size(); ++c) {
        const double degree = (*degrees)[c];
        if (!(degree >= 3 && degree <= static_cast<double>(width))) {
          return bad_cell(variable(from_.degrees).name, c, "has no usable number of corners");
        }
        for (auto i = static_cast<std::size_t>(degree); i < width; ++i) {
          (*numbers)[c * width + i] = std::numeric_limits<double>::quiet_NaN();
        }
      }
    }
    const std::size_t nodes = length(from_.nodes);
    const auto start = start_index(*numbers, width, nodes);
    if (!start) return start.error();
    for (double& number : *numbers) number -= *start;
    auto mesh = mesh_of_indices(*numbers, width, nodes, name);
    if (!mesh) return mesh;
    numbers->clear();
    numbers->shrink_to_fit();
    return with_positions(std::move(*mesh));
  }

  // The number of the first node. Without one in the file it is 1 if the number 0 does not occur
  // and the number after the last node does, or only cells from 1 lie at their centers; without
  // centers, if cells from 0 are much longer than from 1. Otherwise it is 0, as UGRID says.
  Result<double> start_index(const std::vector<double>& numbers, std::size_t width,
                             std::size_t nodes) {
    if (!from_.start_is_assumed) return from_.start_index;
    double least = std::numeric_limits<double>::infinity();
    double most = -least;
    for (const double number : numbers) {
      if (std::isnan(number)) continue;
      least = std::min(least, number);
      most = std::max(most, number);
    }
    if (least < 1 || !(most <= static_cast<double>(nodes))) return 0.0;
    const std::string named = in_quotes(variable(from_.connectivity).name) + " has no start_index";
    if (most == static_cast<double>(nodes)) {
      notes_.push_back(named +
                       ", but its numbers of nodes can only count from 1: they are read so");
      return 1.0;
    }
    const auto fits_zero = lie_at_centers(numbers, width, nodes, 0);
    const auto fits_one = lie_at_centers(numbers, width, nodes, 1);
    if (fits_zero != fits_one) {
      notes_.push_back(named + ": numbers of nodes count from " + (fits_zero ? '0' : '1') +
                       ", which places the cells at their centers");
      return fits_zero ? 0.0 : 1.0;
    }
    std::array<std::vector<double>, 2> positions;
    for (std::size_t a = 0; a < 2; ++a) {
      auto values = angles(from_.node_positions.at(a), from_.on_sphere);
      if (!values) return values.error();
      positions.at(a) = std::move(*values);
      if (positions.at(a).size() != nodes) return 0.0;  // with_positions() reports it
    }
    const double from_zero = length_of_edges(numbers, width, 0, positions);
    const double from_one = length_of_edges(numbers, width, 1, positions);
    constexpr double much = 0.9;  // a row of cells around an edge has a cell along all of it
    if (from_one < much * from_zero) {
      notes_.push_back(named +
                       ", but cells would be much longer with numbers of nodes from 0: they are "
                       "read as counting from 1");
      return 1.0;
    }
    if (!(from_zero < much * from_one)) {
      notes_.push_back(named +
                       ", and no cell has the node 0: numbers of nodes count from 0, the default "
                       "of UGRID");
    }
    return 0.0;
  }

  // Whether cells whose numbers of nodes count from `start` lie at the centers in the file; true
  // without centers.
  bool lie_at_centers(std::vector<double> numbers, std::size_t width, std::size_t nodes,
                      double start) {
    for (double& number : numbers) number -= start;
    auto mesh = mesh_of_indices(numbers, width, nodes, variable(from_.connectivity).name);
    if (mesh) mesh = with_positions(std::move(*mesh));
    return mesh && check_positions(*mesh) && check_centers(file_, {from_.cells}, *mesh);
  }

  // The sum over the edges of all cells, in degrees of latitude or lengths of the plane. numbers:
  // of nodes, counted from `start`; those that do not exist have no edges.
  [[nodiscard]] double length_of_edges(const std::vector<double>& numbers, std::size_t width,
                                       double start,
                                       const std::array<std::vector<double>, 2>& positions) const {
    const auto& [x, y] = positions;
    double sum = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const bool is_last = (i + 1) % width == 0 || std::isnan(numbers[i + 1]);
      const double from = numbers[i] - start;
      const double to = (is_last ? numbers[i / width * width] : numbers[i + 1]) - start;
      const auto count = static_cast<double>(x.size());
      if (!(from >= 0 && from < count && to >= 0 && to < count)) continue;
      const auto a = static_cast<std::size_t>(from);
      const auto b = static_cast<std::size_t>(to);
      double way = x[b] - x[a];
      if (from_.on_sphere) {
        way = std::remainder(way, 360.0) * std::cos((y[a] + y[b]) / 2 * std::numbers::pi / 180);
      }
      const double length = std::hypot(way, y[b] - y[a]);
      if (std::isfinite(length)) sum += length;
    }
    return sum;
  }

  Result<Mesh> with_positions(Mesh mesh) {
    std::array<std::vector<double>, 2> positions;
    mesh.on_sphere = from_.on_sphere;
    for (std::size_t a = 0; a < 2; ++a) {
      auto values = angles(from_.node_positions.at(a), from_.on_sphere);
      if (!values) return values.error();
      positions.at(a) = std::move(*values);
    }
    const auto& x = positions[0];
    const bool all_equal = std::all_of(
        x.begin(), x.end(), [&](double value) { return std::isnan(value) || value == x.front(); });
    const bool has_plane = from_.plane_positions[0] >= 0 && from_.plane_positions[1] >= 0;
    if (mesh.on_sphere && all_equal && has_plane) {
      mesh.on_sphere = false;
      for (std::size_t a = 0; a < 2; ++a) {
        auto values = unpacked_values(file_, from_.plane_positions.at(a));
        if (!values) return values.error();
        positions.at(a) = std::move(*values);
      }
    }
    if (mesh.on_sphere) {
      if (auto fine = check_angles(from_.node_positions, positions); !fine) return fine.error();
    }
    if (positions[0].size() != length(from_.nodes) || positions[1].size() != positions[0].size()) {
      return make_error(ErrorKind::bad_data, "the nodes of the mesh lack positions");
    }
    mesh.x = std::move(positions[0]);
    mesh.y = std::move(positions[1]);
    return mesh;
  }

  // Degrees of longitudes or latitudes; lengths as they are.
  Result<std::vector<double>> angles(int v, bool is_angle) const {
    if (!is_angle) return unpacked_values(file_, v);
    auto values = unpacked_degrees(file_, v);
    const bool by_convention = from_.is_radian && is_unitless(variable(v).units);
    if (values && by_convention) {
      for (double& value : *values) value *= 180 / std::numbers::pi;
    }
    return values;
  }

  // Positions without units that are not radians by the convention of the mesh.
  [[nodiscard]] Result<void> check_angles(
      const std::array<int, 2>& variables,
      const std::array<std::vector<double>, 2>& positions) const {
    return from_.is_radian ? Result<void>() : check_units(file_.contents(), variables, positions);
  }

  Result<Mesh> by_corners() {
    std::array<std::vector<double>, 2> positions;
    std::size_t width = 0;
    for (std::size_t a = 0; a < 2; ++a) {
      const int v = from_.corner_positions.at(a);
      width = length(variable(v).dims[1]);
      if (auto fine = check_width(width, variable(v).name); !fine) return fine.error();
      auto values = angles(v, true);
      if (!values) return values.error();
      positions.at(a) = std::move(*values);
    }
    if (auto fine = check_angles(from_.corner_positions, positions); !fine) return fine.error();
    const FileVariable& longitude = variable(from_.corner_positions[0]);
    const double tolerance = longitude.type == "float32" ? 4e-5 : 1e-7;
    return mesh_of_corners(positions[0], positions[1], width, tolerance, longitude.name);
  }

  Result<Mesh> by_neighbours() {
    if (auto fine = check_one_time(file_, from_.nodes); !fine) return fine.error();
    const auto stored = file_.stored_bytes();
    const std::size_t count = length(from_.nodes);
    if (stored && count > opening_memory_bytes(*stored) / triangulation_bytes) {
      return make_error(ErrorKind::bad_data,
                        std::to_string(count) +
                            " positions of cells without outlines are more than are triangulated "
                            "for a file of this size: join it with the file of the grid");
    }
    std::array<std::vector<double>, 2> positions;
    for (std::size_t a = 0; a < 2; ++a) {
      auto values = angles(from_.node_positions.at(a), true);
      if (!values) return values.error();
      positions.at(a) = std::move(*values);
    }
    if (auto fine = check_angles(from_.node_positions, positions); !fine) return fine.error();
    if (are_radians(positions)) {
      return make_error(ErrorKind::bad_data,
                        "the positions in " + in_quotes(variable(from_.node_positions[0]).name) +
                            " and " + in_quotes(variable(from_.node_positions[1]).name) +
                            " fill the range of radians, but their units are degrees");
    }
    auto found = triangulate(std::move(positions[0]), std::move(positions[1]));
    if (!found) return found.error();
    const auto add = [](std::size_t number, const std::string& what) {
      return number == 0 ? std::string() : "; " + std::to_string(number) + what;
    };
    notes_.push_back(
        "the file has positions in " + in_quotes(variable(from_.node_positions[0]).name) + " and " +
        in_quotes(variable(from_.node_positions[1]).name) +
        " but no outlines of cells: values are interpolated between neighbouring positions, which "
        "a Delaunay triangulation finds" +
        add(found->gaps, " of its polygons are gaps, with an edge of more than " +
                             number_text(gap_edges) + " times those around, and masked") +
        add(found->repeated,
            " positions are those of others, whose values are drawn where they "
            "have any") +
        add(found->near, " positions are within " + two_digits(found->near_degrees) +
                             " degrees of others, whose values are drawn where they have any") +
        add(found->missing, " positions are missing"));
    return std::move(found->mesh);
  }

  [[nodiscard]] Result<void> check_positions(const Mesh& mesh) const {
    constexpr double length_max = 1e12;
    for (std::size_t i = 0; i < mesh.corners.size(); ++i) {
      const std::uint32_t node = mesh.corners[i];
      const double x = mesh.x[node];
      const double y = mesh.y[node];
      const double x_max = mesh.on_sphere ? 1080 : length_max;
      const double y_max = mesh.on_sphere ? 90 + 1e-6 : length_max;
      if (std::abs(x) <= x_max && std::abs(y) <= y_max) continue;
      return make_error(ErrorKind::bad_data,
                        "node " + std::to_string(node + 1) + " of the mesh has the position " +
                            number_text(x) + ", " + number_text(y) +
                            (mesh.on_sphere ? ", which is no longitude and latitude in degrees"
                                            : ", which is missing or too far away"));
    }
    return {};
  }

  const ArrayFile& file_;
  const Topology& from_;
  std::vector<std::string>& notes_;
};

}  // namespace

Result<Mesh> mesh_of_indices(const std::vector<double>& indices, std::size_t width,
                             std::size_t nodes, const std::string& name) {
  Mesh mesh;
  std::vector<std::uint32_t> cell;
  const std::size_t cells = indices.size() / width;
  if (indices.size() > std::numeric_limits<std::uint32_t>::max()) {
    return make_error(ErrorKind::bad_data, in_quotes(name) + " has more than 4294967295 corners");
  }
  mesh.first.reserve(cells + 1);
  mesh.corners.reserve(indices.size());
  for (std::size_t c = 0; c < cells; ++c) {
    cell.clear();
    bool padded = false;
    for (std::size_t i = 0; i < width; ++i) {
      const double index = indices[c * width + i];
      if (std::isnan(index)) {
        padded = true;
        continue;
      }
      if (padded) return bad_cell(name, c, "has a corner after its padding");
      if (!(index >= 0 && index < static_cast<double>(nodes)) || index != std::floor(index)) {
        return bad_cell(name, c,
                        "has no valid node at corner " + std::to_string(i + 1) + ": number " +
                            number_text(index) + " from 0 of " + std::to_string(nodes) +
                            " nodes, after start_index was subtracted");
      }
      cell.push_back(static_cast<std::uint32_t>(index));
    }
    if (auto added = add_cell(cell, c, name, mesh); !added) return added.error();
  }
  return mesh;
}

Result<Mesh> mesh_of_corners(const std::vector<double>& longitudes,
                             const std::vector<double>& latitudes, std::size_t width,
                             double tolerance, const std::string& name) {
  struct Corner {
    std::int64_t row;
    std::int64_t column;
    std::uint32_t index;
  };
  const std::int64_t columns = std::llround(360 / tolerance);
  std::vector<Corner> sorted;
  sorted.reserve(longitudes.size());
  std::vector<std::uint32_t> nodes(longitudes.size(), no_node);
  for (std::size_t i = 0; i < longitudes.size(); ++i) {
    const double x = longitudes[i];
    const double y = latitudes[i];
    if (std::isnan(x) || std::isnan(y)) continue;
    if (!(std::abs(x) <= 1080 && std::abs(y) <= 90 + tolerance)) {
      return bad_cell(name, i / width, "has a corner that is no longitude and latitude in degrees");
    }
    const bool pole = 90 - std::abs(y) <= tolerance;
    const double turned = pole ? 0 : x - 360 * std::floor(x / 360);
    sorted.push_back({std::llround(y / tolerance), std::llround(turned / tolerance) % columns,
                      static_cast<std::uint32_t>(i)});
  }
  std::sort(sorted.begin(), sorted.end(), [](const Corner& a, const Corner& b) {
    return std::tie(a.row, a.column, a.index) < std::tie(b.row, b.column, b.index);
  });
  std::vector<double> x;
  std::vector<double> y;
  std::vector<std::array<std::int64_t, 2>> bins;  // of the nodes, sorted
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const Corner& own = sorted[i];
    const bool is_new =
        i == 0 || sorted[i - 1].row != own.row || sorted[i - 1].column != own.column;
    if (is_new) {
      bins.push_back({own.row, own.column});
      x.push_back(longitudes[own.index]);
      y.push_back(std::clamp(latitudes[own.index], -90.0, 90.0));
    }
    nodes[own.index] = static_cast<std::uint32_t>(x.size() - 1);
  }
  // Equal corners differ by rounding, and may lie on both sides of a bin's edge. Of two neighbours
  // the later one finds the earlier: in the last column of a row that is the first column.
  std::vector<std::uint32_t> same(bins.size());
  for (std::size_t n = 0; n < bins.size(); ++n) {
    same[n] = static_cast<std::uint32_t>(n);
    const auto own = bins.begin() + static_cast<std::ptrdiff_t>(n);
    const auto [row, column] = bins[n];
    for (const auto& [up, aside] : {std::pair(0, -1), {0, 1}, {-1, -1}, {-1, 0}, {-1, 1}}) {
      const std::array near{row + up, (column + aside + columns) % columns};
      const auto at = std::lower_bound(bins.begin(), own, near);
      if (at == own || *at != near) continue;
      same[n] = same[static_cast<std::size_t>(at - bins.begin())];
      break;
    }
  }
  for (std::uint32_t& node : nodes) {
    if (node != no_node) node = same[node];
  }
  Mesh mesh;
  mesh.on_sphere = true;
  std::vector<std::uint32_t> cell;
  for (std::size_t c = 0; c * width < nodes.size(); ++c) {
    cell.clear();
    bool padded = false;
    for (std::size_t i = c * width; i < (c + 1) * width; ++i) {
      if (nodes[i] == no_node) {
        padded = true;
      } else if (padded) {
        return bad_cell(name, c, "has a corner after its padding");
      } else {
        cell.push_back(nodes[i]);
      }
    }
    if (auto added = add_cell(cell, c, name, mesh); !added) return added.error();
  }
  mesh.x = std::move(x);
  mesh.y = std::move(y);
  return mesh;
}

Result<Mesh> read_mesh(const ArrayFile& file, const Topology& topology,
                       std::vector<std::string>& notes) {
  return MeshReader(file, topology, notes).read();
}

}  // namespace windsplat::data::cf
