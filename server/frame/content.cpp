// Samples -> projected optical depths and line areas -> means over the visible ones.
#include "server/frame/content.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "server/base/pcg3d.hpp"
#include "server/data/model/volume.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/frame/medium_sample.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

constexpr std::int64_t samples_max = 4096;
constexpr int columns = 10;
constexpr int rows = 8;

using Index = std::array<int, 3>;

struct Line {
  bool drawn = false;
  glm::dvec3 color{0, 0, 0};
  double magnitude = 0;  // relative to the full one, at most 1
};

// What a sample adds to the picture.
struct Projected {
  Index index{};
  int bin = 0;
  double depth = 0;
  double tau = 0;    // optical depth, mean over its bin
  double cover = 0;  // area of lines times their opacity, per area of the bin
  double cell_depth = 0;
  double length = 0;
  double cell = 0;
  double finest = 0;
  double tint = 0;
  double shade = 0;
  double gaps = 0;
};

struct Mean {
  double sum = 0, weight = 0;
  void add(double value, double its_weight) {
    sum += its_weight * value;
    weight += its_weight;
  }
  [[nodiscard]] double value() const { return weight > 0 ? sum / weight : 0; }
};

class Sampling {
 public:
  explicit Sampling(const scene::Scene& scene)
      : scene_(scene), view_(reference::make_view(scene.camera)), high_(scene.lattice.dims) {
    if (scene.slice) {
      const auto axis = static_cast<std::size_t>(scene.slice->axis);
      low_[axis] = scene.slice->sample;
      high_[axis] = scene.slice->sample + 1;
    }
    for (std::size_t a = 0; a < 3; ++a) {
      count_ *= high_[a] - low_[a];
      merged_ *= std::exp2(scene.level[a]);
      finer_[a] = std::exp2(-scene.level[a]);
    }
  }

  [[nodiscard]] std::vector<Projected> project() const {
    std::vector<Projected> out;
    const std::int64_t taken = std::min(count_, samples_max);
    const double each = static_cast<double>(count_) / static_cast<double>(taken);
    out.reserve(static_cast<std::size_t>(taken));
    for (std::int64_t n = 0; n < taken; ++n) {
      std::int64_t at = n;
      if (taken < count_) {
        const double within = pcg3d({static_cast<std::uint32_t>(n), 17, 29})[0] / 4294967296.0;
        at = std::min(count_ - 1, static_cast<std::int64_t>((n + within) * each));
      }
      Index i{};
      for (std::size_t a = 0; a < 3; ++a) {
        const std::int64_t wide = high_[a] - low_[a];
        i[a] = low_[a] + static_cast<int>(at % wide);
        at /= wide;
      }
      if (auto seen = project(i, each)) out.push_back(*seen);
    }
    return out;
  }

 private:
  [[nodiscard]] std::size_t number(const Index& i) const {
    const Index& dims = scene_.lattice.dims;
    return static_cast<std::size_t>(i[0]) +
           static_cast<std::size_t>(dims[0]) *
               (static_cast<std::size_t>(i[1]) +
                static_cast<std::size_t>(dims[1]) * static_cast<std::size_t>(i[2]));
  }

  [[nodiscard]] glm::dvec3 place(const Index& i) const {
    const scene::Lattice& lattice = scene_.lattice;
    if (lattice.places) {
      const auto& p = (*lattice.places)[number(i)];
      return {p[0], p[1], p[2]};
    }
    return {lattice.positions[0][static_cast<std::size_t>(i[0])],
            lattice.positions[1][static_cast<std::size_t>(i[1])],
            lattice.positions[2][static_cast<std::size_t>(i[2])]};
  }

  [[nodiscard]] std::optional<Index> neighbour(const Index& i, std::size_t a, int step) const {
    Index next = i;
    next[a] += step;
    if (next[a] < low_[a] || next[a] >= high_[a]) return std::nullopt;
    return next;
  }

  [[nodiscard]] double edge(const Index& i, std::size_t a) const {
    auto next = neighbour(i, a, 1);
    if (!next) next = neighbour(i, a, -1);
    if (!scene_.lattice.places || !next) {
      return scene_.lattice.spacing[a][static_cast<std::size_t>(i[a])];
    }
    return glm::length(place(*next) - place(i));
  }

