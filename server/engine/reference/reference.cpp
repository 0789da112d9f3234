// Scene -> kernels -> kernels by pixel -> the integral along each ray.
#include "server/engine/reference/reference.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "server/base/check.hpp"
#include "server/engine/layers/surfaces.hpp"
#include "server/engine/reference/body.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/engine/reference/profile.hpp"
#include "server/engine/reference/ray.hpp"
#include "server/engine/reference/screen_grid.hpp"

namespace windsplat::engine::reference {

namespace {

// ---- the medium along a ray ----

struct Ray {
  Vec origin{};     // position relative to the eye
  Vec direction{};  // forward component 1: the parameter is the view depth
  double length = 1;
};

// The interval of a ray within a splat: r^2 = least2 + (cells (z - middle))^2.
struct Stretch {
  double entry = 0, exit = 0;
  double middle = 0;
  double cells2 = 0;  // cells per depth, squared
  double least2 = 0;
  double rho = 0;  // extinction per unit of depth, divided by the integral of the footprint
  Vec color{};
};

class SplatMedium {
 public:
  explicit SplatMedium(const Profile& profile) : profile_(profile) {}

  // Storage for `splats` splats on one ray.
  static std::uint64_t bytes_for(std::uint64_t splats) {
    return splats * (2 * sizeof(Stretch) + breaks_each * sizeof(double));
  }
  void make_room(std::size_t splats) {
    stretches_.reserve(splats);
    active_.reserve(splats);
    breaks_.reserve(breaks_each * splats);
  }

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
    // Computed at the nearest point of the ray; a difference of squares would cancel for distant
    // eyes.
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

  // Depths at which to divide the ray, ascending.
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
  static constexpr std::size_t breaks_each = 4;

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
  std::optional<scene::Body> body;
  bool combine_or = false;  // the lines
  const Kernels& kernels;
  const ScreenGrid& splats;
  const ScreenGrid& ribbons;
  const Rules& rules;
  double tolerance = 0;
  const surface::Pixels* surfaces = nullptr;  // null: none
};

class Painter {
 public:
  Painter(const Frame& frame, const Profile& profile) : frame_(frame), medium_(profile) {}

  // Storage for a pixel that `splats` and `ribbons` may cover; sorting surfaces needs a second
  // copy.
  static std::uint64_t bytes_for(std::uint64_t splats, std::uint64_t ribbons) {
    return SplatMedium::bytes_for(splats) + 2 * (ribbons + others) * sizeof(Surface);
  }
  void make_room(std::size_t splats, std::size_t ribbons) {
    medium_.make_room(splats);
    surfaces_.reserve(ribbons + others);
  }

  Light pixel(int x, int y, RayCount& count) {
    const View& view = frame_.view;
    const double px = x + 0.5;
    const double py = y + 0.5;
    medium_.start(make_ray(px, py), view.perspective ? view.near : lowest);
    for (const std::uint32_t id : frame_.splats.at(x, y)) medium_.add(frame_.kernels.splats[id]);
    const std::vector<double>& breaks = medium_.finish();
    gather_surfaces(x, y, px, py);
    return integrate_ray(frame_.rules, medium_, breaks, surfaces_, frame_.tolerance, count);
  }

 private:
  static constexpr double lowest = std::numeric_limits<double>::lowest();
  // The body and fragments of surfaces, and the lines combined by `or` around them.
  static constexpr std::size_t others = 2 * (surface::fragments_max + 1) + 1;

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

  static void sort(std::vector<Surface>& surfaces) {
    // Stable: equal depths stay in order of id.
    std::stable_sort(surfaces.begin(), surfaces.end(),
                     [](const Surface& a, const Surface& b) { return a.depth < b.depth; });
  }

  // The body and the fragments of surfaces.
  void gather_solid(int x, int y, double px, double py) {
    if (frame_.body) {
      const Surface body = body_surface(*frame_.body, frame_.view, px, py);
      if (body.opacity > 0) surfaces_.push_back(body);
    }
    if (frame_.surfaces == nullptr) return;
    constexpr int side = surface::cell_side;
    const int column = x / side;
    const int row = y / side;
    if (column != column_ || row != row_) frame_.surfaces->look(column, row, cell_);
    column_ = column;
    row_ = row;
    const auto pixel =
        static_cast<std::size_t>(y % side) * side + static_cast<std::size_t>(x % side);
    for (std::uint32_t n = cell_.first.at(pixel); n < cell_.first.at(pixel + 1); ++n) {
      const surface::Fragment& from = cell_.fragments[n];
      surfaces_.push_back({from.depth,
                           static_cast<double>(from.opacity),
                           {static_cast<double>(from.rgb[0]), static_cast<double>(from.rgb[1]),
                            static_cast<double>(from.rgb[2])}});
    }
  }

