// Vertices -> normals and the pyramid of boxes; rays through the pyramid.
#include "server/terrain/terrain.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::terrain {

namespace {

std::size_t index_of(int width, int x, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

constexpr int block = 2;  // cells or blocks along a side

int blocks_of(int count) { return (count + block - 1) / block; }

constexpr double rounding = 1e-12;  // relative, of the distances at which a ray meets a box

bool is_missing(const glm::dvec3& place) {
  return std::isnan(place.x) || std::isnan(place.y) || std::isnan(place.z);
}

// A direction without zeros, so that its inverse is finite.
double inverse_of(double direction) {
  constexpr double least = 1e-300;
  return 1 / (std::abs(direction) < least ? std::copysign(least, direction) : direction);
}

}  // namespace

Terrain::Terrain(std::vector<Vertex> vertices, int width, Base base)
    : vertices_(std::move(vertices)),
      width_(width),
      height_(static_cast<int>(vertices_.size() / static_cast<std::size_t>(width))),
      base_(base) {
  WINDSPLAT_CHECK(width_ >= 2 && height_ >= 2);
  WINDSPLAT_CHECK(vertices_.size() ==
                  static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  set_normals();
  set_levels();
}

std::size_t Terrain::bytes() const {
  std::size_t bytes = (vertices_.size() + normals_.size()) * sizeof(Vertex);
  for (const Level& level : levels_) bytes += level.boxes.size() * sizeof(Box);
  return bytes;
}

std::size_t bytes_of(int width, int height) {
  const auto product = [](int x, int y) {
    return static_cast<std::size_t>(x) * static_cast<std::size_t>(y);
  };
  constexpr std::size_t box_bytes = 6 * sizeof(float);
  std::size_t bytes = sizeof(Terrain) + 2 * product(width, height) * sizeof(Terrain::Vertex);
  int x = width - 1;
  int y = height - 1;
  do {
    x = blocks_of(x);
    y = blocks_of(y);
    bytes += product(x, y) * box_bytes;
  } while (x > 1 || y > 1);
  return bytes;
}

glm::dvec3 Terrain::up(const glm::dvec3& place) const {
  const double length = glm::length(place);
  return base_ == Base::map || !(length > 0) ? glm::dvec3(0, 0, 1) : place / length;
}

void Terrain::set_normals() {
  normals_.resize(vertices_.size());
  // The way between the neighbours along an axis, or to the one that is not missing.
  const auto way = [this](int x, int y, int dx, int dy) {
    const auto present = [this](int i, int j) {
      return i >= 0 && j >= 0 && i < width_ && j < height_ && !is_missing(vertex(i, j));
    };
    const int after = present(x + dx, y + dy) ? 1 : 0;
    const int before = present(x - dx, y - dy) ? 1 : 0;
    return vertex(x + after * dx, y + after * dy) - vertex(x - before * dx, y - before * dy);
  };
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const glm::dvec3 place = vertex(x, y);
      glm::dvec3 normal = up(place);
      const glm::dvec3 across = glm::cross(way(x, y, 1, 0), way(x, y, 0, 1));
      const double length = glm::length(across);
      if (length > 0) normal = across * ((glm::dot(across, normal) < 0 ? -1 : 1) / length);
      normals_[index_of(width_, x, y)] = {
          static_cast<float>(normal.x), static_cast<float>(normal.y), static_cast<float>(normal.z)};
    }
  }
}

// Without the cells that lack a vertex. low > high: there are no others.
Terrain::Box Terrain::box_of_cells(int x, int y) const {
  constexpr float most = std::numeric_limits<float>::infinity();
  Box box{{most, most, most}, {-most, -most, -most}};
  for (int j = y; j < std::min(y + block, height_ - 1); ++j) {
    for (int i = x; i < std::min(x + block, width_ - 1); ++i) {
      const std::size_t first = index_of(width_, i, j);
      const std::array<std::size_t, 4> corners{first, first + 1,
                                               first + static_cast<std::size_t>(width_),
                                               first + static_cast<std::size_t>(width_) + 1};
      const bool missing = std::any_of(corners.begin(), corners.end(), [this](std::size_t n) {
        const Vertex& v = vertices_[n];
        return is_missing({v[0], v[1], v[2]});
      });
      if (missing) continue;
      for (const std::size_t n : corners) {
        for (std::size_t a = 0; a < 3; ++a) {
          box.low[a] = std::min(box.low[a], vertices_[n][a]);
          box.high[a] = std::max(box.high[a], vertices_[n][a]);
        }
      }
    }
  }
  return box;
}