  [[nodiscard]] Medium medium(const Index& i) const {
    using Two = data::TwoValues;
    Medium out;
    const std::size_t n = number(i);
    for (const scene::ScalarLayer& layer : scene_.scalars) {
      const data::Volume& field = *layer.field;
      if (field.components == 1) {
        out.add(layer, field.values[n], 1);
        continue;
      }
      const double low = field.component(Two::low_share)[n];
      const double high = field.component(Two::high_share)[n];
      if (low > 0) out.add(layer, field.component(Two::low)[n], low);
      if (high > 0) out.add(layer, field.component(Two::high)[n], high);
    }
    return out;
  }

  [[nodiscard]] Line line(const Index& i) const {
    Line out;
    if (!scene_.vector) return out;
    const scene::VectorLayer& layer = *scene_.vector;
    std::array<double, 3> v{};
    for (int c = 0; c < layer.field->components; ++c) {
      v[static_cast<std::size_t>(c)] = layer.field->component(c)[number(i)];
    }
    const double magnitude = std::hypot(v[0], v[1], v[2]);
    out.drawn = magnitude > 0 && magnitude >= layer.min_magnitude;
    if (!out.drawn) return out;
    out.magnitude = std::min(1.0, magnitude / layer.magnitude_range[1]);
    using scene::LineColor;
    double value = place(i).z;
    if (layer.color_by == LineColor::magnitude) value = magnitude;
    if (layer.color_by == LineColor::direction) {
      value = std::atan2(v[0], v[1]) / 0.017453292519943295;
      if (value < 0) value += 360;
    }
    if (layer.color_by == LineColor::scalar) value = layer.color_field->values[number(i)];
    const double k = layer.magnitude_intensity;
    out.color = (1 - k + k * out.magnitude) * color_at(layer.color, value);
    return out;
  }

  [[nodiscard]] std::optional<Projected> project(const Index& i, double each) const {
    const scene::Camera& camera = scene_.camera;
    const glm::dvec3 way = place(i) - camera.eye;
    Projected out;
    out.index = i;
    out.depth = glm::dot(way, camera.forward);
    if (camera.perspective && !(out.depth > camera.near)) return std::nullopt;
    const double scale =  // heights of the picture per world unit
        0.5 / (camera.half_height * (camera.perspective ? out.depth : 1));
    const double aspect = static_cast<double>(camera.width) / camera.height;
    const double x = glm::dot(way, camera.right) * scale / aspect + 0.5;
    const double y = 0.5 - glm::dot(way, camera.up) * scale;
    if (!(x >= 0 && x < 1 && y >= 0 && y < 1)) return std::nullopt;
    out.bin = static_cast<int>(y * rows) * columns + static_cast<int>(x * columns);
    const double bin_area = aspect / (columns * rows);

    double volume = 1;
    out.finest = 1e30;
    std::array<double, 3> edges{};
    for (std::size_t a = 0; a < 3; ++a) {
      edges[a] = edge(i, a);
      volume *= edges[a];
      out.finest = std::min(out.finest, edges[a] * finer_[a] * scale);
    }
    const double fine_edge = std::cbrt(volume / merged_);
    out.cell = fine_edge * scale;
    const Medium here = medium(i);
    const double rho = here.extinction;
    out.tau = each * rho * volume * scale * scale / bin_area;
    out.cell_depth = rho * fine_edge;
    const Line own = line(i);
    add_line(i, own, each, scale, bin_area, *std::max_element(edges.begin(), edges.end()), out);
    compare(i, here, own, out);
    return out;
  }

