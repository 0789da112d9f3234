// Samples -> projected optical depths and line areas -> means over the visible ones.
#include "server/frame/content.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <optional>
#include <vector>

#include "server/base/pcg3d.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/frame/drawn_samples.hpp"
#include "server/frame/light_changes.hpp"
#include "server/frame/measure.hpp"
#include "server/frame/pixel_trials.hpp"
#include "server/scene/build.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

constexpr std::int64_t samples_max = 4096;
constexpr int columns = 10;
constexpr int rows = 8;
constexpr int pieces = 4;  // of a line, at different depths

struct Line {
  bool drawn = false;
  glm::dvec3 color{0, 0, 0};
  double magnitude = 0;  // relative to the full one, at most 1
};

// What a sample adds to the picture.
struct Seen {
  Index index{};
  double depth = 0;
  double x = 0, y = 0;        // bins
  double wide = 0, high = 0;  // of its cell, bins
  double tau = 0;             // of the medium of its cell along the view
  double cell_depth = 0;      // of that of a cell at full detail
  double cover = 0;           // area of its lines times their opacity, per area of a bin
  double line_depth = 0;      // extent of the line in depth
  double length = 0;
  double cell = 0;
  double finest = 0;
  double tint = 0;
  double shade = 0;
  double gaps = 0;
};

// A cell's medium or a piece of a line in a bin.
struct Part {
  int bin = 0;
  double depth = 0;
  double tau = 0;  // mean over the bin
  double cover = 0;
  double hidden = 0;  // optical depth of the bin that counts: cells do not hide what is beside them
  const Seen* of = nullptr;
};

class Sampling {
 public:
  Sampling(const scene::Scene& scene, const CancelToken& cancel)
      : scene_(scene), cancel_(cancel), view_(reference::make_view(scene.camera)), samples_(scene) {
    for (std::size_t a = 0; a < 3; ++a) {
      merged_ *= std::exp2(scene.level[a]);
      finer_[a] = std::exp2(-scene.level[a]);
    }
    for (const scene::ScalarLayer& layer : scene.scalars) stride_ = std::max(stride_, layer.stride);
    if (!scene.vector) return;
    if (scene.scalars.empty()) stride_ = scene.vector->stride;
    for (const int places : scene.vector->drawn_places) merged_lines_ *= places;
  }

  // Row by row of the picture and by depth.
  [[nodiscard]] std::vector<Seen> seen() const {
    std::vector<Seen> out;
    const std::int64_t taken = std::min(samples_.count(), samples_max);
    out.reserve(static_cast<std::size_t>(taken));
    for (std::int64_t n = 0; n < taken && !cancel_.cancelled(); ++n) {
      std::int64_t at = n;
      if (taken < samples_.count()) {
        const double within = pcg3d({static_cast<std::uint32_t>(n), 17, 29})[0] / 4294967296.0;
        at = std::min(samples_.count() - 1, static_cast<std::int64_t>((n + within) * each()));
      }
      const auto i = samples_.at(at);
      if (!i) continue;
      if (auto one = project(*i)) out.push_back(*one);
    }
    std::sort(out.begin(), out.end(), [](const Seen& a, const Seen& b) {
      const auto place = [](const Seen& one) {
        return std::array<double, 3>{std::floor(one.y), std::floor(one.x), one.depth};
      };
      return place(a) < place(b);
    });
    return out;
  }

  // Samples that each one taken stands for.
  [[nodiscard]] double each() const {
    const double count = static_cast<double>(samples_.count());
    return count / std::min(count, static_cast<double>(samples_max));
  }

  // Sorted by bin, then by depth.
  [[nodiscard]] std::vector<Part> parts(const std::vector<Seen>& seen) const {
    std::vector<Part> out;
    out.reserve(seen.size() * (1 + pieces));
    for (const Seen& one : seen) {
      each_bin(one, [&](int bin, double area) { add_parts(one, bin, area, out); });
    }
    std::sort(out.begin(), out.end(), [](const Part& a, const Part& b) {
      return a.bin != b.bin ? a.bin < b.bin : a.depth < b.depth;
    });
    return out;
  }

  [[nodiscard]] LightChanges light_changes(const std::vector<Seen>& seen) const {
    if (scene_.scalars.empty()) return {};
    return frame::light_changes(samples_, rays_through(seen), cancel_);
  }

  // Through the kernels with lines, where few samples have one.
  [[nodiscard]] std::vector<RayThrough> tried_rays(const std::vector<Seen>& seen) const {
    std::vector<RayThrough> rays = rays_through(seen);
    if (!scene_.vector) return rays;
    for (RayThrough& ray : rays) ray.sample = samples_.line_of(ray.sample);
    return rays;
  }

