// Vertices -> positions in the picture; triangles -> cells; those that cross the near plane or lie
// far outside of the picture are clipped first.
#include "server/surface/pixels.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "server/surface/raster.hpp"

namespace windsplat::surface {

namespace {

constexpr double guard = 32768;  // pixels from the middle of the picture, at most
constexpr std::int32_t beyond = std::numeric_limits<std::int32_t>::min();  // a vertex to be clipped

glm::dvec3 vec(const Point& p) { return {p[0], p[1], p[2]}; }

std::int32_t snapped(double pixels) {
  return static_cast<std::int32_t>(std::lround(pixels * pixel_parts));
}

int cell_of(std::int32_t at) { return at >> 12; }
static_assert(pixel_parts * cell_side == 1 << 12);

}  // namespace

// Sutherland and Hodgman: one plane after another.
class Pixels::Clipper {
 public:
  Clipper(const terrain::View& view, double near) : view_(view), near_(near) {}

  struct Place {
    glm::dvec3 eye{0};  // right, down and forward
    glm::dvec3 normal{0};
    double value = 0;
  };

  [[nodiscard]] std::vector<Place> operator()(std::vector<Place> polygon) const {
    for (int plane = 0; plane < 5 && !polygon.empty(); ++plane) {
      std::vector<Place> kept;
      for (std::size_t n = 0; n < polygon.size(); ++n) {
        const Place& p = polygon[n];
        const Place& q = polygon[(n + 1) % polygon.size()];
        const double dp = distance(p.eye, plane);
        const double dq = distance(q.eye, plane);
        if (dp >= 0) kept.push_back(p);
        // From the inside out, so that neighbours find the same place.
        if (dp >= 0 && dq < 0) kept.push_back(between(p, q, dp / (dp - dq)));
        if (dp < 0 && dq >= 0) kept.push_back(between(q, p, dq / (dq - dp)));
      }
      polygon = std::move(kept);
    }
    return polygon;
  }

 private:
  [[nodiscard]] double distance(const glm::dvec3& at, int plane) const {
    if (plane == 0) return at.z - near_;
    const double reach = 0.99 * guard * view_.pixel * (view_.perspective ? at.z : 1.0);
    const double aside = plane <= 2 ? at.x : at.y;
    return plane % 2 == 0 ? reach - aside : reach + aside;
  }
  static Place between(const Place& p, const Place& q, double part) {
    return {p.eye + part * (q.eye - p.eye), p.normal + part * (q.normal - p.normal),
            p.value + part * (q.value - p.value)};
  }