  // The line of a sample from tail to head as it is drawn, world units. At a coarser level, rates
  // are those of the first sample of the group.
  [[nodiscard]] std::optional<reference::DrawnVector> drawn_vector(const Index& i) const {
    const scene::VectorLayer& layer = *scene_.vector;
    std::array<reference::AxisPosition, 3> at;
    for (std::size_t a = 0; a < 3; ++a) {
      at[a] = {i[a], 1, scene_.lattice.spacing[a][static_cast<std::size_t>(i[a])]};
    }
    reference::KernelPosition position = reference::make_kernel_position(scene_, view_, at);
    if (!position.has_cell) return std::nullopt;
    for (std::size_t a = 0; a < 3; ++a) position.sample[a] <<= layer.halvings[a];
    return reference::read_vector(scene_, layer, position);
  }

  void add_line(const Index& i, const Line& own, double each, double scale, double bin_area,
                double widest, Projected& out) const {
    if (!own.drawn) return;
    const auto drawn = drawn_vector(i);
    if (!drawn) return;
    const scene::VectorLayer& layer = *scene_.vector;
    const double whole = reference::length(drawn->extent);
    const double across = std::hypot(reference::dot(drawn->extent, view_.right),
                                     reference::dot(drawn->extent, view_.down));
    const double most = layer.span * layer.stride * widest;
    out.length = scale * across * (whole > most ? most / whole : 1);
    const double wide = width();
    const double lines = each * merged_ / std::pow(layer.stride, 3);
    out.cover = lines * layer_opacity() * wide * (out.length + wide) / bin_area;
  }