  [[nodiscard]] std::vector<RayThrough> rays_through(const std::vector<Seen>& seen) const {
    std::vector<RayThrough> rays;
    rays.reserve(seen.size());
    for (const Seen& one : seen) {
      double area = 0;
      each_bin(one, [&](int, double within) { area += within; });
      rays.push_back({one.index, each() * std::min(1.0, area / (one.wide * one.high))});
    }
    return rays;
  }

 private:
  [[nodiscard]] Line line(const Index& i) const {
    Line out;
    if (!scene_.vector) return out;
    const scene::VectorLayer& layer = *scene_.vector;
    std::array<double, 3> v{};
    for (int c = 0; c < layer.field->components; ++c) {
      v[static_cast<std::size_t>(c)] = layer.field->component(c)[samples_.vector_number(i)];
    }
    const double magnitude = std::hypot(v[0], v[1], v[2]);
    out.drawn = magnitude > 0 && magnitude >= layer.min_magnitude;
    if (!out.drawn) return out;
    out.magnitude = std::min(1.0, magnitude / layer.magnitude_range[1]);
    using scene::LineColor;
    double value = samples_.place(i).z;
    if (layer.color_by == LineColor::magnitude) value = magnitude;
    if (layer.color_by == LineColor::direction) {
      value = std::atan2(v[0], v[1]) / 0.017453292519943295;
      if (value < 0) value += 360;
    }
    if (layer.color_by == LineColor::scalar) value = layer.color_field->values[samples_.number(i)];
    const double k = layer.magnitude_intensity;
    const double bright = samples_.line_brightness(i) * (1 - k + k * out.magnitude);
    out.color = bright * color_at(layer.color, value);
    return out;
  }

  [[nodiscard]] std::optional<Seen> project(const Index& i) const {
    const scene::Camera& camera = scene_.camera;
    const glm::dvec3 way = samples_.place(i) - camera.eye;
    Seen out;
    out.index = i;
    out.depth = glm::dot(way, camera.forward);
    if (camera.perspective && !(out.depth > camera.near)) return std::nullopt;
    const double scale =  // heights of the picture per world unit
        0.5 / (camera.half_height * (camera.perspective ? out.depth : 1));
    const double aspect = static_cast<double>(camera.width) / camera.height;
    std::array<double, 3> edges{};
    double volume = 1;
    out.finest = 1e30;
    double cells2 = 0;  // passed for each unit of length along the view, squared
    for (std::size_t a = 0; a < 3; ++a) {
      edges[a] = samples_.edge(i, a);
      volume *= edges[a];
      out.finest = std::min(out.finest, edges[a] * finer_[a] * scale);
      const auto along = static_cast<glm::length_t>(a);
      cells2 += std::pow(camera.forward[along] / edges[a], 2);
    }
    const double cell = std::cbrt(volume);
    const double chord = scene_.lattice.places ? cell : std::min(1 / std::sqrt(cells2), 1e3 * cell);
    // Layers of terrain that coincide have cells without a volume.
    const double side = std::max(1e-9, chord > 0 ? std::sqrt(volume / chord) * scale : 0);
    out.x = columns * (glm::dot(way, camera.right) * scale / aspect + 0.5);
    out.y = rows * (0.5 - glm::dot(way, camera.up) * scale);
    out.wide = columns * side / aspect;
    out.high = rows * side;
    bool within = false;
    each_bin(out, [&](int, double) { within = true; });
    if (!within) return std::nullopt;

    const Medium here = samples_.medium(i);
    const double finer = std::cbrt(1 / merged_);
    out.cell = cell * finer * scale;
    out.tau = here.extinction * chord;
    out.cell_depth = out.tau * finer * stride_;
    const Line own = line(i);
    add_line(i, own, scale, *std::max_element(edges.begin(), edges.end()), out);
    out.line_depth += chord;  // lines are moved within their cells
    compare(i, here, own, out);
    return out;
  }

  // Calls visit(bin, area of the cell in it) for a sample; cells below the size of a bin are in
  // that of their centre.
  template <class Visit>
  void each_bin(const Seen& one, const Visit& visit) const {
    const auto extent = [](double at, double size, int count) {
      const double half = size > 1 ? size / 2 : 0;
      return std::array<int, 2>{
          static_cast<int>(std::floor(std::clamp(at - half, -1.0, 1.0 * count))),
          static_cast<int>(std::floor(std::clamp(at + half, -1.0, 1.0 * count)))};
    };
    const auto overlap = [](double at, double size, int bin) {
      if (size <= 1) return size;
      return std::min(at + size / 2, bin + 1.0) - std::max(at - size / 2, 1.0 * bin);
    };
    const auto [left, right] = extent(one.x, one.wide, columns);
    const auto [top, bottom] = extent(one.y, one.high, rows);
    for (int row = std::max(top, 0); row <= std::min(bottom, rows - 1); ++row) {
      for (int column = std::max(left, 0); column <= std::min(right, columns - 1); ++column) {
        visit(row * columns + column,
              overlap(one.x, one.wide, column) * overlap(one.y, one.high, row));
      }
    }
  }