  const terrain::View& view_;
  double near_;
};

Pixels::Vertex Pixels::project(const Point& place) const {
  const glm::dvec3 at = vec(place) - view_.eye;
  Vertex out;
  out.depth = glm::dot(at, view_.forward);
  out.x = beyond;
  if (view_.perspective && !(out.depth >= view_.near)) return out;
  const double scale = 1 / (view_.pixel * (view_.perspective ? out.depth : 1.0));
  const double x = glm::dot(at, view_.right) * scale;
  const double y = glm::dot(at, view_.down) * scale;
  if (!(std::abs(x) < guard && std::abs(y) < guard)) return out;
  out.x = snapped(0.5 * width_ + x);
  out.y = snapped(0.5 * height_ + y);
  return out;
}

std::size_t Pixels::surface_of(std::size_t triangle) const {
  const auto next = std::upper_bound(
      ranges_.begin(), ranges_.end(), triangle,
      [](std::size_t value, const Range& range) { return value < range.triangle; });
  return static_cast<std::size_t>(next - ranges_.begin()) - 1;
}

template <class Visit>
void Pixels::each_cell(const std::array<Vertex, 3>& triangle, const Visit& visit) const {
  const auto [left, right] = std::minmax({triangle[0].x, triangle[1].x, triangle[2].x});
  const auto [top, bottom] = std::minmax({triangle[0].y, triangle[1].y, triangle[2].y});
  const int first = std::max(cell_of(left), 0);
  const int last = std::min(cell_of(right), columns_ - 1);
  for (int row = std::max(cell_of(top), 0); row <= std::min(cell_of(bottom), rows_ - 1); ++row) {
    for (int column = first; column <= last; ++column) visit(cell_at(column, row));
  }
}

void Pixels::clip(const std::vector<std::uint32_t>& crossing) {
  const double lowest = std::numeric_limits<double>::lowest();
  const Clipper clipper(view_, view_.perspective ? view_.near : lowest);
  for (const std::uint32_t id : crossing) {
    const std::size_t s = surface_of(id);
    const Mesh& mesh = *(*shown_)[s].mesh;
    std::vector<Clipper::Place> polygon;
    for (const std::uint32_t v : mesh.triangles[id - ranges_[s].triangle]) {
      const glm::dvec3 at = vec(mesh.places[v]) - view_.eye;
      polygon.push_back(
          {{glm::dot(at, view_.right), glm::dot(at, view_.down), glm::dot(at, view_.forward)},
           vec(mesh.normals[v]),
           mesh.values.empty() ? 0.0 : static_cast<double>(mesh.values[v])});
    }
    polygon = clipper(std::move(polygon));
    const auto first = static_cast<std::uint32_t>(corners_.size());
    for (const Clipper::Place& corner : polygon) {
      const double scale = 1 / (view_.pixel * (view_.perspective ? corner.eye.z : 1.0));
      corners_.push_back({{snapped(0.5 * width_ + corner.eye.x * scale),
                           snapped(0.5 * height_ + corner.eye.y * scale), corner.eye.z},
                          {static_cast<float>(corner.normal.x), static_cast<float>(corner.normal.y),
                           static_cast<float>(corner.normal.z)},
                          static_cast<float>(corner.value)});
    }
    for (std::uint32_t n = 2; n < polygon.size(); ++n) {
      extra_.push_back({static_cast<std::uint16_t>(s), {first, first + n - 1, first + n}});
    }
  }
}

void Pixels::project_all(ThreadPool& pool, const CancelToken& cancel) {
  constexpr std::size_t each = 4096;
  vertices_.resize(ranges_.back().vertex);
  for (std::size_t s = 0; s < shown_->size(); ++s) {
    const std::vector<Point>& places = (*shown_)[s].mesh->places;
    Vertex* const to = vertices_.data() + ranges_[s].vertex;
    pool.run((places.size() + each - 1) / each, [&](std::size_t n, unsigned) {
      if (cancel.cancelled()) return;
      const std::size_t last = std::min(places.size(), (n + 1) * each);
      for (std::size_t v = n * each; v < last; ++v) to[v] = project(places[v]);
    });
  }
}

// Calls visit(cell, triangle) or cross(triangle).
template <class Visit, class Cross>
void Pixels::each_of_part(std::size_t part, const Visit& visit, const Cross& cross) const {
  const std::size_t parts = crossing_.size();
  const std::size_t triangles = ranges_.back().triangle;
  const std::size_t last = triangles * (part + 1) / parts;
  std::size_t id = triangles * part / parts;
  for (std::size_t s = surface_of(id); id < last; ++id) {
    while (id >= ranges_[s + 1].triangle) ++s;
    const auto& corners = (*shown_)[s].mesh->triangles[id - ranges_[s].triangle];
    const Vertex* const from = vertices_.data() + ranges_[s].vertex;
    const std::array<Vertex, 3> triangle{from[corners[0]], from[corners[1]], from[corners[2]]};
    int out = 0;
    for (const Vertex& v : triangle) out += v.x == beyond ? 1 : 0;
    if (out == 0) {
      each_cell(triangle, [&](std::size_t cell) { visit(cell, id); });
    } else {
      cross(id);
    }
  }
}

void Pixels::sum_counts() {
  std::uint32_t sum = 0;
  for (std::size_t cell = 0; cell + 1 < first_.size(); ++cell) {
    first_[cell] = sum;
    for (auto& count : counts_) {
      const std::uint32_t here = count[cell];
      count[cell] = sum;
      sum += here;
    }
  }
  first_.back() = sum;
}

void Pixels::list(const std::vector<Shown>& shown, const terrain::View& view, int width, int height,
                  ThreadPool& pool, const CancelToken& cancel) {
  shown_ = &shown;
  view_ = view;
  width_ = width;
  height_ = height;
  columns_ = (width + cell_side - 1) / cell_side;
  rows_ = (height + cell_side - 1) / cell_side;
  ranges_.assign(1, {});
  corners_.clear();
  extra_.clear();
  for (const Shown& one : shown) {
    ranges_.push_back({ranges_.back().vertex + one.mesh->places.size(),
                       ranges_.back().triangle + one.mesh->triangles.size()});
  }
  project_all(pool, cancel);
  // Parts of consecutive triangles are counted by cell, then listed, in order.
  const std::size_t cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  const std::size_t parts = std::max<std::size_t>(pool.size(), 1);
  crossing_.resize(parts);
  counts_.resize(parts + 1);
  for (auto& count : counts_) count.assign(cells, 0);
  pool.run(parts, [&](std::size_t part, unsigned) {
    crossing_[part].clear();
    if (cancel.cancelled()) return;
    each_of_part(
        part, [&](std::size_t cell, std::size_t) { ++counts_[part][cell]; },
        [&](std::size_t id) { crossing_[part].push_back(static_cast<std::uint32_t>(id)); });
  });
  first_.assign(cells + 1, 0);
  if (cancel.cancelled()) return;
  for (const auto& ids : crossing_) clip(ids);
  for (const Extra& of : extra_) {
    each_cell(clipped(of), [&](std::size_t cell) { ++counts_[parts][cell]; });
  }
  sum_counts();
  entries_.resize(first_.back());
  pool.run(parts, [&](std::size_t part, unsigned) {
    each_of_part(
        part,
        [&](std::size_t cell, std::size_t id) {
          entries_[counts_[part][cell]++] = static_cast<std::uint32_t>(id);
        },
        [](std::size_t) {});
  });
  for (std::size_t n = 0; n < extra_.size(); ++n) {
    each_cell(clipped(extra_[n]), [&](std::size_t cell) {
      entries_[counts_[parts][cell]++] = static_cast<std::uint32_t>(ranges_.back().triangle + n);
    });
  }
}

void Pixels::release_beyond(std::size_t bytes) {
  std::size_t held = vertices_.capacity() * sizeof(Vertex) + corners_.capacity() * sizeof(Corner) +
                     extra_.capacity() * sizeof(Extra) +
                     (first_.capacity() + entries_.capacity()) * sizeof(std::uint32_t);
  for (const auto& part : counts_) held += part.capacity() * sizeof(std::uint32_t);
  for (const auto& part : crossing_) held += part.capacity() * sizeof(std::uint32_t);
  if (held > bytes) *this = Pixels();
}

void Pixels::look(int column, int row, Cell& to) const {
  const std::size_t cell = cell_at(column, row);
  CellRaster raster(view_, column * cell_side, row * cell_side, 0.5 * width_, 0.5 * height_, to);
  const std::size_t triangles = ranges_.back().triangle;
  for (std::uint32_t n = first_[cell]; n < first_[cell + 1]; ++n) {
    const std::uint32_t id = entries_[n];
    const std::size_t s = id < triangles ? surface_of(id) : extra_[id - triangles].surface;
    const Shown& shown = (*shown_)[s];
    const Mesh& mesh = *shown.mesh;
    std::array<RasterVertex, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
      if (id >= triangles) {
        const Corner& from = corners_[extra_[id - triangles].corners.at(c)];
        corners.at(c) = {from.at.x, from.at.y, from.at.depth, vec(from.normal), from.value};
      } else {
        const std::uint32_t v = mesh.triangles[id - ranges_[s].triangle].at(c);
        const Vertex& at = vertices_[ranges_[s].vertex + v];
        const float value = mesh.values.empty() ? 0.0F : mesh.values[v];
        corners.at(c) = {at.x, at.y, at.depth, vec(mesh.normals[v]), value};
      }
    }
    raster.add(shown, static_cast<std::uint16_t>(s), corners);
  }
  raster.finish();
}

}  // namespace windsplat::surface
