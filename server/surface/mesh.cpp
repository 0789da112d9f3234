// Layers of samples, each with the vertices on its own edges and on those to the next layer.
#include "server/surface/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "server/base/check.hpp"
#include "server/surface/cell_cases.hpp"

namespace windsplat::surface {

namespace {

// Shares of a cell within which a plane, or the number of a layer, is that of a layer of samples:
// places are of single precision.
constexpr double plane_of_layer = 1e-4;
constexpr double whole_layer = 1e-9;

enum State : std::uint8_t { outside = 0, inside = 1, masked = 2 };

double distance(const Samples& samples, const Cut& plane, const std::array<int, 3>& at) {
  return glm::dot(samples.place(at[0], at[1], at[2]) - plane.point, plane.normal);
}

// Calls visit(sample) for those of a layer across an axis until it returns false. Returns whether
// all returned true.
template <class Visit>
bool each_of_layer(const Samples& samples, std::size_t axis, int number, const Visit& visit) {
  const std::size_t u = axis == 0 ? 1 : 0;
  const std::size_t v = axis == 2 ? 1 : 2;
  std::array<int, 3> at{};
  at.at(axis) = number;
  for (int n = 0; n < samples.dims.at(v); ++n) {
    at.at(v) = n;
    for (int m = 0; m < samples.dims.at(u); ++m) {
      at.at(u) = m;
      if (!visit(at)) return false;
    }
  }
  return true;
}

// Whether a plane holds a layer of samples and has those of all other layers on its two sides: a
// plane through a meridian of a globe holds two.
bool parts_at(const Samples& samples, const Cut& plane, std::size_t axis, int number) {
  const int count = samples.dims.at(axis);
  const auto near = [&](std::array<int, 3> at) {
    const double off = std::abs(distance(samples, plane, at));
    at.at(axis) += number + 1 < count ? 1 : -1;
    return off <= plane_of_layer * std::abs(distance(samples, plane, at));
  };
  if (!each_of_layer(samples, axis, number, near)) return false;
  std::array<double, 2> sides{};  // signs of the distances before and after the layer
  for (int n = 0; n < count; ++n) {
    if (n == number) continue;
    double& side = sides.at(n < number ? 0 : 1);
    const bool one_side = each_of_layer(samples, axis, n, [&](const std::array<int, 3>& at) {
      const double off = distance(samples, plane, at);
      if (side == 0) side = off > 0 ? 1 : -1;
      return off * side > 0;
    });
    if (!one_side) return false;
  }
  return sides[0] != sides[1];
}

// A plane that holds a layer of samples is that layer; a layer within rounding of a whole number is
// that of the number. On an axis that closes, numbers are those of the first turn.
Cut resolved(const Samples& samples, Cut cut) {
  if (cut.kind == Cut::Kind::plane) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (int n = 0; n < samples.dims.at(axis); ++n) {
        if (!parts_at(samples, cut, axis, n)) continue;
        cut.kind = Cut::Kind::layer;
        cut.axis = static_cast<int>(axis);
        cut.index = n;
        return cut;
      }
    }
  }
  if (cut.kind != Cut::Kind::layer) return cut;
  const double nearest = std::round(cut.index);
  if (std::abs(cut.index - nearest) <= whole_layer) cut.index = nearest;
  if (cut.axis == 0 && samples.around > 0 && cut.index >= samples.around) {
    cut.index -= samples.around;
  }
  return cut;
}

// The function that is zero on the surface, and its gradient.
class Field {
 public:
  Field(const Samples& samples, const Cut& cut) : samples_(samples), cut_(resolved(samples, cut)) {
    if (cut_.kind != Cut::Kind::layer) return;
    const double below = std::floor(cut_.index);
    if (cut_.index == below) whole_ = static_cast<int>(below);
    low_ = static_cast<int>(whole_ > 0 ? below - 1 : below);
    high_ = closes() ? (low_ + 1) % samples.around : low_ + 1;
  }

  // NaN: masked. On a layer of samples those count, whatever the next layers are.
  [[nodiscard]] double operator()(int i, int j, int k) const {
    if (cut_.kind == Cut::Kind::isosurface) {
      return static_cast<double>(mask({i, j, k})) - cut_.level;
    }
    std::array<int, 3> at{i, j, k};
    if (cut_.kind == Cut::Kind::plane) {
      const float value = mask(at);
      return std::isnan(value) ? static_cast<double>(value) : distance(samples_, cut_, at);
    }
    int& along = at.at(static_cast<std::size_t>(cut_.axis));
    double beyond = along - cut_.index;
    if (closes()) beyond -= samples_.around * std::round(beyond / samples_.around);
    if (whole_ >= 0) along = whole_;
    const float value = mask(at);
    if (std::isnan(value)) return static_cast<double>(value);
    // A sample on the surface is inside, so the first layer needs the others outside.
    return cut_.index > 0 ? beyond : -beyond;
  }