void Terrain::set_levels() {
  const auto count_of = [](const Level& level) {
    return static_cast<std::size_t>(level.width) * static_cast<std::size_t>(level.height);
  };
  Level cells{blocks_of(width_ - 1), blocks_of(height_ - 1), {}};
  cells.boxes.reserve(count_of(cells));
  for (int y = 0; y < cells.height; ++y) {
    for (int x = 0; x < cells.width; ++x) cells.boxes.push_back(box_of_cells(block * x, block * y));
  }
  levels_.push_back(std::move(cells));
  while (levels_.back().boxes.size() > 1) {
    const Level& finer = levels_.back();
    Level level{blocks_of(finer.width), blocks_of(finer.height), {}};
    level.boxes.reserve(count_of(level));
    for (int y = 0; y < level.height; ++y) {
      for (int x = 0; x < level.width; ++x) {
        Box box = finer.boxes[index_of(finer.width, block * x, block * y)];
        for (int j = block * y; j < std::min(block * (y + 1), finer.height); ++j) {
          for (int i = block * x; i < std::min(block * (x + 1), finer.width); ++i) {
            const Box& part = finer.boxes[index_of(finer.width, i, j)];
            for (std::size_t a = 0; a < 3; ++a) {
              box.low[a] = std::min(box.low[a], part.low[a]);
              box.high[a] = std::max(box.high[a], part.high[a]);
            }
          }
        }
        level.boxes.push_back(box);
      }
    }
    levels_.push_back(std::move(level));
  }
}

// The search of some rays: descends into the boxes that any of them meets before what it has met.
// The bundle of all rays, as intervals of origins and directions, excludes most boxes at once.
class Terrain::Search {
 public:
  Search(const Terrain& terrain, const Ray* rays, int count, Hit* hits)
      : terrain_(terrain), rays_(rays), hits_(hits) {
    Ids all;
    for (int r = 0; r < count; ++r) {
      hits[r] = {};
      for (int a = 0; a < 3; ++a) {
        inverse_[static_cast<std::size_t>(r)][static_cast<std::size_t>(a)] =
            inverse_of(rays[r].along[a]);
      }
      all.ray[static_cast<std::size_t>(r)] = static_cast<std::uint8_t>(r);
      middle_ += rays[r].along;
    }
    all.count = count;
    set_bundle(count);
    visit(terrain.levels_.size() - 1, 0, 0, all);
  }

 private:
  struct Ids {
    std::array<std::uint8_t, rays_max> ray;
    int count = 0;
  };

  // The origins and inverse directions of all rays along an axis. Without bounds if directions
  // of both signs occur.
  struct Range {
    double from_low = 0, from_high = 0, inverse_low = 0, inverse_high = 0;
    bool bounded = false;
  };

  void set_bundle(int count) {
    if (count == 0) return;
    first_ = rays_[0].first;
    for (std::size_t a = 0; a < 3; ++a) {
      Range& range = bundle_[a];
      for (int n = 0; n < count; ++n) {
        const auto r = static_cast<std::size_t>(n);
        const double from = rays_[r].from[static_cast<glm::length_t>(a)];
        const double inverse = inverse_[r][a];
        range.from_low = n == 0 ? from : std::min(range.from_low, from);
        range.from_high = n == 0 ? from : std::max(range.from_high, from);
        range.inverse_low = n == 0 ? inverse : std::min(range.inverse_low, inverse);
        range.inverse_high = n == 0 ? inverse : std::max(range.inverse_high, inverse);
        first_ = std::min(first_, rays_[r].first);
      }
      range.bounded = range.inverse_low > 0 || range.inverse_high < 0;
    }
  }