  // Cells hide what is behind them, not what is beside them.
  void add_parts(const Seen& one, int bin, double area, std::vector<Part>& out) const {
    const double share = each() * area;
    const double opaque = -std::expm1(-one.tau);
    const double hidden = share < 1 ? -std::log1p(-share * opaque) : share * one.tau;
    if (one.tau > 0) out.push_back({bin, one.depth, share * one.tau, 0, hidden, &one});
    if (one.cover <= 0) return;
    const double cover = one.cover * area / (one.wide * one.high);
    const int count = scene_.scalars.empty() ? 1 : pieces;
    for (int n = 0; n < count; ++n) {
      const double q = (n + 0.5) / count - 0.5;
      out.push_back({bin, one.depth + q * one.line_depth, 0, cover / count, 0, &one});
    }
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

  void add_line(const Index& i, const Line& own, double scale, double widest, Seen& out) const {
    if (!own.drawn) return;
    const auto drawn = drawn_vector(i);
    if (!drawn) return;
    const scene::VectorLayer& layer = *scene_.vector;
    const double whole = reference::length(drawn->extent);
    const double boxes = layer.stride * layer.data_stride / std::cbrt(merged_);
    const double most = layer.span * boxes * widest;
    // Streamlets are not clipped, and are as long.
    const double kept = whole > most && !layer.streamlets ? most / whole : 1;
    const double across = std::hypot(reference::dot(drawn->extent, view_.right),
                                     reference::dot(drawn->extent, view_.down));
    out.length = scale * across * kept;
    out.line_depth = std::abs(reference::dot(drawn->extent, view_.forward)) * kept;
    const double wide = width();
    const double lines = each() * merged_lines_ / std::pow(layer.stride, 3);
    const double aspect = static_cast<double>(scene_.camera.width) / scene_.camera.height;
    out.cover = lines * layer_opacity() * wide * (out.length + wide) * columns * rows / aspect;
  }

  // Differences from the next sample along each axis, of media along the view.
  void compare(const Index& i, const Medium& here, const Line& own, Seen& out) const {
    double tint = 0;
    int count = 0;
    int beside = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      auto next = samples_.neighbour(i, a, 1);
      if (!next) next = samples_.neighbour(i, a, -1);
      if (!next) continue;
      const Medium other = samples_.medium(*next);
      const glm::dvec3 step = samples_.place(*next) - samples_.place(i);
      const double length2 = glm::dot(step, step);  // 0 where layers of terrain coincide
      if (here.extinction > 0 && other.extinction > 0 && length2 > 0) {
        const double along = std::pow(glm::dot(step, scene_.camera.forward), 2) / length2;
        const glm::dvec3 change = here.color() - other.color();
        tint += along * glm::dot(change, change);
      }
      if (!own.drawn) continue;
      const auto next_line = samples_.neighbour_line(i, a);
      if (!next_line) continue;
      ++count;
      const Line line_beside = line(*next_line);
      if (!line_beside.drawn) continue;
      ++beside;
      out.shade += glm::length(own.color - line_beside.color);
    }
    out.tint = std::sqrt(tint);
    if (beside > 0) out.shade /= beside;
    if (own.drawn && count > 0) out.gaps = static_cast<double>(count - beside) / count;
  }

  // Of merged lines: what the merged ones would have (scene/detail, merge_lines).
  [[nodiscard]] double width() const {
    const scene::VectorLayer& layer = *scene_.vector;
    return (layer.r1 + layer.r2 + 2 * layer.mark.halo) / scene_.camera.height;
  }
  [[nodiscard]] double layer_opacity() const { return scene_.vector->opacity / merged_lines_; }

  const scene::Scene& scene_;
  const CancelToken& cancel_;
  const reference::View view_;
  const DrawnSamples samples_;
  double merged_ = 1;        // samples of the data in one of the level
  double merged_lines_ = 1;  // lines of full detail in one
  std::array<double, 3> finer_{1, 1, 1};
  int stride_ = 1;
};

// What is typical, of cells as large as one before the eye: the kernels of samples behind it are
// seen without a sample being seen.
quality::Content of_cells_at_the_eye(const scene::Camera& camera) {
  const quality::Content typical;
  return quality::scaled(typical, 0.5 / camera.half_height / typical.cell);
}