  // Differences from the next sample along each axis, of media along the view.
  void compare(const Index& i, const Medium& here, const Line& own, Projected& out) const {
    double tint = 0;
    int count = 0;
    int beside = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      auto next = neighbour(i, a, 1);
      if (!next) next = neighbour(i, a, -1);
      if (!next) continue;
      ++count;
      const Medium other = medium(*next);
      const glm::dvec3 step = place(*next) - place(i);
      const double length2 = glm::dot(step, step);  // 0 where layers of terrain coincide
      if (here.extinction > 0 && other.extinction > 0 && length2 > 0) {
        const double along = std::pow(glm::dot(step, scene_.camera.forward), 2) / length2;
        const glm::dvec3 change = here.color() - other.color();
        tint += along * glm::dot(change, change);
      }
      const Line line_beside = line(*next);
      if (!own.drawn || !line_beside.drawn) continue;
      ++beside;
      out.shade += glm::length(own.color - line_beside.color);
    }
    out.tint = std::sqrt(tint);
    if (beside > 0) out.shade /= beside;
    if (own.drawn && count > 0) out.gaps = static_cast<double>(count - beside) / count;
  }

 public:
  // The light of the medium along rays through some of the samples, and its change from one cell to
  // the next across them. A ray follows the axis along which it passes most cells.
  struct Texture {
    Mean step, bend, wide_bend, order;  // squares
    Mean cell;                          // its width
  };
  [[nodiscard]] Texture texture(const std::vector<Projected>& seen) const {
    constexpr std::size_t rays = 128;
    const std::size_t taken = std::min(rays, seen.size());
    const double each =
        static_cast<double>(count_) / static_cast<double>(std::min(count_, samples_max)) *
        static_cast<double>(seen.size()) / static_cast<double>(std::max<std::size_t>(taken, 1));
    Texture out;
    if (scene_.scalars.empty()) return out;
    for (std::size_t n = 0; n < taken; ++n) {
      add_ray(seen[n * seen.size() / taken].index, each, out);
    }
    return out;
  }

 private:
  // A ray through a sample, followed in steps of `stride` cells of `axis`.
  struct Ray {
    Index through{};
    std::array<double, 3> rate{};  // cells passed along each axis for each unit of length
    std::size_t axis = 0;
    int stride = 1;
    double length = 0;  // of a step
    double depth = 0;   // of the sample
    double pace = 1;    // depth for each unit of length
  };
  [[nodiscard]] std::optional<Ray> ray_through(const Index& through) const {
    const scene::Camera& camera = scene_.camera;
    const glm::dvec3 at = place(through);
    const glm::dvec3 way =
        camera.perspective ? glm::normalize(at - camera.eye) : glm::dvec3(camera.forward);
    Ray out;
    out.through = through;
    out.depth = glm::dot(at - camera.eye, camera.forward);
    out.pace = glm::dot(way, camera.forward);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto next = neighbour(through, a, 1);
      const auto last = neighbour(through, a, -1);
      if (!next && !last) continue;
      const glm::dvec3 edge = next ? place(*next) - at : at - place(*last);
      const double length2 = glm::dot(edge, edge);
      if (length2 == 0) continue;
      out.rate[a] = glm::dot(way, edge) / length2;
      if (std::abs(out.rate[a]) > std::abs(out.rate[out.axis])) out.axis = a;
    }
    if (out.rate[out.axis] == 0) return std::nullopt;
    constexpr int steps_most = 64;
    const int cells = high_[out.axis] - low_[out.axis];
    out.stride = (cells + steps_most - 1) / steps_most;
    out.length = out.stride / std::abs(out.rate[out.axis]);
    return out;
  }

  // The light of a ray, then of those one cell and those two cells beside it, on both sides along
  // the two other axes.
  struct Lights {
    std::array<glm::dvec4, 9> light{};
    std::array<double, 9> transmitted{1, 1, 1, 1, 1, 1, 1, 1, 1};
    glm::dvec3 order{0, 0, 0};
    int inside = 0;  // steps of the ray within the lattice, each of `stride` cells
    glm::dvec3 last_color{0, 0, 0};
    double last_absorbed = 0;

    void pass(std::size_t ray, const Medium& here, double length, int stride) {
      const double own = -std::expm1(-here.extinction * length / stride);
      if (ray == 0) {
        if (last_absorbed > 0) {
          const glm::dvec3 change =
              transmitted[0] * own * last_absorbed * (here.color() - last_color);
          order += static_cast<double>(stride) * change;
        }
        last_color = here.color();
        last_absorbed = own;
      }
      const double absorbed = -transmitted[ray] * std::expm1(-here.extinction * length);
      light[ray] += absorbed * glm::dvec4(here.color(), 1);
      transmitted[ray] -= absorbed;
    }
  };
  [[nodiscard]] Lights lights_of(const Ray& ray) const {
    const scene::Camera& camera = scene_.camera;
    const std::size_t first = (ray.axis + 1) % 3;
    const std::size_t second = (ray.axis + 2) % 3;
    const int cells = high_[ray.axis] - low_[ray.axis];
    const bool ascends = ray.rate[ray.axis] > 0;
    Lights out;
    for (int n = 0; n < cells; n += ray.stride) {
      Index i = ray.through;
      i[ray.axis] = ascends ? low_[ray.axis] + n : high_[ray.axis] - 1 - n;
      const double gone = (i[ray.axis] - ray.through[ray.axis]) / ray.rate[ray.axis];
      if (camera.perspective && ray.depth + gone * ray.pace < camera.near) continue;
      i[first] += static_cast<int>(std::lround(gone * ray.rate[first]));
      i[second] += static_cast<int>(std::lround(gone * ray.rate[second]));
      for (std::size_t beside = 0; beside < out.light.size(); ++beside) {
        Index shifted = i;
        if (beside > 0) {
          const int far = beside < 5 ? 1 : 2;
          shifted[(beside - 1) % 4 < 2 ? first : second] += beside % 2 == 0 ? far : -far;
        }
        if (!contains(shifted)) continue;
        out.inside += beside == 0 ? 1 : 0;
        const Medium here = medium(shifted);
        if (here.extinction > 0) out.pass(beside, here, ray.length, ray.stride);
      }
    }
    return out;
  }

  void add_ray(const Index& through, double each, Texture& out) const {
    const auto ray = ray_through(through);
    if (!ray) return;
    const Lights lights = lights_of(*ray);
    if (lights.inside == 0) return;
    const auto& light = lights.light;
    const scene::Camera& camera = scene_.camera;
    const double scale = 0.5 / (camera.half_height * (camera.perspective ? ray->depth : 1));
    const double face = edge(through, 0) * edge(through, 1) * edge(through, 2) / ray->length *
                        ray->stride;  // area of a cell across the ray
    const double cells = static_cast<double>(lights.inside) * ray->stride;
    const double area = each * face * scale * scale / cells;
    const auto square = [](const glm::dvec4& v) { return glm::dot(v, v) / 4; };
    double step = 0;
    double bend = 0;
    double wide_bend = 0;
    for (const std::size_t side : {std::size_t{1}, std::size_t{3}}) {
      step += 0.25 * (square(light[side] - light[0]) + square(light[side + 1] - light[0]));
      bend += 0.5 * square(light[side] + light[side + 1] - 2.0 * light[0]);
      wide_bend += 0.5 * square(light[side + 4] + light[side + 5] - 2.0 * light[0]);
    }
    out.step.add(step, area);
    out.bend.add(bend, area);
    out.wide_bend.add(wide_bend, area);
    out.order.add(glm::dot(lights.order, lights.order), area);
    out.cell.add(std::sqrt(face) * scale, area * step);
  }

  [[nodiscard]] bool contains(const Index& i) const {
    for (std::size_t a = 0; a < 3; ++a) {
      if (i[a] < low_[a] || i[a] >= high_[a]) return false;
    }
    return true;
  }

 public:
  // Of merged lines: what the merged ones would have (scene/detail, merge_lines).
  [[nodiscard]] double width() const {
    return (scene_.vector->r1 + scene_.vector->r2) / scene_.camera.height;
  }
  [[nodiscard]] double layer_opacity() const { return scene_.vector->opacity / merged_; }

 private:
  const scene::Scene& scene_;
  const reference::View view_;
  Index low_{0, 0, 0};
  Index high_;
  std::int64_t count_ = 1;
  double merged_ = 1;
  std::array<double, 3> finer_{1, 1, 1};
};

}  // namespace