  // False only if no ray enters the box: bounds of enters() over all rays.
  [[nodiscard]] bool may_enter(const Box& box) const {
    double from = first_;
    double to = std::numeric_limits<double>::infinity();
    for (std::size_t a = 0; a < 3; ++a) {
      const Range& range = bundle_[a];
      if (!range.bounded) continue;
      const bool upward = range.inverse_low > 0;
      // Ways to the plane that the rays meet first and to the other, signed along the axis.
      const double entry = upward ? static_cast<double>(box.low[a]) - range.from_high
                                  : static_cast<double>(box.high[a]) - range.from_low;
      const double exit = upward ? static_cast<double>(box.high[a]) - range.from_low
                                 : static_cast<double>(box.low[a]) - range.from_high;
      from = std::max(from, std::min(entry * range.inverse_low, entry * range.inverse_high));
      to = std::min(to, std::max(exit * range.inverse_low, exit * range.inverse_high));
    }
    return from <= to + rounding * (std::abs(from) + std::abs(to));
  }

  [[nodiscard]] bool enters(std::size_t r, const Box& box) const {
    const Ray& ray = rays_[r];
    double from = ray.first;
    double to = hits_[r].along;
    for (std::size_t a = 0; a < 3; ++a) {
      const double origin = ray.from[static_cast<glm::length_t>(a)];
      const double low = (static_cast<double>(box.low[a]) - origin) * inverse_[r][a];
      const double high = (static_cast<double>(box.high[a]) - origin) * inverse_[r][a];
      from = std::max(from, std::min(low, high));
      to = std::min(to, std::max(low, high));
    }
    return from <= to + rounding * (std::abs(from) + std::abs(to));
  }

  void visit(std::size_t level, int x, int y, const Ids& above) {
    const Level& here = terrain_.levels_[level];
    const Box& box = here.boxes[index_of(here.width, x, y)];
    if (box.low[0] > box.high[0] || !may_enter(box)) return;
    const auto meets = [&](std::uint8_t r) { return enters(r, box); };
    const auto* const first = above.ray.begin();
    if (level > 0) {
      // One ray is enough to descend; which others do is decided by the finest boxes.
      if (std::none_of(first, first + above.count, meets)) return;
      return visit_parts(level, x, y, above);
    }
    Ids ids;
    for (const auto* r = first; r != first + above.count; ++r) {
      if (meets(*r)) ids.ray[static_cast<std::size_t>(ids.count++)] = *r;
    }
    if (ids.count > 0) meet_cells(block * x, block * y, ids);
  }

  // The parts of a box, the nearest first.
  void visit_parts(std::size_t level, int x, int y, const Ids& ids) {
    struct Child {
      int x, y;
      double depth;
    };
    const Level& finer = terrain_.levels_[level - 1];
    std::array<Child, static_cast<std::size_t>(block) * block> children{};
    std::size_t count = 0;
    for (int j = block * y; j < std::min(block * (y + 1), finer.height); ++j) {
      for (int i = block * x; i < std::min(block * (x + 1), finer.width); ++i) {
        const Box& part = finer.boxes[index_of(finer.width, i, j)];
        double depth = 0;
        for (std::size_t a = 0; a < 3; ++a) {
          depth += static_cast<double>(part.low[a] + part.high[a]) *
                   middle_[static_cast<glm::length_t>(a)];
        }
        std::size_t place = count++;
        for (; place > 0 && children[place - 1].depth > depth; --place) {
          children[place] = children[place - 1];
        }
        children[place] = {i, j, depth};
      }
    }
    for (std::size_t c = 0; c < count; ++c) visit(level - 1, children[c].x, children[c].y, ids);
  }

  void meet_cells(int x, int y, const Ids& ids) {
    for (int j = y; j < std::min(y + block, terrain_.height_ - 1); ++j) {
      for (int i = x; i < std::min(x + block, terrain_.width_ - 1); ++i) meet_cell(i, j, ids);
    }
  }

