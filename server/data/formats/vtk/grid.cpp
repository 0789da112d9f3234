// Coordinates along i, j, k -> ascending coordinates along x, y, z.
#include "server/data/formats/vtk/grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace windsplat::data::vtk {

namespace {

using Coordinates = std::array<std::vector<double>, 3>;

// 1 ascending, -1 descending, 0 neither, or not finite. One coordinate ascends.
int direction_of(const std::vector<double>& values) {
  if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) {
    return 0;
  }
  if (values.size() < 2) return 1;
  const bool up = values[1] > values[0];
  for (std::size_t i = 1; i < values.size(); ++i) {
    if (up ? !(values[i] > values[i - 1]) : !(values[i] < values[i - 1])) return 0;
  }
  return up ? 1 : -1;
}

// by_index: coordinates along i, j, k. False if one of them is not strictly monotonic.
bool orient(Coordinates by_index, RegularGrid& grid) {
  for (std::size_t a = 0; a < 3; ++a) {
    const int direction = direction_of(by_index[a]);
    if (direction == 0) return false;
    grid.turned[a] = direction < 0;
    if (grid.turned[a]) std::reverse(by_index[a].begin(), by_index[a].end());
    grid.coordinates.at(grid.world[a]) = std::move(by_index[a]);
  }
  return true;
}

Result<RegularGrid> image_grid(const InputFile& file, const Snapshot& snapshot) {
  RegularGrid grid;
  Coordinates by_index;
  const auto counts = snapshot.whole.points();
  std::array<bool, 3> taken{};
  for (std::size_t a = 0; a < 3; ++a) {
    std::size_t world = 0;
    for (std::size_t w = 1; w < 3; ++w) {
      if (std::abs(snapshot.place.direction.at(3 * w + a)) >
          std::abs(snapshot.place.direction.at(3 * world + a))) {
        world = w;
      }
    }
    const double along = snapshot.place.direction.at(3 * world + a);
    for (std::size_t w = 0; w < 3; ++w) {
      const double wanted = w == world ? 1.0 : 0.0;
      if (!(std::abs(std::abs(snapshot.place.direction.at(3 * w + a)) - wanted) < 1e-6) ||
          taken.at(world)) {
        return file.fault(
            "has a Direction whose axes are not those of x, y and z, which is not "
            "supported; resample it onto an axis-aligned image first");
      }
    }
    taken.at(world) = true;
    grid.world[a] = world;
    const double step = snapshot.place.spacing[a] * (along < 0 ? -1.0 : 1.0);
    // Index 0 is at the origin even if the extent begins at another index; axes are independent.
    for (std::int64_t i = 0; i < counts[a]; ++i) {
      by_index[a].push_back(snapshot.place.origin.at(world) +
                            step * static_cast<double>(snapshot.whole.first[a] + i));
    }
  }
  if (!orient(std::move(by_index), grid)) {
    return file.fault("has an Origin or Spacing that is zero or not finite");
  }
  return grid;
}

// Writes the coordinates of a piece; false if they differ from those of another piece.
bool place_coordinates(const std::vector<double>& values, std::size_t first,
                       std::vector<double>& out) {
  const double extent = values.size() > 1 ? values.back() - values.front() : values.front();
  const double tolerance = 1e-6 * std::abs(extent);
  for (std::size_t i = 0; i < values.size(); ++i) {
    double& at = out[first + i];
    if (std::isfinite(at) && std::abs(at - values[i]) > tolerance) return false;
    if (!std::isfinite(at)) at = values[i];
  }
  return true;
}

Result<RegularGrid> rectilinear_grid(Files& files, const Snapshot& snapshot) {
  RegularGrid grid;
  Coordinates by_index;
  const auto counts = snapshot.whole.points();
  for (std::size_t a = 0; a < 3; ++a) {
    auto& out = by_index[a];
    out.assign(static_cast<std::size_t>(counts[a]), std::numeric_limits<double>::quiet_NaN());
    for (const Piece& piece : snapshot.pieces) {
      const auto file = piece.file.open(files);
      if (!file) return file.error();
      const auto values = read_all(*file, piece.coordinates.at(a));
      if (!values) return values.error();
      const auto first = static_cast<std::size_t>(piece.extent.first[a] - snapshot.whole.first[a]);
      if (!place_coordinates(*values, first, out)) {
        return (*file)->fault("has coordinates that differ from those of another piece");
      }
    }
  }
  if (!orient(std::move(by_index), grid)) {
    return snapshot.file->fault(
        "has coordinates that are missing, not finite or not strictly monotonic");
  }
  return grid;
}

}  // namespace

Result<RegularGrid> regular_grid(Files& files, const Snapshot& snapshot) {
  return snapshot.kind == Kind::image ? image_grid(*snapshot.file, snapshot)
                                      : rectilinear_grid(files, snapshot);
}

std::optional<RegularGrid> separable_grid(const std::vector<double>& points,
                                          const std::array<std::int64_t, 3>& counts) {
  const std::array<std::size_t, 3> n{static_cast<std::size_t>(counts[0]),
                                     static_cast<std::size_t>(counts[1]),
                                     static_cast<std::size_t>(counts[2])};
  const std::array<std::size_t, 3> stride{1, n[0], n[0] * n[1]};
  const auto at = [&](std::size_t point, std::size_t world) { return points[3 * point + world]; };
  RegularGrid grid;
  std::array<double, 3> tolerance{};
  std::array<bool, 3> given{};
  // Index axes longer than 1 get the world axis along which they change most, the others the rest.
  for (std::size_t w = 0; w < 3; ++w) {
    double low = at(0, w);
    double high = low;
    for (std::size_t p = 0; p < n[0] * n[1] * n[2]; ++p) {
      if (!std::isfinite(at(p, w))) return {};
      low = std::min(low, at(p, w));
      high = std::max(high, at(p, w));
    }
    tolerance[w] = 1e-6 * (high - low);
  }
  for (const bool long_ones : {true, false}) {
    for (std::size_t a = 0; a < 3; ++a) {
      if ((n[a] > 1) != long_ones) continue;
      std::size_t best = 3;
      double most = -1;
      for (std::size_t w = 0; w < 3; ++w) {
        const double change = std::abs(at(stride[a] * (n[a] - 1), w) - at(0, w));
        if (!given.at(w) && change > most) {
          best = w;
          most = change;
        }
      }
      given.at(best) = true;
      grid.world[a] = best;
    }
  }
  Coordinates by_index;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t i = 0; i < n[a]; ++i) by_index[a].push_back(at(i * stride[a], grid.world[a]));
  }
  for (std::size_t p = 0; p < n[0] * n[1] * n[2]; ++p) {
    const std::array<std::size_t, 3> index{p % n[0], p / stride[1] % n[1], p / stride[2]};
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t w = grid.world[a];
      if (std::abs(at(p, w) - by_index[a][index[a]]) > tolerance.at(w)) return {};
    }
  }
  if (!orient(std::move(by_index), grid)) return {};
  return grid;
}

RegularGrid cell_centres(const RegularGrid& points) {
  RegularGrid out = points;
  for (auto& axis : out.coordinates) {
    if (axis.size() < 2) continue;
    for (std::size_t i = 0; i + 1 < axis.size(); ++i) axis[i] += (axis[i + 1] - axis[i]) / 2;
    axis.pop_back();
  }
  return out;
}

}  // namespace windsplat::data::vtk
