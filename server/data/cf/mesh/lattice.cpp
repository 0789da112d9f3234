#include "server/data/cf/mesh/lattice.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

namespace windsplat::data::cf {

namespace {

constexpr double samples_within_min = 1024;

double cosine_of_degrees(double degrees) { return std::cos(degrees * std::numbers::pi / 180); }

// Which longitudes the cells cover, in bins of a tenth of a degree.
class Meridians {
 public:
  void cover(double low, double high) {
    const auto from = static_cast<std::ptrdiff_t>(std::floor(low * 10));
    const auto to = static_cast<std::ptrdiff_t>(std::floor(high * 10));
    for (auto bin = from; bin <= std::min(to, from + count - 1); ++bin) {
      covered_.at(static_cast<std::size_t>(((bin % count) + count) % count)) = true;
    }
  }
  // The end of the longest gap; nullopt if there is none.
  [[nodiscard]] std::optional<double> end_of_gap() const {
    std::ptrdiff_t longest = 0;
    std::ptrdiff_t end = 0;
    std::ptrdiff_t run = 0;
    for (std::ptrdiff_t bin = 0; bin < 2 * count; ++bin) {
      run = covered_.at(static_cast<std::size_t>(bin % count)) ? 0 : run + 1;
      if (run > longest) {
        longest = run;
        end = bin + 1;
      }
    }
    if (longest == 0 || longest >= count) return std::nullopt;
    return static_cast<double>(end % count) / 10;
  }

 private:
  static constexpr std::ptrdiff_t count = 3600;
  std::vector<bool> covered_ = std::vector<bool>(static_cast<std::size_t>(count));
};

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
};

// What the cells say about the lattice.
struct Survey {
  std::vector<float> sizes;  // square roots of areas, in units of y
  double area = 0;           // in the plane
  Extent x;
  Extent y;
  Meridians meridians;
  std::size_t no_area = 0;
};

Survey survey_of(const Mesh& mesh) {
  Survey out;
  out.sizes.reserve(mesh.cells());
  Outline outline;
  for (std::size_t c = 0; c < mesh.cells(); ++c) {
    const bool has_outline = outline_of(mesh, c, outline);
    const double area = has_outline ? std::abs(doubled_area(outline.points)) / 2 : 0;
    double sum_y = 0;
    for (const PlanePoint& point : outline.points) sum_y += point[1];
    const double shrink =
        mesh.on_sphere && has_outline
            ? cosine_of_degrees(sum_y / static_cast<double>(outline.points.size()))
            : 1;
    const auto size = static_cast<float>(std::sqrt(area * shrink));
    if (!(size > 0)) {
      ++out.no_area;
      continue;
    }
    Extent x;
    for (const PlanePoint& point : outline.points) {
      x.add(point[0]);
      out.y.add(point[1]);
    }
    out.x.add(x.low);
    out.x.add(x.high);
    if (mesh.on_sphere) out.meridians.cover(x.low, x.high);
    out.area += area;
    out.sizes.push_back(size);
  }
  return out;
}

LatticeAxis axis_over(double low, double high, double spacing, std::size_t most) {
  LatticeAxis axis;
  const double wanted = std::ceil((high - low) / spacing - 1e-9);
  const double count = std::clamp(wanted, 1.0, std::max(1.0, static_cast<double>(most)));
  axis.count = static_cast<std::size_t>(count);
  axis.spacing = (high - low) / count;
  axis.first = low + axis.spacing / 2;
  return axis;
}

// The columns between crossings of a row, even-odd.
class RowFiller {
 public:
  RowFiller(const MeshLattice& lattice, CellsOfSamples& out) : lattice_(lattice), out_(out) {}

  void fill(const Outline& outline, std::size_t cell) {
    Extent y;
    for (const PlanePoint& point : outline.points) y.add(point[1]);
    const LatticeAxis& rows = lattice_.y;
    const double low = std::ceil((y.low - rows.first) / rows.spacing) - 1;
    const double high = std::floor((y.high - rows.first) / rows.spacing) + 1;
    const double last = static_cast<double>(rows.count) - 1;
    if (high < 0 || low > last) return;
    const auto from = static_cast<std::size_t>(std::max(low, 0.0));
    const auto to = static_cast<std::size_t>(std::min(high, last));
    bool hit = false;
    for (std::size_t j = from; j <= to; ++j) hit = fill_row(outline, cell, j) || hit;
    work_ += to - from + 1;
    out_.hit += hit ? 1 : 0;
  }
  // Rows and samples visited.
  [[nodiscard]] std::size_t work() const { return work_ + out_.inside + out_.twice; }