  // Whether cells with this sample as a corner may be cut: those between two layers only.
  [[nodiscard]] bool may_be_cut(int i, int j, int k) const {
    if (cut_.kind != Cut::Kind::layer) return true;
    const std::array<int, 3> at{i, j, k};
    const int along = at.at(static_cast<std::size_t>(cut_.axis));
    return along == low_ || along == high_;
  }

  // In world coordinates: differences along the axes of the lattice, between both neighbours, by
  // the inverse of the matrix of those of the places.
  [[nodiscard]] glm::dvec3 gradient(const std::array<int, 3>& at) const {
    glm::dvec3 change(0);
    std::array<glm::dvec3, 3> along{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto low = neighbour(at, a, -1);
      const auto high = neighbour(at, a, 1);
      along[a] = place(high) - place(low);
      change[static_cast<int>(a)] = value(high) - value(low);
    }
    const double volume = glm::dot(along[0], glm::cross(along[1], along[2]));
    if (volume == 0) return glm::dvec3(0);
    return (change[0] * glm::cross(along[1], along[2]) +
            change[1] * glm::cross(along[2], along[0]) +
            change[2] * glm::cross(along[0], along[1])) /
           volume;
  }

  [[nodiscard]] glm::dvec3 place(const std::array<int, 3>& at) const {
    return samples_.place(at[0], at[1], at[2]);
  }

 private:
  [[nodiscard]] double value(const std::array<int, 3>& at) const {
    return (*this)(at[0], at[1], at[2]);
  }

  // The sample itself at an end of the axis, or where its neighbour is masked.
  [[nodiscard]] std::array<int, 3> neighbour(const std::array<int, 3>& at, std::size_t axis,
                                             int by) const {
    const int last = (axis == 0 ? samples_.width() : samples_.dims.at(axis)) - 1;
    int next = at.at(axis) + by;
    if (axis == 0 && samples_.around > 0) next = (next + samples_.around) % samples_.around;
    auto there = at;
    there.at(axis) = std::clamp(next, 0, last);
    return std::isnan(value(there)) ? at : there;
  }

  [[nodiscard]] bool closes() const { return cut_.axis == 0 && samples_.around > 0; }

  // The value of the field at a sample.
  [[nodiscard]] float mask(const std::array<int, 3>& at) const {
    return cut_.values != nullptr ? cut_.values[samples_.index(at[0], at[1], at[2])] : 0.0F;
  }

  const Samples& samples_;
  const Cut cut_;
  int whole_ = -1;          // number of the layer of samples that is drawn; -1: none
  int low_ = 0, high_ = 0;  // the layers next to a layer
};

glm::dvec3 unit(const glm::dvec3& v) {
  const double length = glm::length(v);
  return length > 0 ? v / length : glm::dvec3(0);
}

