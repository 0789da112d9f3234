// Bounding box and volume -> spacing -> samples within the bounding box of every cell.
#include "server/data/formats/vtk/resample.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "server/data/cf/time.hpp"

namespace windsplat::data::vtk {

namespace {

// Limits on the work over all cells, in rows of samples within bounding boxes plus linear systems
// solved; meshes with too many overlapping cells are rejected. One limit is per sample that would
// lie in a cell without overlap (typical simulation meshes need 3 to 12), so that small files
// cannot cause much work; the other is a total (minutes).
constexpr double work_per_sample = 128;
constexpr std::uint64_t visits_per_work = 32;  // limit on visits to samples that already have a
                                               // cell
constexpr std::uint64_t work_max = std::uint64_t{1} << 31;
constexpr double samples_min_3d = 4096;
constexpr double samples_min_2d = 1024;
// Mean extents that differ by a smaller ratio get the same spacing.
constexpr double even_ratio = 1.25;
constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();

struct Box {
  Point low{0, 0, 0};
  Point high{0, 0, 0};
};

Box box_of(const Point* points, std::size_t count) {
  Box box{points[0], points[0]};
  for (std::size_t p = 1; p < count; ++p) {
    for (std::size_t d = 0; d < 3; ++d) {
      box.low[d] = std::min(box.low[d], points[p][d]);
      box.high[d] = std::max(box.high[d], points[p][d]);
    }
  }
  return box;
}

Error refuse(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

// Sums of the extents of cells of one rank along the world axes.
struct Extents {
  std::uint64_t cells = 0;
  Box all;
  Point across{0, 0, 0};               // extents of bounding boxes
  std::array<Point, 3> along_index{};  // for hexahedra: edges along i, j, k
};

void add(Extents& to, const Corners& corners, std::size_t count) {
  const Box box = box_of(corners.data(), count);
  if (to.cells++ == 0) to.all = box;
  constexpr std::array<std::size_t, 3> next{1, 3, 4};  // edges from corner 0 along i, j, k
  for (std::size_t d = 0; d < 3; ++d) {
    to.all.low[d] = std::min(to.all.low[d], box.low[d]);
    to.all.high[d] = std::max(to.all.high[d], box.high[d]);
    to.across[d] += box.high[d] - box.low[d];
    for (std::size_t a = 0; a < 3 && count == 8; ++a) {
      to.along_index[a][d] += std::abs(corners[next[a]][d] - corners[0][d]);
    }
  }
}

class Resampler {
 public:
  explicit Resampler(const Mesh& mesh) : mesh_(mesh) {}

  Result<Resampling> run() {
    if (auto done = measure_all(); !done) return done.error();
    if (auto done = make_lattice(); !done) return done.error();
    const std::size_t samples = dims_[0] * dims_[1] * dims_[2];
    out_.cells.assign(samples, no_cell);
    out_.places.resize(samples);
    for (std::uint64_t c = 0; c < mesh_.cell_count(); ++c) {
      if (auto done = scan(c); !done) return done.error();
    }
    if (out_.inside == 0) return refuse("has no cell that contains a sample of its bounding box");
    return std::move(out_);
  }

 private:
  // The corners of a cell, permuted such that the axes of a plane come first; Shape::none if
  // skipped.
  Shape corners_of_cell(std::uint64_t cell, Corners& out) const {
    std::array<std::uint32_t, 8> index{};
    const Shape shape = mesh_.cell(cell, index);
    for (std::size_t i = 0; i < static_cast<std::size_t>(corners_of(shape)); ++i) {
      for (std::size_t d = 0; d < 3; ++d) {
        out[i][d] = mesh_.points[3 * std::size_t{index[i]} + order_[d]];
        if (!std::isfinite(out[i][d])) return Shape::none;
      }
    }
    return shape;
  }

  // Computes the mean extent of cells and the number of layers along each axis. For a structured
  // grid aligned with the axes, index steps are more accurate than bounding boxes, whose height
  // exceeds the thickness of sloping layers.
  void measure_extents(const Extents& sum) {
    const auto cells = static_cast<double>(sum.cells);
    std::array<std::size_t, 3> index_of{3, 3, 3};
    for (std::size_t a = 0; a < 3 && rank_ == 3 && mesh_.counts[0] != 0; ++a) {
      std::size_t most = 0;
      const auto share = [&](std::size_t d) {
        return sum.along_index[a][d] / (sum.all.high[d] - sum.all.low[d]);
      };
      for (std::size_t d = 1; d < 3; ++d) {
        if (share(d) > share(most)) most = d;
      }
      index_of.at(most) = a;
    }
    const bool by_index = std::count(index_of.begin(), index_of.end(), std::size_t{3}) == 0;
    for (std::size_t d = 0; d < 3; ++d) {
      cell_[d] = (by_index ? sum.along_index.at(index_of[d])[d] : sum.across[d]) / cells;
      out_.layers[d] = by_index ? static_cast<double>(mesh_.counts.at(index_of[d]) - 1)
                                : (sum.all.high[d] - sum.all.low[d]) / cell_[d];
    }
  }

  // Computes the bounding box and total volume (or area) of the cells of the highest rank.
  Result<void> measure_all() {
    std::array<Extents, 4> of_rank{};
    Corners corners{};
    for (std::uint64_t c = 0; c < mesh_.cell_count(); ++c) {
      const Shape shape = corners_of_cell(c, corners);
      const auto rank = static_cast<std::size_t>(dimension_of(shape));
      if (rank == 0) {
        std::array<std::uint32_t, 8> index{};
        if (mesh_.cell(c, index) != Shape::none) ++out_.broken;
        continue;
      }
      add(of_rank.at(rank), corners, static_cast<std::size_t>(corners_of(shape)));
    }
    rank_ = of_rank[3].cells > 0 ? 3 : 2;
    const Extents& sum = of_rank.at(rank_);
    if (sum.cells == 0) return refuse("has no cells of a supported kind");
    out_.other_rank = rank_ == 3 ? of_rank[2].cells : 0;
    box_ = sum.all;
    measure_extents(sum);
    if (rank_ == 2) {
      if (auto done = find_plane(); !done) return done;
    }
    for (std::uint64_t c = 0; c < mesh_.cell_count(); ++c) {
      const Shape shape = corners_of_cell(c, corners);
      if (shape != Shape::none && dimension_of(shape) == static_cast<int>(rank_)) {
        volume_ += measure(shape, corners);
      }
    }
    return {};
  }

  // If the cells are in a plane x, y or z = constant, puts the axes of the plane first.
  Result<void> find_plane() {
    std::size_t flat = 0;
    double longest = 0;
    for (std::size_t d = 0; d < 3; ++d) {
      const double length = box_.high[d] - box_.low[d];
      if (length <= box_.high[flat] - box_.low[flat]) flat = d;
      longest = std::max(longest, length);
    }
    if (box_.high[flat] - box_.low[flat] > 1e-6 * longest) {
      return refuse("is a surface in space without volume");
    }
    order_ = {flat == 0 ? 1U : 0U, flat == 2 ? 1U : 2U, flat};
    const Box turned = box_;
    const Point cell = cell_;
    for (std::size_t d = 0; d < 3; ++d) {
      cell_[d] = cell.at(order_[d]);
      box_.low[d] = turned.low.at(order_[d]);
      box_.high[d] = turned.high.at(order_[d]);
    }
    return {};
  }

  // Desired number of samples within cells.
  [[nodiscard]] double wanted_samples() const {
    return std::max(rank_ == 3 ? samples_min_3d : samples_min_2d,
                    0.5 * static_cast<double>(mesh_.point_count() + mesh_.cell_count()));
  }

  [[nodiscard]] std::uint64_t work_allowed() const {
    const double share = work_per_sample * wanted_samples();
    return share < static_cast<double>(work_max) ? static_cast<std::uint64_t>(share) : work_max;
  }

  // Spacing of samples along each axis, before fitting to the box. Errors: no volume.
  Result<Point> wanted_spacing(const Point& length) const {
    double volume = 1;
    double of_cell = 1;
    double longest = 0;
    double low = cell_[0];
    double high = cell_[0];
    for (std::size_t d = 0; d < rank_; ++d) {
      volume *= length[d];
      of_cell *= cell_[d];
      longest = std::max(longest, length[d]);
      low = std::min(low, cell_[d]);
      high = std::max(high, cell_[d]);
    }
    if (!std::isfinite(volume) || !(volume > 0) || !(volume_ > 0) || !(of_cell > 0)) {
      return refuse("has cells without any volume");
    }
    const double room = std::min(volume_, volume) / wanted_samples();
    const double exponent = 1.0 / static_cast<double>(rank_);
    Point out{};
    if (high < even_ratio * low) {
      // A common spacing that divides the longest side.
      const double spacing = std::pow(room, exponent);
      out.fill(longest / std::max(1.0, std::round(longest / spacing)));
      return out;
    }
    const double factor = std::pow(room / of_cell, exponent);
    for (std::size_t d = 0; d < rank_; ++d) {
      out[d] = length[d] / std::max(1.0, std::round(length[d] / (factor * cell_[d])));
    }
    return out;
  }

  Result<void> make_lattice() {
    Point length{};
    for (std::size_t d = 0; d < rank_; ++d) length[d] = box_.high[d] - box_.low[d];
    const auto spacing = wanted_spacing(length);
    if (!spacing) return spacing.error();
    for (std::size_t d = 0; d < 3; ++d) {
      std::vector<double>& axis = out_.coordinates.at(order_[d]);
      if (d >= rank_) {
        axis = {box_.low[d]};
        continue;
      }
      // The remainder of the box is divided between both sides. A box thinner than a step, or with
      // more steps than allowed, is sampled from end to end.
      const double fitting = std::floor(length[d] / (*spacing)[d] * (1 + 1e-9));
      const double count = std::clamp(fitting, 1.0, lattice_axis_max - 1.0);
      spacing_[d] = count == fitting ? (*spacing)[d] : length[d] / count;
      first_[d] = box_.low[d] + std::max(0.0, (length[d] - count * spacing_[d]) / 2);
      dims_[d] = static_cast<std::size_t>(count) + 1;
      for (std::size_t i = 0; i < dims_[d]; ++i) {
        axis.push_back(first_[d] + spacing_[d] * static_cast<double>(i));
      }
      if (!(axis[1] > axis[0]))
        return refuse("has cells too small for their distance from the origin");
    }
    std::array<std::size_t, 3> by_axis{1, 1, 1};
    for (std::size_t d = 0; d < 3; ++d) by_axis.at(order_[d]) = dims_[d];
    for (std::size_t d = 0; d < 3; ++d) {
      stride_[d] = order_[d] == 0 ? 1 : by_axis[0] * (order_[d] == 1 ? 1 : by_axis[1]);
    }
    return {};
  }

  // The half-open range of the samples from `low` to `high` along one axis.
  [[nodiscard]] std::array<std::size_t, 2> range(std::size_t d, double low, double high) const {
    if (d >= rank_) return {0, 1};
    constexpr double slack = 1e-6;
    const double from = std::ceil((low - first_[d]) / spacing_[d] - slack);
    const double to = std::floor((high - first_[d]) / spacing_[d] + slack) + 1;
    const auto last = static_cast<double>(dims_[d]);
    return {static_cast<std::size_t>(std::clamp(from, 0.0, last)),
            static_cast<std::size_t>(std::clamp(to, 0.0, last))};
  }

  Result<void> scan(std::uint64_t cell) {
    Corners corners{};
    const Shape shape = corners_of_cell(cell, corners);
    if (shape == Shape::none || dimension_of(shape) != static_cast<int>(rank_)) return {};
    if (!(measure(shape, corners) > 0)) {
      ++out_.broken;
      return {};
    }
    ++out_.shown;
    const Box box = box_of(corners.data(), static_cast<std::size_t>(corners_of(shape)));
    std::array<std::array<std::size_t, 2>, 3> span{};
    for (std::size_t d = 0; d < 3; ++d) span[d] = range(d, box.low[d], box.high[d]);
    for (std::size_t d = 0; d < 3; ++d) {
      if (span[d][1] <= span[d][0]) return {};
    }
    const SlantedBox slanted(shape, corners);
    const std::uint64_t allowed = work_allowed();
    for (std::size_t k = span[2][0]; k < span[2][1]; ++k) {
      for (std::size_t j = span[1][0]; j < span[1][1]; ++j) {
        scan_row(cell, shape, corners, slanted, {span[0][0], j, k}, span[0][1] - span[0][0]);
        if (work_ > allowed) {
          return refuse("has cells that overlap, or are too thin and oblique to be resampled");
        }
      }
    }
    return {};
  }

  // Position of a sample; indices and coordinates in the order of the axes.
  [[nodiscard]] Point place_of(const std::array<std::size_t, 3>& index) const {
    Point out{};
    for (std::size_t d = 0; d < 3; ++d) out[d] = out_.coordinates.at(order_[d])[index[d]];
    return out;
  }

  // Tests those of the `count` samples along the first axis, starting at `index`, that have no cell
  // yet.
  void scan_row(std::uint64_t cell, Shape shape, const Corners& corners, const SlantedBox& slanted,
                std::array<std::size_t, 3> index, std::size_t count) {
    const auto [from, to] = slanted.along_row(place_of(index), spacing_[0], count);
    const std::size_t begin = index[0];
    work_ += 1 + (to - from) / visits_per_work;
    for (index[0] = begin + from; index[0] < begin + to; ++index[0]) {
      const std::size_t sample =
          index[0] * stride_[0] + index[1] * stride_[1] + index[2] * stride_[2];
      if (out_.cells[sample] != no_cell) continue;
      if (!find_in_cell(shape, corners, place_of(index), out_.places[sample], work_)) continue;
      out_.cells[sample] = static_cast<std::uint32_t>(cell);
      ++out_.inside;
    }
  }

  const Mesh& mesh_;
  Resampling out_;
  std::size_t rank_ = 3;
  std::array<std::size_t, 3> order_{0, 1, 2};  // world axes in the order used here
  Box box_;
  double volume_ = 0;
  Point cell_{0, 0, 0};  // mean extents
  Point first_{0, 0, 0};
  Point spacing_{1, 1, 1};
  std::array<std::size_t, 3> dims_{1, 1, 1};  // in the order of order_
  std::array<std::size_t, 3> stride_{};
  std::uint64_t work_ = 0;
};

}  // namespace

Result<Resampling> resample(const Mesh& mesh) { return Resampler(mesh).run(); }

std::vector<std::string> notes_on(const Mesh& mesh, const Resampling& where, bool of_cells) {
  constexpr std::array<const char*, 3> axes{"x", "y", "z"};
  std::vector<std::string> notes;
  std::array<std::size_t, 3> dims{};
  for (std::size_t d = 0; d < 3; ++d) dims[d] = where.coordinates.at(d).size();
  const auto samples = static_cast<double>(where.cells.size());
  const double outside = 100 * (1 - static_cast<double>(where.inside) / samples);
  std::string note = "resampled from " + std::to_string(mesh.point_count());
  note += " points and " + std::to_string(where.shown) + " cells onto ";
  note += std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x ";
  note += std::to_string(dims[2]) + " samples; ";
  note += std::to_string(std::lround(outside)) + " % lie outside all cells and are masked";
  if (of_cells) note += "; values are those of the cells, not interpolated";
  notes.push_back(std::move(note));
  for (std::size_t d = 0; d < 3; ++d) {
    const double layers = std::round(where.layers.at(d));
    if (dims.at(d) < 2 || dims.at(d) >= layers) continue;
    notes.push_back("along " + std::string(axes.at(d)) +
                    " fewer samples than cells: " + std::to_string(dims.at(d)) + " for about " +
                    cf::number_text(layers) + "; thin cells may be missed");
  }
  for (const auto& [type, count] : mesh.unread) {
    notes.push_back(std::to_string(count) + " cells of type " + std::to_string(type) + " omitted");
  }
  if (where.other_rank > 0) {
    notes.push_back(std::to_string(where.other_rank) +
                    " flat cells omitted, because there are solid ones");
  }
  if (where.broken > 0) {
    notes.push_back(std::to_string(where.broken) +
                    " cells without volume, or with hidden or non-finite points, omitted");
  }
  return notes;
}

void gather_points(const Mesh& mesh, const Resampling& where, const float* values, float* out) {
  std::array<std::uint32_t, 8> index{};
  for (std::size_t s = 0; s < where.cells.size(); ++s) {
    if (where.cells[s] == no_cell) {
      out[s] = nowhere;
      continue;
    }
    const Shape shape = mesh.cell(where.cells[s], index);
    const auto weights = corner_weights(shape, where.places[s]);
    double sum = 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(corners_of(shape)); ++i) {
      // Corners of weight 0 are ignored, even if missing.
      if (weights[i] != 0) sum += weights[i] * static_cast<double>(values[index[i]]);
    }
    out[s] = static_cast<float>(sum);
  }
}

void gather_cells(const Resampling& where, const float* values, float* out) {
  for (std::size_t s = 0; s < where.cells.size(); ++s) {
    out[s] = where.cells[s] == no_cell ? nowhere : values[where.cells[s]];
  }
}

}  // namespace windsplat::data::vtk
