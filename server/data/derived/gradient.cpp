// Row by row over all levels, so that the local axes of five rows are in memory.
#include "server/data/derived/gradient.hpp"

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <glm/vec3.hpp>
#include <limits>
#include <utility>

#include "server/data/cf/fields/rotation.hpp"
#include "server/data/cf/units.hpp"
#include "server/data/derived/lengths.hpp"

namespace windsplat::data::derived {

namespace {

constexpr double apart_min_m = 0.01;  // of neighbours on the sphere

// Position of a column at height 0, and its local axes.
struct Frame {
  glm::dvec3 place{0};
  glm::dvec3 x{1, 0, 0};
  glm::dvec3 y{0, 1, 0};
  glm::dvec3 up{0, 0, 1};
};

class Frames {
 public:
  Frames(const Grid& grid, Surface surface) : grid_(grid), surface_(surface) {
    width_ = grid.axes[0].coordinates.size();
    if (grid.columns) bearing_ = cf::bearing_of(*grid.columns, width_);
  }

  [[nodiscard]] double side() const { return static_cast<double>(bearing_.side); }

  // Valid until a row five or more away is asked for.
  const std::vector<Frame>& row(std::size_t j) {
    Row& kept = rows_[j % rows_.size()];
    if (kept.index == j) return kept.frames;
    kept.index = j;
    kept.frames.resize(width_);
    for (std::size_t i = 0; i < width_; ++i) {
      kept.frames[i] = surface_ == Surface::plane ? on_plane(i, j) : on_sphere(i, j);
    }
    return kept.frames;
  }

 private:
  [[nodiscard]] Frame on_plane(std::size_t i, std::size_t j) const {
    const auto& [x, y, z] = grid_.axes;
    Frame frame;
    frame.place = {x.coordinates[i] * metres_in(x.units).value_or(1),
                   y.coordinates[j] * metres_in(y.units).value_or(1), 0};
    return frame;
  }

  [[nodiscard]] Frame on_sphere(std::size_t i, std::size_t j) const {
    const std::size_t column = j * width_ + i;
    const Columns* columns = grid_.columns.get();
    const double longitude =
        degree * (columns ? columns->longitude[column] : grid_.axes[0].coordinates[i]);
    const double latitude =
        degree * (columns ? columns->latitude[column] : grid_.axes[1].coordinates[j]);
    const glm::dvec3 east(-std::sin(longitude), std::cos(longitude), 0);
    Frame frame;
    frame.up = {std::cos(latitude) * east.y, -std::cos(latitude) * east.x, std::sin(latitude)};
    const glm::dvec3 north = glm::cross(frame.up, east);
    frame.place = earth_radius_m * frame.up;
    frame.x = east;
    frame.y = north;
    if (columns) {
      const auto to_east = static_cast<double>(bearing_.east[column]);
      const auto to_north = static_cast<double>(bearing_.north[column]);
      frame.x = to_east * east + to_north * north;
      frame.y = side() * (to_east * north - to_north * east);
    }
    return frame;
  }

  struct Row {
    std::size_t index = std::numeric_limits<std::size_t>::max();
    std::vector<Frame> frames;
  };
  const Grid& grid_;
  Surface surface_;
  std::size_t width_ = 0;
  cf::GridBearing bearing_;
  std::array<Row, 5> rows_;
};

// The vertical coordinate of differences: heights of the levels, otherwise the axis.
std::vector<double> vertical_coordinates(const Grid& grid, const Heights& heights) {
  if (!heights.level.empty()) return heights.level;
  return grid.axes[2].coordinates;
}

class Gradients {
 public:
  Gradients(const Grid& grid, const VectorField& field, const Heights& heights)
      : surface_(surface_of(grid)),
        frames_(grid, surface_),
        field_(field),
        heights_(heights),
        x_(along_x(grid)),
        y_(grid.axes[1].coordinates),
        z_(vertical_coordinates(grid, heights)),
        dims_(grid.dims()),
        width_(static_cast<std::size_t>(dims_[0])),
        layer_(width_ * static_cast<std::size_t>(dims_[1])) {}

  void run(const std::function<void(const LocalGradient&)>& body, const Progress& tell) {
    LocalGradient out;
    out.side = frames_.side();
    const auto rows = static_cast<std::size_t>(dims_[1]);
    for (std::size_t j = 0; j < rows; ++j) {
      for (std::size_t k = 0; k < static_cast<std::size_t>(dims_[2]); ++k) {
        for (std::size_t i = 0; i < width_; ++i) {
          out.sample = k * layer_ + j * width_ + i;
          if (find(i, j, k, out)) body(out);
        }
      }
      tell(static_cast<double>(j + 1) / static_cast<double>(rows));
    }
  }