bool shows_anything(const quality::Trials& trials) {
  return std::max({trials.kernel, trials.slab, trials.half, trials.stop}) > 0;
}

std::atomic<std::uint64_t> described_scenes{0};

}  // namespace

std::uint64_t descriptions() { return described_scenes; }

std::optional<quality::Content> content_of(const scene::Scene& scene, const CancelToken& cancel) {
  ++described_scenes;
  const Sampling sampling(scene, cancel);
  const std::vector<Seen> seen = sampling.seen();
  if (cancel.cancelled()) return std::nullopt;
  const std::vector<Part> parts = sampling.parts(seen);
  double line_squares = 0;
  Mean layers, length, line_depth, shade, gaps;
  Mean depth, cell_depth, tint, cell, finest;
  for (auto first = parts.begin(); first != parts.end();) {
    const auto end =
        std::find_if(first, parts.end(), [&](const Part& p) { return p.bin != first->bin; });
    double transmitted = 1;
    double lines = 0;
    double medium = 0;
    double whole_tau = 0;
    double whole_cover = 0;
    for (auto p = first; p != end; ++p) {
      const double of_medium = transmitted * -std::expm1(-p->hidden);
      const double of_line = transmitted * -std::expm1(-p->cover);
      transmitted *= std::exp(-p->hidden - p->cover);
      medium += of_medium;
      lines += of_line;
      whole_tau += p->tau;
      whole_cover += p->cover;
      cell_depth.add(p->of->cell_depth, of_medium);
      tint.add(p->of->tint, of_medium);
      line_depth.add(p->of->cell_depth, of_line);
      length.add(p->of->length, of_line);
      shade.add(p->of->shade, of_line);
      gaps.add(p->of->gaps, of_line);
      cell.add(p->of->cell, of_line + of_medium);
      finest.add(p->of->finest, of_line + of_medium);
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
  const LightChanges light = sampling.light_changes(seen);
  out.step = std::sqrt(light.step.sum);
  const auto roots = [](const auto& sums, auto& to) {
    std::transform(sums.begin(), sums.end(), to.begin(),
                   [](const Mean& one) { return std::sqrt(one.sum); });
  };
  roots(light.cell_bends, out.cell_bends);
  roots(light.bends, out.bends);
  roots(light.shifts, out.shifts);
  out.order = std::sqrt(light.order.sum);
  out.step_cell = light.cell.value();
  const PixelTrials tried = pixel_trials(scene, sampling.tried_rays(seen), cancel);
  if (cancel.cancelled()) return std::nullopt;
  const bool beside = scene.camera.perspective && tried.trials && shows_anything(*tried.trials);
  if (seen.empty() && beside) out = of_cells_at_the_eye(scene.camera);
  out.trials = tried.trials;
  out.skipped_change = tried.skipped_change;
  return out;
}

namespace {

Described describe(const quality::Viewpoint& viewpoint, const quality::SceneSignature& signature,
                   const scene::Scene& scene, quality::Tables& tables, const CancelToken& cancel) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  Described out{viewpoint};
  out.viewpoint.content = content_of(scene, cancel);
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start);
  out.describe_us = std::max<std::int64_t>(took.count(), 1);
  if (out.viewpoint.content) tables.describe(signature, out.viewpoint);
  return out;
}

}  // namespace

quality::Viewpoint known_viewpoint_of(const scene::CompletedView& completed,
                                      quality::Tables& tables) {
  quality::Viewpoint viewpoint = viewpoint_of(completed, nullptr);
  viewpoint.content = tables.content(quality::signature_of(completed.view()), viewpoint);
  return viewpoint;
}

Described described(const scene::CompletedView& completed, const scene::Scene& scene,
                    quality::Tables& tables, const CancelToken& cancel) {
  const quality::Viewpoint viewpoint = known_viewpoint_of(completed, tables);
  if (viewpoint.content) return {viewpoint};
  return describe(viewpoint, quality::signature_of(completed.view()), scene, tables, cancel);
}

Described described(const scene::CompletedView& completed, const data::Dataset& dataset,
                    quality::Tables& tables, const CancelToken& cancel) {
  const quality::Viewpoint viewpoint = known_viewpoint_of(completed, tables);
  if (viewpoint.content) return {viewpoint};
  data::Dataset resident = dataset.resident_only();
  const auto scene = scene::build_scene(completed, resident);
  if (!scene) return {viewpoint};
  return describe(viewpoint, quality::signature_of(completed.view()), *scene, tables, cancel);
}

}  // namespace windsplat::frame
