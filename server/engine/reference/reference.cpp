// Scene -> kernels -> by pixel: which of them its ray meets -> the light along it.
#include "server/engine/reference/reference.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/profile.hpp"
#include "server/engine/reference/ray.hpp"

namespace windsplat::engine::reference {

namespace {

// ---- which kernels may cover a pixel ----

constexpr int tile_side = 8;  // pixels

struct PixelRange {
  int x0 = 0, x1 = -1, y0 = 0, y1 = -1;  // both ends included
};

// Pixels of [0, size) whose middle may lie within [low, high].
std::pair<int, int> pixels_between(double low, double high, int size) {
  const double first = std::clamp(std::floor(low - 0.5), 0.0, static_cast<double>(size));
  const double last = std::clamp(std::ceil(high - 0.5), -1.0, size - 1.0);
  return {static_cast<int>(first), static_cast<int>(last)};
}

// Lists of kernels by tile, each ascending.
class ScreenGrid {
 public:
  ScreenGrid(int width, int height)
      : width_(width),
        height_(height),
        columns_((width + tile_side - 1) / tile_side),
        rows_((height + tile_side - 1) / tile_side) {
    lists_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  }

  void add(const ScreenBox& box, std::uint32_t id) {
    const auto [x0, x1] = pixels_between(box.x0, box.x1, width_);
    const auto [y0, y1] = pixels_between(box.y0, box.y1, height_);
    if (x1 < x0 || y1 < y0) return;
    for (int ty = y0 / tile_side; ty <= y1 / tile_side; ++ty) {
      for (int tx = x0 / tile_side; tx <= x1 / tile_side; ++tx) list(tx, ty).push_back(id);
    }
  }

  [[nodiscard]] const std::vector<std::uint32_t>& at(int x, int y) const {
    return lists_[static_cast<std::size_t>(y / tile_side) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(x / tile_side)];
  }

 private:
  std::vector<std::uint32_t>& list(int tx, int ty) {
    return lists_[static_cast<std::size_t>(ty) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(tx)];
  }

  int width_, height_, columns_, rows_;
  std::vector<std::vector<std::uint32_t>> lists_;
};

// ---- the medium along a ray ----

struct Ray {
  Vec origin{};     // from the eye
  Vec direction{};  // forward component 1: the parameter is the view depth
  double length = 1;
};

// A splat's stretch of a ray: r^2 = least2 + (cells (z - middle))^2.
struct Stretch {
  double entry = 0, exit = 0;
  double middle = 0;
  double cells2 = 0;  // cells per depth, squared
  double least2 = 0;
  double rho = 0;  // per depth, over the footprint's integral
  Vec color{};
};

class SplatMedium {
 public:
  explicit SplatMedium(const Profile& profile) : profile_(profile) {}

  void start(const Ray& ray, double nearest) {
    ray_ = ray;
    nearest_ = nearest;
    stretches_.clear();
    active_.clear();
    breaks_.clear();
    next_ = 0;
  }

  void add(const Splat& splat) {
    const auto to_cells = [&](const Vec& v) {
      return Vec{dot(splat.inverse[0], v), dot(splat.inverse[1], v), dot(splat.inverse[2], v)};
    };
    const Vec d = to_cells(ray_.direction);
    const Vec o = to_cells({splat.from_eye[0] - ray_.origin[0], splat.from_eye[1] - ray_.origin[1],
                            splat.from_eye[2] - ray_.origin[2]});
    Stretch stretch;
    stretch.cells2 = dot(d, d);
    stretch.middle = dot(o, d) / stretch.cells2;
    // The nearest point of the ray, not a difference of squares: far eyes would cancel all.
    const Vec off{o[0] - stretch.middle * d[0], o[1] - stretch.middle * d[1],
                  o[2] - stretch.middle * d[2]};
    stretch.least2 = dot(off, off);
    constexpr double t2 = footprint_t * footprint_t;
    constexpr double s2 = footprint_s * footprint_s;
    if (stretch.least2 >= t2) return;
    const double half = std::sqrt((t2 - stretch.least2) / stretch.cells2);
    stretch.entry = stretch.middle - half;
    stretch.exit = stretch.middle + half;
    if (stretch.exit <= nearest_) return;
    stretch.rho = splat.rho * ray_.length / footprint_integral;
    stretch.color = splat.color;
    stretches_.push_back(stretch);
    add_break(stretch.entry);
    add_break(stretch.exit);
    if (stretch.least2 < s2) {
      const double inner = std::sqrt((s2 - stretch.least2) / stretch.cells2);
      add_break(stretch.middle - inner);
      add_break(stretch.middle + inner);
    }
  }

  // Where a ray is to be cut, ascending.
  const std::vector<double>& finish() {
    std::sort(breaks_.begin(), breaks_.end());
    std::sort(stretches_.begin(), stretches_.end(),
              [](const Stretch& a, const Stretch& b) { return a.entry < b.entry; });
    return breaks_;
  }