Point point_of(const glm::dvec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

struct LayerSize {
  std::size_t within = 0, across = 0;  // vertices on edges in the layer, and to the next
  std::size_t triangles = 0;           // of the cells to the next
};

// Samples of a layer and their neighbours.
class Layers {
 public:
  Layers(const Samples& samples, const Cut& cut)
      : samples_(samples), field_(samples, cut), width_(samples.width()) {
    for (const int count : samples.dims) WINDSPLAT_CHECK(count >= 2);
  }

  [[nodiscard]] int count() const { return samples_.dims[2]; }
  [[nodiscard]] int height() const { return samples_.dims[1]; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] const Field& field() const { return field_; }
  [[nodiscard]] const Samples& samples() const { return samples_; }
  [[nodiscard]] std::size_t area() const {
    return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height());
  }
  [[nodiscard]] std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(i);
  }
  // The neighbour along x; -1: there is none.
  [[nodiscard]] int right_of(int i) const {
    if (i + 1 < width_) return i + 1;
    return samples_.around > 0 ? 0 : -1;
  }

  void states(int k, std::vector<std::uint8_t>& to) const {
    to.resize(area());
    for (int j = 0; j < height(); ++j) {
      for (int i = 0; i < width_; ++i) {
        std::uint8_t& state = to[at(i, j)];
        state = masked;
        if (!field_.may_be_cut(i, j, k)) continue;
        const double f = field_(i, j, k);
        if (!std::isnan(f)) state = f >= 0 ? inside : outside;
      }
    }
  }

  // Calls visit(axis, i, j) for each cut edge within a layer.
  template <class Visit>
  void each_within(const std::vector<std::uint8_t>& states, const Visit& visit) const {
    for (int j = 0; j < height(); ++j) {
      for (int i = 0; i < width_; ++i) {
        const std::uint8_t here = states[at(i, j)];
        const int right = right_of(i);
        if (right >= 0 && is_cut(here, states[at(right, j)])) visit(0, i, j);
        if (j + 1 < height() && is_cut(here, states[at(i, j + 1)])) visit(1, i, j);
      }
    }
  }
  template <class Visit>
  void each_across(const std::vector<std::uint8_t>& low, const std::vector<std::uint8_t>& high,
                   const Visit& visit) const {
    for (int j = 0; j < height(); ++j) {
      for (int i = 0; i < width_; ++i) {
        if (is_cut(low[at(i, j)], high[at(i, j)])) visit(2, i, j);
      }
    }
  }
  // Calls visit(case, i, right, j) for each cell between two layers that the surface cuts.
  template <class Visit>
  void each_cell(const std::vector<std::uint8_t>& low, const std::vector<std::uint8_t>& high,
                 const Visit& visit) const {
    for (int j = 0; j + 1 < height(); ++j) {
      for (int i = 0; i < width_; ++i) {
        const int right = right_of(i);
        if (right < 0) continue;
        const std::array<std::uint8_t, cell_corners> corners{
            low[at(i, j)],  low[at(right, j)],  low[at(i, j + 1)],  low[at(right, j + 1)],
            high[at(i, j)], high[at(right, j)], high[at(i, j + 1)], high[at(right, j + 1)]};
        unsigned bits = 0;
        unsigned any = 0;
        for (unsigned c = 0; c < cell_corners; ++c) {
          bits |= (corners[c] & 1U) << c;
          any |= corners[c];
        }
        if ((any & masked) != 0 || bits == 0 || bits == 255) continue;
        visit(cell_case(bits), i, right, j);
      }
    }
  }

 private:
  static bool is_cut(std::uint8_t p, std::uint8_t q) { return (p ^ q) == 1; }

  const Samples& samples_;
  Field field_;
  int width_;
};

LayerSize measure_layer(const Layers& layers, int k) {
  std::vector<std::uint8_t> low;
  std::vector<std::uint8_t> high;
  layers.states(k, low);
  LayerSize size;
  layers.each_within(low, [&](int, int, int) { ++size.within; });
  if (k + 1 == layers.count()) return size;
  layers.states(k + 1, high);
  layers.each_across(low, high, [&](int, int, int) { ++size.across; });
  layers.each_cell(low, high, [&](const CellCase& found, int, int, int) {
    size.triangles += static_cast<std::size_t>(found.triangles);
  });
  return size;
}

std::vector<LayerSize> measure_layers(const Layers& layers, ThreadPool& pool,
                                      const CancelToken& cancel) {
  std::vector<LayerSize> sizes(static_cast<std::size_t>(layers.count()));
  pool.run(sizes.size(), [&](std::size_t k, unsigned) {
    if (!cancel.cancelled()) sizes[k] = measure_layer(layers, static_cast<int>(k));
  });
  return sizes;
}

// Fills the vertices and triangles of one layer, from the given numbers on.
class Filler {
 public:
  Filler(const Layers& layers, const float* second, Mesh& mesh)
      : layers_(layers), second_(second), mesh_(mesh) {}