quality::Content content_of(const scene::Scene& scene) {
  const Sampling sampling(scene);
  std::vector<Projected> seen = sampling.project();
  std::sort(seen.begin(), seen.end(), [](const Projected& a, const Projected& b) {
    return a.bin != b.bin ? a.bin < b.bin : a.depth < b.depth;
  });
  double line_squares = 0;
  Mean layers, length, line_depth, shade, gaps;
  Mean depth, cell_depth, tint, cell, finest;
  for (auto first = seen.begin(); first != seen.end();) {
    const auto end =
        std::find_if(first, seen.end(), [&](const Projected& p) { return p.bin != first->bin; });
    double transmitted = 1;
    double lines = 0;
    double medium = 0;
    double whole_tau = 0;
    double whole_cover = 0;
    for (auto p = first; p != end; ++p) {
      const double of_medium = transmitted * -std::expm1(-p->tau);
      const double of_line = transmitted * -std::expm1(-p->cover) * std::exp(-0.5 * p->tau);
      transmitted *= std::exp(-p->tau - p->cover);
      medium += of_medium;
      lines += of_line;
      whole_tau += p->tau;
      whole_cover += p->cover;
      cell_depth.add(p->cell_depth, of_medium);
      tint.add(p->tint, of_medium);
      line_depth.add(p->cell_depth, of_line);
      length.add(p->length, of_line);
      shade.add(p->shade, of_line);
      gaps.add(p->gaps, of_line);
      cell.add(p->cell, of_line + of_medium);
      finest.add(p->finest, of_line + of_medium);
    }
    line_squares += lines * lines;
    layers.add(whole_cover, lines);
    depth.add(whole_tau, medium);
    first = end;
  }
  quality::Content out;
  out.lines = std::sqrt(line_squares / (columns * rows));
  out.layers = layers.value();
  out.length = length.value();
  out.shade = shade.value();
  out.gaps = gaps.value();
  out.line_depth = line_depth.value();
  out.depth = depth.value();
  out.cell_depth = cell_depth.value();
  out.tint = tint.value();
  out.cell = cell.value();
  out.finest_cell = finest.value();
  const Sampling::Texture texture = sampling.texture(seen);
  out.step = std::sqrt(texture.step.sum);
  out.bend = std::sqrt(texture.bend.sum);
  out.wide_bend = std::sqrt(texture.wide_bend.sum);
  out.order = std::sqrt(texture.order.sum);
  out.step_cell = texture.cell.value();
  return out;
}

}  // namespace windsplat::frame