  void begin(double from, double to) {
    const double middle = 0.5 * (from + to);
    while (next_ < stretches_.size() && stretches_[next_].entry <= middle) {
      active_.push_back(stretches_[next_++]);
    }
    active_.erase(std::remove_if(active_.begin(), active_.end(),
                                 [&](const Stretch& s) { return s.exit <= middle; }),
                  active_.end());
  }

  void operator()(const double* depth, int count, Samples& out) const {
    for (const Stretch& s : active_) {
      for (int j = 0; j < count; ++j) {
        const double z = depth[j] - s.middle;
        const double rho = s.rho * profile_(s.least2 + s.cells2 * z * z);
        out.extinction[j] += rho;
        for (int c = 0; c < 3; ++c) out.emission[c][j] += rho * s.color[c];
      }
    }
  }

 private:
  void add_break(double depth) { breaks_.push_back(std::max(depth, nearest_)); }

  const Profile& profile_;
  Ray ray_;
  double nearest_ = 0;
  std::vector<Stretch> stretches_;
  std::vector<Stretch> active_;
  std::vector<double> breaks_;
  std::size_t next_ = 0;
};

// ---- pixels ----

struct Frame {
  const View& view;
  const Kernels& kernels;
  const ScreenGrid& splats;
  const ScreenGrid& ribbons;
  const Rules& rules;
  double tolerance = 0;
};

class Painter {
 public:
  Painter(const Frame& frame, const Profile& profile) : frame_(frame), medium_(profile) {}

  Light pixel(int x, int y, RayCount& count) {
    const View& view = frame_.view;
    const double px = x + 0.5;
    const double py = y + 0.5;
    medium_.start(make_ray(px, py), view.perspective ? view.near : lowest);
    for (const std::uint32_t id : frame_.splats.at(x, y)) medium_.add(frame_.kernels.splats[id]);
    const std::vector<double>& breaks = medium_.finish();
    gather_sheets(x, y, px, py);
    return integrate_ray(frame_.rules, medium_, breaks, sheets_, frame_.tolerance, count);
  }

 private:
  static constexpr double lowest = std::numeric_limits<double>::lowest();

  [[nodiscard]] Ray make_ray(double px, double py) const {
    const View& view = frame_.view;
    const double right = (px - view.half_width) * view.pixel;
    const double down = (py - view.half_height) * view.pixel;
    Ray ray;
    ray.direction = view.forward;
    Vec& to = view.perspective ? ray.direction : ray.origin;
    for (int a = 0; a < 3; ++a) to[a] += right * view.right[a] + down * view.down[a];
    ray.length = std::sqrt(dot(ray.direction, ray.direction));
    return ray;
  }

  void gather_sheets(int x, int y, double px, double py) {
    sheets_.clear();
    for (const std::uint32_t id : frame_.ribbons.at(x, y)) {
      const auto hit = hit_ribbon(frame_.kernels.ribbons[id], px, py);
      if (hit.opacity > 0) sheets_.push_back({hit.depth, hit.opacity, hit.color});
    }
    // Ids ascend already.
    std::stable_sort(sheets_.begin(), sheets_.end(),
                     [](const Sheet& a, const Sheet& b) { return a.depth < b.depth; });
  }

  const Frame& frame_;
  SplatMedium medium_;
  std::vector<Sheet> sheets_;
};

}  // namespace

Result<Picture> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                       const Options& options, const std::function<void(int)>& progress) {
  const int width = scene.camera.width;
  const int height = scene.camera.height;
  const View view = make_view(scene.camera);
  const Kernels kernels = list_kernels(scene, view);
  ScreenGrid splats(width, height);
  ScreenGrid ribbons(width, height);
  for (std::size_t i = 0; i < kernels.splats.size(); ++i) {
    splats.add(kernels.splat_boxes[i], static_cast<std::uint32_t>(i));
  }
  for (std::size_t i = 0; i < kernels.ribbons.size(); ++i) {
    ribbons.add(ribbon_box(kernels.ribbons[i]), static_cast<std::uint32_t>(i));
  }
  const Rules rules = make_rules();
  const Profile profile;
  const Frame frame{view, kernels, splats, ribbons, rules, options.tolerance};
  std::vector<Painter> painters(pool.size(), Painter(frame, profile));
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.rgba.assign(4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0.0);
  std::vector<RayCount> counts(static_cast<std::size_t>(height));
  std::atomic<int> rows_done{0};
  pool.run(counts.size(), [&](std::size_t row, unsigned worker) {
    double* to = picture.rgba.data() + 4 * row * static_cast<std::size_t>(width);
    for (int x = 0; x < width; ++x, to += 4) {
      if (cancel.cancelled()) return;
      const Light light = painters[worker].pixel(x, static_cast<int>(row), counts[row]);
      std::copy(light.rgb.begin(), light.rgb.end(), to);
      to[3] = std::min(light.alpha, 1.0);
    }
    if (progress) progress(++rows_done);
  });
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "the reference was cancelled");
  for (const RayCount& count : counts) {
    picture.pieces += count.pieces;
    picture.evaluations += count.evaluations;
  }
  return picture;
}

}  // namespace windsplat::engine::reference