 private:
  // Derivatives along an axis.
  struct Change {
    glm::dvec3 place{0};
    glm::dvec3 field{0};
    void add(double weight, const glm::dvec3& at, const glm::dvec3& value) {
      place += weight * at;
      field += weight * value;
    }
  };

  [[nodiscard]] bool is_usable(std::size_t sample) const {
    return !std::isnan(field_.component[0][sample]);
  }

  [[nodiscard]] glm::dvec3 value(const Frame& frame, std::size_t sample) const {
    const auto part = [&](std::size_t c) {
      const float* values = field_.component[c];
      return values == nullptr ? 0 : field_.factor[c] * static_cast<double>(values[sample]);
    };
    return part(0) * frame.x + part(1) * frame.y + part(2) * frame.up;
  }

  [[nodiscard]] glm::dvec3 place(const Frame& frame, std::size_t sample) const {
    if (!heights_.any) return frame.place;
    const double height = heights_.level.empty() ? static_cast<double>(heights_.sample[sample])
                                                 : heights_.level[sample / layer_];
    return frame.place + height * frame.up;
  }

  // Neighbours that coincide have no direction.
  [[nodiscard]] bool is_apart(const Change& change, const Stencil& stencil) const {
    return surface_ == Surface::plane || glm::length(change.place) * stencil.span >= apart_min_m;
  }

  bool find(std::size_t i, std::size_t j, std::size_t k, LocalGradient& out) {
    const std::size_t here = out.sample;
    if (!is_usable(here)) return false;
    const std::vector<Frame>& row = frames_.row(j);
    const std::size_t row_start = here - i;
    const Stencil along_x = x_.at(i, [&](std::size_t m) { return is_usable(row_start + m); });
    const std::size_t column_start = here - j * width_;
    const Stencil along_y =
        y_.at(j, [&](std::size_t m) { return is_usable(column_start + m * width_); });
    if (along_x.count == 0 || along_y.count == 0) return false;
    Change x;
    for (std::size_t m = 0; m < along_x.count; ++m) {
      const std::size_t at = along_x.at[m];
      x.add(along_x.weight[m], place(row[at], row_start + at), value(row[at], row_start + at));
    }
    Change y;
    for (std::size_t m = 0; m < along_y.count; ++m) {
      const Frame& frame = frames_.row(along_y.at[m])[i];
      const std::size_t at = column_start + along_y.at[m] * width_;
      y.add(along_y.weight[m], place(frame, at), value(frame, at));
    }
    if (!is_apart(x, along_x) || !is_apart(y, along_y)) return false;
    const Frame& frame = row[i];
    Change z;
    z.place = frame.up;
    if (heights_.any && !add_vertical(frame, here, k, z)) return false;
    const glm::dmat3 places(x.place, y.place, z.place);
    if (glm::determinant(places) == 0) return false;
    const glm::dmat3 local(frame.x, frame.y, frame.up);
    out.gradient = glm::transpose(local) * glm::dmat3(x.field, y.field, z.field) *
                   glm::inverse(places) * local;
    return true;
  }

  bool add_vertical(const Frame& frame, std::size_t here, std::size_t k, Change& z) const {
    const std::size_t bottom = here - k * layer_;
    const Stencil along = z_.at(k, [&](std::size_t m) { return is_usable(bottom + m * layer_); });
    z.place = glm::dvec3(0);
    for (std::size_t m = 0; m < along.count; ++m) {
      const std::size_t at = bottom + along.at[m] * layer_;
      z.add(along.weight[m], place(frame, at), value(frame, at));
    }
    return along.count > 0;
  }

  Surface surface_;
  Frames frames_;
  const VectorField& field_;
  const Heights& heights_;
  Along x_;
  Along y_;
  Along z_;
  std::array<int, 3> dims_;
  std::size_t width_;
  std::size_t layer_;
};

}  // namespace

glm::dvec3 LocalGradient::curl() const {
  return side * glm::dvec3(gradient[1][2] - gradient[2][1], gradient[2][0] - gradient[0][2],
                           gradient[0][1] - gradient[1][0]);
}

double LocalGradient::trace() const { return gradient[0][0] + gradient[1][1] + gradient[2][2]; }

void for_gradients(const Grid& grid, const VectorField& field, const Heights& heights,
                   const std::function<void(const LocalGradient&)>& body, const Progress& tell) {
  Gradients(grid, field, heights).run(body, tell);
}

}  // namespace windsplat::data::derived