 private:
  bool fill_row(const Outline& outline, std::size_t cell, std::size_t j) {
    const double y = lattice_.y.at(j);
    const auto columns = static_cast<std::ptrdiff_t>(lattice_.x.count);
    crossings_.clear();
    for (const OutlineEdge& edge : outline.edges) {
      if ((edge.from[1] <= y) == (edge.to[1] <= y)) continue;
      const double part = (y - edge.from[1]) / (edge.to[1] - edge.from[1]);
      const double x = edge.from[0] + part * (edge.to[0] - edge.from[0]);
      const double column = std::ceil((x - lattice_.x.first) / lattice_.x.spacing);
      const auto limit = static_cast<double>(4 * columns);
      crossings_.push_back(static_cast<std::ptrdiff_t>(std::clamp(column, -limit, limit)) +
                           edge.turns * columns);
    }
    std::sort(crossings_.begin(), crossings_.end());
    bool hit = false;
    for (std::size_t k = 0; k + 1 < crossings_.size(); k += 2) {
      for (auto i = crossings_[k]; i < crossings_[k + 1]; ++i) {
        const auto column = lattice_.closes ? ((i % columns) + columns) % columns : i;
        if (column < 0 || column >= columns) continue;
        std::uint32_t& at = out_.cells[j * lattice_.x.count + static_cast<std::size_t>(column)];
        hit = true;
        if (at == no_mesh_cell) {
          at = static_cast<std::uint32_t>(cell);
          ++out_.inside;
        } else {
          ++out_.twice;
        }
      }
    }
    return hit;
  }

  const MeshLattice& lattice_;
  CellsOfSamples& out_;
  std::vector<std::ptrdiff_t> crossings_;
  std::size_t work_ = 0;
};

// Turns the longitudes of the nodes to [base, base + 360).
void turn_longitudes(Mesh& mesh, double base) {
  for (double& x : mesh.x) {
    x -= 360 * std::floor((x - base) / 360);
    if (x >= base + 360) x = base;
  }
}

void set_spacing(const Survey& survey, std::size_t samples_max, double shrink, MeshLattice& out) {
  const double within = survey.area * shrink;  // in squares of units of y
  double spacing = out.median_size / std::numbers::sqrt2;
  spacing = std::min(spacing, std::sqrt(within / samples_within_min));
  const double whole = (survey.x.high - survey.x.low) * shrink * (survey.y.high - survey.y.low);
  const double least_spacing = std::sqrt(whole / static_cast<double>(samples_max));
  out.is_coarse = spacing < least_spacing;
  spacing = std::max(spacing, least_spacing);
  out.x = axis_over(survey.x.low, survey.x.high, spacing / shrink, samples_max);
  // An axis of one sample leaves the other the rest.
  out.y = axis_over(survey.y.low, survey.y.high, spacing, samples_max / out.x.count);
}

}  // namespace

Result<MeshLattice> lattice_of(Mesh& mesh, std::size_t samples_max) {
  Survey survey = survey_of(mesh);
  MeshLattice out;
  out.no_area = survey.no_area;
  if (survey.sizes.empty()) {
    return make_error(ErrorKind::bad_data, "no cell of the mesh has an area");
  }
  double shrink = 1;
  if (mesh.on_sphere) {
    const auto gap_end = survey.meridians.end_of_gap();
    const auto [low, high] = std::minmax_element(mesh.x.begin(), mesh.x.end());
    out.closes = !gap_end;
    // Longitudes are written like those of the file where possible.
    const double start = *low >= 0 && *high > 180 ? 0 : -180;
    double base = gap_end.value_or(start);
    if (gap_end && base > 180 && start < 0) base -= 360;
    turn_longitudes(mesh, base);
    survey.x = {base, base + 360};
    if (gap_end) {
      survey.x = {};
      for (const std::uint32_t node : mesh.corners) {
        if (!mesh.is_pole(node)) survey.x.add(mesh.x[node]);
      }
    }
    const bool crosses = survey.y.low <= 0 && survey.y.high >= 0;
    const double nearest = crosses ? 0 : std::min(std::abs(survey.y.low), std::abs(survey.y.high));
    shrink = std::max(cosine_of_degrees(nearest), 0.01);
  }
  const auto middle = survey.sizes.begin() + static_cast<std::ptrdiff_t>(survey.sizes.size() / 2);
  std::nth_element(survey.sizes.begin(), middle, survey.sizes.end());
  out.median_size = static_cast<double>(*middle);
  const std::size_t most =
      std::max(samples_per_cell_max * survey.sizes.size(), samples_of_small_mesh);
  set_spacing(survey, std::min(most, samples_max), shrink, out);
  return out;
}

Result<CellsOfSamples> find_cells(const Mesh& mesh, const MeshLattice& lattice) {
  const std::size_t work_max = find_cells_work_max * (lattice.samples() + mesh.corners.size());
  CellsOfSamples out;
  out.cells.assign(lattice.samples(), no_mesh_cell);
  RowFiller filler(lattice, out);
  Outline outline;
  for (std::size_t c = 0; c < mesh.cells(); ++c) {
    if (!outline_of(mesh, c, outline)) continue;
    filler.fill(outline, c);
    if (filler.work() > work_max) {
      return make_error(ErrorKind::bad_data, "the cells of the mesh overlap: at cell " +
                                                 std::to_string(c + 1) + " more than " +
                                                 std::to_string(work_max) +
                                                 " rows and samples were visited");
    }
  }
  return out;
}

}  // namespace windsplat::data::cf