  // The lines that are combined by `or`, between one of the other surfaces and the next, as one
  // surface each: before the medium, and next to that surface.
  void gather_or_surfaces(int x, int y, double px, double py) {
    gather_solid(x, y, px, py);
    sort(surfaces_);
    const std::size_t solid = surfaces_.size();
    for (std::size_t n = 0; n <= solid; ++n) {
      surfaces_.push_back({n == 0 ? lowest : surfaces_[n - 1].depth});
    }
    Surface* const lines = surfaces_.data() + solid;
    for (const std::uint32_t id : frame_.ribbons.at(x, y)) {
      const auto hit = hit_ribbon(frame_.kernels.ribbons[id], px, py);
      std::size_t before = 0;
      while (before < solid && surfaces_[before].depth <= hit.depth) ++before;
      Surface& all = lines[before];
      all.opacity = std::max(all.opacity, hit.opacity);
      for (int c = 0; c < 3; ++c) {
        all.color[c] = std::max(all.color[c], hit.opacity * hit.color[c]);  // premultiplied
      }
    }
    for (std::size_t n = 0; n <= solid; ++n) {
      for (double& color : lines[n].color) color /= std::max(lines[n].opacity, 1e-300);
    }
    // Those next to a surface come after it.
    sort(surfaces_);
    surfaces_.erase(std::remove_if(surfaces_.begin(), surfaces_.end(),
                                   [](const Surface& s) { return !(s.opacity > 0); }),
                    surfaces_.end());
  }

  void gather_surfaces(int x, int y, double px, double py) {
    surfaces_.clear();
    if (frame_.combine_or) return gather_or_surfaces(x, y, px, py);
    for (const std::uint32_t id : frame_.ribbons.at(x, y)) {
      const auto hit = hit_ribbon(frame_.kernels.ribbons[id], px, py);
      if (hit.opacity > 0) surfaces_.push_back({hit.depth, hit.opacity, hit.color});
    }
    gather_solid(x, y, px, py);
    sort(surfaces_);
  }

  const Frame& frame_;
  SplatMedium medium_;
  std::vector<Surface> surfaces_;
  surface::Cell cell_;  // of the last pixel
  int column_ = -1, row_ = -1;
};

Error cancelled_error() { return make_error(ErrorKind::cancelled, "reference cancelled"); }

}  // namespace

struct Painting::State {
  State(const scene::Scene& scene, const Options& options)
      : view(make_view(scene.camera)),
        splats(scene.camera.width, scene.camera.height),
        ribbons(scene.camera.width, scene.camera.height),
        rules(make_rules()),
        frame{view,    scene.body,       scene.vector && scene.vector->combine_or,
              kernels, splats,           ribbons,
              rules,   options.tolerance} {}

  Result<void> reserve_bytes(std::uint64_t bytes, const Reserve& reserve) {
    auto held = reserve(bytes);
    if (!held) return held.error();
    reserved.push_back(std::move(*held));
    return {};
  }

  Result<void> list_surfaces(const scene::Scene& scene, const CancelToken& cancel,
                             const Reserve& reserve) {
    if (scene.surfaces.empty()) return {};
    if (reserve) {
      const std::uint64_t bytes = surface::Pixels::bytes_for(scene.surfaces);
      if (auto held = reserve_bytes(bytes, reserve); !held) return held;
    }
    ThreadPool alone(1);
    shown = scene.surfaces;  // the scene may end before the drawing
    surfaces.list(shown, surface_view(scene.camera), scene.camera.width, scene.camera.height, alone,
                  cancel);
    frame.surfaces = &surfaces;
    if (cancel.cancelled()) return cancelled_error();
    return {};
  }

  // Allocates for the upper bounds, so that no vector grows beyond the reserved bytes. Unused pages
  // do not become resident.
  Result<void> make_room_for_kernels(const scene::Scene& scene, const Reserve& reserve) {
    const KernelBounds bounds = kernel_bounds(scene);
    const std::uint64_t bytes =
        bounds.splats * (sizeof(Splat) + sizeof(ScreenBox)) + bounds.ribbons * sizeof(Ribbon);
    if (auto held = reserve_bytes(bytes, reserve); !held) return held;
    kernels.splats.reserve(bounds.splats);
    kernels.splat_boxes.reserve(bounds.splats);
    kernels.ribbons.reserve(bounds.ribbons);
    return {};
  }