  void fill(int k, std::size_t vertex, std::size_t next_vertex, std::size_t triangle) {
    layers_.states(k, low_);
    std::array<std::vector<std::uint32_t>, 3> below;
    std::array<std::vector<std::uint32_t>, 2> above;
    for (auto& indices : below) indices.resize(layers_.area());
    auto next = static_cast<std::uint32_t>(vertex);
    const auto add = [&](int axis, int i, int j) {
      below.at(static_cast<std::size_t>(axis))[layers_.at(i, j)] = next;
      set_vertex(axis, {i, j, k}, next++);
    };
    layers_.each_within(low_, add);
    if (k + 1 == layers_.count()) return;
    layers_.states(k + 1, high_);
    layers_.each_across(low_, high_, add);
    for (auto& indices : above) indices.resize(layers_.area());
    next = static_cast<std::uint32_t>(next_vertex);
    layers_.each_within(high_, [&](int axis, int i, int j) {
      above.at(static_cast<std::size_t>(axis))[layers_.at(i, j)] = next++;
    });
    layers_.each_cell(low_, high_, [&](const CellCase& found, int i, int right, int j) {
      for (int t = 0; t < found.triangles; ++t) {
        auto& to = mesh_.triangles[triangle++];
        for (std::size_t n = 0; n < 3; ++n) {
          const int edge =
              static_cast<unsigned char>(found.edges.at(static_cast<std::size_t>(t)).at(n));
          const int corner = cell_edge(edge)[0];
          const std::size_t at = layers_.at((corner & 1) != 0 ? right : i, j + (corner >> 1 & 1));
          const auto axis = static_cast<std::size_t>(edge / 4);
          to.at(n) = corner >= 4 ? above.at(axis)[at] : below.at(axis)[at];
        }
      }
    });
  }

 private:
  void set_vertex(int axis, const std::array<int, 3>& from, std::uint32_t at) {
    auto to = from;
    if (axis == 0) {
      to[0] = layers_.right_of(from[0]);
    } else {
      ++to.at(static_cast<std::size_t>(axis));
    }
    const Field& field = layers_.field();
    const double f = field(from[0], from[1], from[2]);
    const double g = field(to[0], to[1], to[2]);
    const double part = std::clamp(f / (f - g), 0.0, 1.0);
    // On a sample the other one, which may be masked, has no share.
    const auto between = [&](const auto& of) {
      if (!(part > 0)) return of(from);
      if (!(part < 1)) return of(to);
      const auto p = of(from);
      return p + part * (of(to) - p);
    };
    using Sample = std::array<int, 3>;
    const auto place = [&](const Sample& of) { return field.place(of); };
    const auto gradient = [&](const Sample& of) { return field.gradient(of); };
    mesh_.places[at] = point_of(between(place));
    mesh_.normals[at] = point_of(unit(between(gradient)));
    if (second_ == nullptr) return;
    const auto value = [&](const std::array<int, 3>& of) {
      return static_cast<double>(second_[layers_.samples().index(of[0], of[1], of[2])]);
    };
    mesh_.values[at] = static_cast<float>(between(value));
  }

  const Layers& layers_;
  const float* second_;
  Mesh& mesh_;
  std::vector<std::uint8_t> low_, high_;
};

}  // namespace

std::size_t MeshSize::bytes(bool valued) const {
  return vertices * (2 * sizeof(Point) + (valued ? sizeof(float) : 0)) +
         triangles * sizeof(std::array<std::uint32_t, 3>);
}

std::size_t Mesh::bytes() const {
  return MeshSize{places.size(), triangles.size()}.bytes(!values.empty());
}

glm::dvec3 Samples::place(int i, int j, int k) const {
  if (places != nullptr) {
    const Point& at = places[index(i, j, k)];
    return {at[0], at[1], at[2]};
  }
  return {positions[0][i], positions[1][j], positions[2][k]};
}

MeshSize measure(const Samples& samples, const Cut& cut, ThreadPool& pool,
                 const CancelToken& cancel) {
  MeshSize sum;
  for (const LayerSize& size : measure_layers(Layers(samples, cut), pool, cancel)) {
    sum.vertices += size.within + size.across;
    sum.triangles += size.triangles;
  }
  return sum;
}

Mesh extract(const Samples& samples, const Cut& cut, const float* second, ThreadPool& pool,
             const CancelToken& cancel) {
  const Layers layers(samples, cut);
  const std::vector<LayerSize> sizes = measure_layers(layers, pool, cancel);
  std::vector<MeshSize> first(sizes.size() + 1);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    first[k + 1].vertices = first[k].vertices + sizes[k].within + sizes[k].across;
    first[k + 1].triangles = first[k].triangles + sizes[k].triangles;
  }
  Mesh mesh;
  mesh.places.resize(first.back().vertices);
  mesh.normals.resize(first.back().vertices);
  if (second != nullptr) mesh.values.resize(first.back().vertices);
  mesh.triangles.resize(first.back().triangles);
  pool.run(sizes.size(), [&](std::size_t k, unsigned) {
    // A layer that was not measured has no room.
    if (cancel.cancelled()) return;
    Filler(layers, second, mesh)
        .fill(static_cast<int>(k), first[k].vertices, first[k + 1].vertices, first[k].triangles);
  });
  return mesh;
}

}  // namespace windsplat::surface