  void meet_cell(int x, int y, const Ids& ids) {
    const std::array<std::array<int, 2>, 4> corner{
        {{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}}};
    std::array<glm::dvec3, 4> place;
    for (std::size_t c = 0; c < 4; ++c) {
      place[c] = terrain_.vertex(corner[c][0], corner[c][1]);
      if (is_missing(place[c])) return;
    }
    // Rays of a perspective view share their origin, and with it the triangles as seen from there.
    std::array<Seen, 2> seen{};
    const glm::dvec3* origin = nullptr;
    for (int n = 0; n < ids.count; ++n) {
      const auto r = static_cast<std::size_t>(ids.ray[static_cast<std::size_t>(n)]);
      const glm::dvec3& from = rays_[r].from;
      if (origin == nullptr || from != *origin) {
        for (std::size_t t = 0; t < 2; ++t) {
          seen[t] = seen_from(from, place[0], place[t + 1], place[t + 2]);
        }
        origin = &from;
      }
      for (std::size_t t = 0; t < 2; ++t) {
        meet_triangle(r, seen[t], {corner[0], corner[t + 1], corner[t + 2]});
      }
    }
  }

  // A triangle relative to the origin of a ray, and the products of its edges' ends.
  struct Seen {
    glm::dvec3 a, b, c;
    glm::dvec3 cb, ac, ba;
  };

  static Seen seen_from(const glm::dvec3& from, const glm::dvec3& p, const glm::dvec3& q,
                        const glm::dvec3& r) {
    const glm::dvec3 a = p - from;
    const glm::dvec3 b = q - from;
    const glm::dvec3 c = r - from;
    return {a, b, c, glm::cross(c, b), glm::cross(a, c), glm::cross(b, a)};
  }

  // With u, v and w the volumes spanned by the ray and each edge, as seen along the ray: it passes
  // within where they have one sign. They differ in nothing but the sign on both sides of a shared
  // edge, so that no ray passes between triangles.
  void meet_triangle(std::size_t r, const Seen& seen,
                     const std::array<std::array<int, 2>, 3>& corner) {
    const Ray& ray = rays_[r];
    const glm::dvec3& a = seen.a;
    const glm::dvec3& b = seen.b;
    const glm::dvec3& c = seen.c;
    const double u = glm::dot(ray.along, seen.cb);
    const double v = glm::dot(ray.along, seen.ac);
    if (u * v < 0) return;
    const double w = glm::dot(ray.along, seen.ba);
    if (u * w < 0 || v * w < 0) return;
    const double whole = u + v + w;
    if (whole == 0) return;
    const glm::dvec3 at = (u * a + v * b + w * c) / whole;
    const double along = glm::dot(at, ray.along) / glm::dot(ray.along, ray.along);
    Hit& hit = hits_[r];
    if (!(along >= ray.first && along < hit.along)) return;
    if (terrain_.base_ == Base::globe) {
      const glm::dvec3 across = glm::cross(b - a, c - a);
      const double upward = glm::dot(across, at + ray.from);
      if (glm::dot(across, ray.along) * upward >= 0) return;
    }
    const auto normal_at = [&](std::size_t n) {
      return terrain_.normal(corner[n][0], corner[n][1]);
    };
    const glm::dvec3 normal = (u * normal_at(0) + v * normal_at(1) + w * normal_at(2)) / whole;
    hit.along = along;
    hit.normal = normal / std::max(glm::length(normal), 1e-300);
  }

  const Terrain& terrain_;
  const Ray* rays_;
  Hit* hits_;
  std::array<std::array<double, 3>, rays_max> inverse_;
  std::array<Range, 3> bundle_{};
  double first_ = 0;  // the least of all rays
  glm::dvec3 middle_{0};
};

void Terrain::meet(const Ray* rays, int count, Hit* hits) const {
  WINDSPLAT_CHECK(count <= rays_max);
  const Search search(*this, rays, count, hits);
}

}  // namespace windsplat::terrain