  Result<void> list_by_tile(unsigned workers, const CancelToken& cancel, const Reserve& reserve) {
    const auto splat = [this](std::size_t id) { return kernels.splat_boxes[id]; };
    const auto ribbon = [this](std::size_t id) { return ribbon_box(kernels.ribbons[id]); };
    const std::size_t splats_all = kernels.splats.size();
    const std::size_t ribbons_all = kernels.ribbons.size();
    if (!splats.count(splats_all, splat, cancel) || !ribbons.count(ribbons_all, ribbon, cancel)) {
      return cancelled_error();
    }
    if (reserve) {
      const std::uint64_t work = workers * Painter::bytes_for(splats.longest(), ribbons.longest());
      auto held = reserve_bytes(splats.bytes() + ribbons.bytes() + work, reserve);
      if (!held) return held;
    }
    if (!splats.fill(splats_all, splat, cancel) || !ribbons.fill(ribbons_all, ribbon, cancel)) {
      return cancelled_error();
    }
    kernels.splat_boxes = std::vector<ScreenBox>();
    return {};
  }

  std::vector<std::shared_ptr<const void>> reserved;  // declared first: released last
  View view;
  Kernels kernels;
  ScreenGrid splats, ribbons;
  Rules rules;
  Profile profile;
  std::vector<surface::Shown> shown;  // to which `surfaces` refers
  surface::Pixels surfaces;
  Frame frame;
  std::vector<Painter> painters;
  std::vector<RayCount> counts;  // per worker
};

Painting::Painting(std::unique_ptr<State> state) : state_(std::move(state)) {}

Result<std::unique_ptr<Painting>> Painting::begin(const scene::Scene& scene, unsigned workers,
                                                  const CancelToken& cancel, const Options& options,
                                                  const Reserve& reserve) {
  if (cancel.cancelled()) return cancelled_error();
  WINDSPLAT_CHECK((scene.level == std::array{0, 0, 0}));  // it draws no merged samples
  auto state = std::make_unique<State>(scene, options);
  if (reserve) {
    if (auto room = state->make_room_for_kernels(scene, reserve); !room) return room.error();
  }
  list_kernels(scene, state->view, cancel, state->kernels);
  if (cancel.cancelled()) return cancelled_error();
  if (auto listed = state->list_by_tile(workers, cancel, reserve); !listed) return listed.error();
  if (auto listed = state->list_surfaces(scene, cancel, reserve); !listed) return listed.error();
  state->counts.resize(workers);
  state->painters.reserve(workers);
  for (unsigned worker = 0; worker < workers; ++worker) {
    state->painters.emplace_back(state->frame, state->profile);
    state->painters.back().make_room(state->splats.longest(), state->ribbons.longest());
  }
  return std::unique_ptr<Painting>(new Painting(std::move(state)));
}

Painting::~Painting() = default;

bool Painting::draw(int row, int x0, int x1, unsigned worker, const CancelToken& cancel,
                    double* to) {
  Painter& painter = state_->painters[worker];
  RayCount count;
  int x = x0;
  for (; x < x1 && !cancel.cancelled(); ++x, to += 4) {
    const Light light = painter.pixel(x, row, count);
    std::copy(light.rgb.begin(), light.rgb.end(), to);
    to[3] = std::min(light.alpha, 1.0);
  }
  state_->counts[worker].pieces += count.pieces;
  state_->counts[worker].evaluations += count.evaluations;
  return x == x1;
}

std::int64_t Painting::pieces() const {
  std::int64_t sum = 0;
  for (const RayCount& count : state_->counts) sum += count.pieces;
  return sum;
}

std::int64_t Painting::evaluations() const {
  std::int64_t sum = 0;
  for (const RayCount& count : state_->counts) sum += count.evaluations;
  return sum;
}

Result<Picture> render(const scene::Scene& scene, ThreadPool& pool, const CancelToken& cancel,
                       const Options& options, const std::function<void(int)>& progress) {
  const auto begun = Painting::begin(scene, pool.size(), cancel, options);
  if (!begun) return begun.error();
  Painting& painting = **begun;
  Picture picture;
  picture.width = scene.camera.width;
  picture.height = scene.camera.height;
  const std::size_t row_values = 4 * static_cast<std::size_t>(picture.width);
  picture.rgba.assign(row_values * static_cast<std::size_t>(picture.height), 0.0);
  std::atomic<int> rows_done{0};
  pool.run(static_cast<std::size_t>(picture.height), [&](std::size_t row, unsigned worker) {
    double* const to = picture.rgba.data() + row * row_values;
    const bool done = painting.draw(static_cast<int>(row), 0, picture.width, worker, cancel, to);
    if (done && progress) progress(++rows_done);
  });
  if (cancel.cancelled()) return cancelled_error();
  picture.pieces = painting.pieces();
  picture.evaluations = painting.evaluations();
  return picture;
}

}  // namespace windsplat::engine::reference
