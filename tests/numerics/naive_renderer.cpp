// Scene -> picture, one kernel after the other.
#include "tests/numerics/naive_renderer.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "server/base/check.hpp"
#include "server/engine/reference/body.hpp"
#include "server/engine/reference/kernels.hpp"
#include "server/study/truth/integrator.hpp"
#include "tests/numerics/naive_order.hpp"
#include "tests/numerics/partial_footprint.hpp"

namespace windsplat::naive {

namespace {

using engine::reference::KernelPosition;
using engine::reference::ScreenBox;
using engine::reference::View;
using scene::Scene;

template <class Real>
using Vec = std::array<Real, 3>;

template <class Real>
Real dot(const Vec<Real>& a, const Vec<Real>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class Real>
Vec<Real> cross(const Vec<Real>& a, const Vec<Real>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class Real>
using Line = engine::reference::BasicRibbon<Real>;

template <class Real>
Vec<Real> cast(const std::array<double, 3>& v) {
  return {static_cast<Real>(v[0]), static_cast<Real>(v[1]), static_cast<Real>(v[2])};
}

template <class Real>
Line<Real> cast(const engine::reference::Ribbon& from) {
  Line<Real> line;
  line.a = cast<Real>(from.a);
  line.b = cast<Real>(from.b);
  line.x0 = static_cast<Real>(from.x0);
  line.y0 = static_cast<Real>(from.y0);
  line.x1 = static_cast<Real>(from.x1);
  line.y1 = static_cast<Real>(from.y1);
  line.q0 = static_cast<Real>(from.q0);
  line.q1 = static_cast<Real>(from.q1);
  line.color = cast<Real>(from.color);
  line.r1 = static_cast<Real>(from.r1);
  line.r2 = static_cast<Real>(from.r2);
  line.opacity = static_cast<Real>(from.opacity);
  line.desaturation = static_cast<Real>(from.desaturation);
  line.mark = from.mark;
  line.perspective = from.perspective;
  line.moving = from.moving;
  line.phase = static_cast<Real>(from.phase);
  return line;
}

template <class Real>
struct Medium {
  bool drawn = false;
  Real rho = 0;
  Vec<Real> color{};
};

template <class Real>
class Renderer {
 public:
  explicit Renderer(const Scene& scene)
      : scene_(scene),
        view_(engine::reference::make_view(scene.camera)),
        picture_{scene.camera.width, scene.camera.height, {}},
        right_(cast<Real>(view_.right)),
        down_(cast<Real>(view_.down)),
        forward_(cast<Real>(view_.forward)),
        pixel_(static_cast<Real>(view_.pixel)) {
    const auto& c = scene.camera;
    const std::size_t pixels = static_cast<std::size_t>(c.width) * c.height;
    picture_.rgba.assign(4 * pixels, 0);
    transmittance_.assign(pixels, 1);
    if (!scene.body) return;
    for (int y = 0; y < c.height; ++y) {
      for (int x = 0; x < c.width; ++x) {
        body_.push_back(engine::reference::body_surface(*scene.body, view_, x + 0.5, y + 0.5));
        behind_.push_back(static_cast<Real>(1 - body_.back().opacity));
        farther_.insert(farther_.end(), 4, Real(0));
      }
    }
  }

  Picture<Real> run() {
    const std::vector<Group> groups = order_groups(scene_);
    const int major = major_axis(scene_);
    const int u = major == 0 ? 1 : 0;
    const int v = major == 2 ? 1 : 2;
    for (const Slab& slab : order_slabs(scene_, groups, major)) {
      const Group& group = groups[slab.group];
      std::array<int, 3> index{};
      index[major] = slab.position;
      each_brick(group.axis[v].order, [&](const int* v_first, const int* v_last) {
        each_brick(group.axis[u].order, [&](const int* u_first, const int* u_last) {
          for (const int* p = v_first; p != v_last; ++p) {
            for (const int* q = u_first; q != u_last; ++q) {
              index[v] = *p;
              index[u] = *q;
              kernel(group, index);
            }
          }
        });
      });
    }
    for (std::size_t i = 0; i < body_.size(); ++i) add_body(i);
    return std::move(picture_);
  }

 private:
  template <class Body>
  static void each_brick(const std::vector<int>& order, const Body& body) {
    const int* first = order.data();
    const int* const end = order.data() + order.size();
    while (first != end) {
      const int* last = first;
      while (last != end && *last / 8 == *first / 8) ++last;
      body(first, last);
      first = last;
    }
  }

  void kernel(const Group& group, const std::array<int, 3>& index) {
    position_ = engine::reference::make_kernel_position(
        scene_, view_,
        {group.axis[0].positions[index[0]], group.axis[1].positions[index[1]],
         group.axis[2].positions[index[2]]});
    if (!position_.has_cell) return;
    cell_ = cast<Real>(position_.cell);
    from_eye_ = cast<Real>(position_.from_eye);
    centre_ = cast<Real>(position_.centre);
    for (int a = 0; a < 3; ++a) inverse_[a] = cast<Real>(position_.inverse[a]);
    Line<Real> line;
    bool drawn = false;
    if (group.layers.lines != nullptr) {
      const auto ribbon =
          engine::reference::make_ribbon(scene_, view_, *group.layers.lines, position_);
      drawn = ribbon.has_value();
      if (drawn) line = cast<Real>(*ribbon);
    }
    Medium<Real> medium;
    const bool reaches = engine::reference::lies_beyond_near(view_, position_);
    if (!group.layers.media.empty() && reaches) medium = make_medium(group);
    near_ = view_.perspective && may_reach_near();
    if (drawn || medium.drawn) composite(drawn ? &line : nullptr, medium);
  }

  // Within twice the depth of its ellipsoid.
  [[nodiscard]] bool may_reach_near() const {
    double depth2 = 0;
    for (const auto& edge : position_.edge) {
      const double along = engine::reference::dot(view_.forward, edge);
      depth2 += along * along;
    }
    const double depth = engine::reference::footprint_t * std::sqrt(depth2);
    return position_.centre[2] - 2 * depth < view_.near;
  }

  // The part of a splat before the point u cells behind the middle of a ray at distance r.
  static Real part_before(Real r, Real u) {
    constexpr double t = engine::reference::footprint_t;
    const double b = static_cast<double>(r);
    const double half = b < t ? std::sqrt(t * t - b * b) : 0;
    if (static_cast<double>(u) <= -half) return 0;
    if (static_cast<double>(u) >= half) return 1;
    const auto at = [&](double v) { return truth::kernel(std::hypot(b, v)); };
    const double before = test::simpson(at, -half, static_cast<double>(u), 64);
    return static_cast<Real>(before / static_cast<double>(footprint(r)));
  }

  // A splat whose optical depth is below the tolerance of every layer, for all view directions, is
  // omitted.
  Medium<Real> make_medium(const Group& group) const {
    const auto density = engine::reference::make_density(scene_, group.layers.media, position_);
    if (density.rho <= 0) return {};
    double tolerance = 1e300;
    for (const auto* layer : group.layers.media) {
      tolerance = std::min(tolerance, layer->min_optical_depth);
    }
    double widest = 0;
    for (const auto& edge : position_.edge) widest = std::max(widest, std::sqrt(dot(edge, edge)));
    return {density.rho * widest / engine::reference::footprint_integral >= tolerance,
            static_cast<Real>(density.rho), cast<Real>(density.color)};
  }

  ScreenBox kernel_box(const Line<Real>* line, const Medium<Real>& medium) const {
    ScreenBox box{1e30, -1e30, 1e30, -1e30};
    if (medium.drawn) box = engine::reference::splat_box(view_, position_);
    if (line != nullptr) {
      box.x0 = std::min<double>(box.x0, std::min(line->x0, line->x1) - line->r2);
      box.x1 = std::max<double>(box.x1, std::max(line->x0, line->x1) + line->r2);
      box.y0 = std::min<double>(box.y0, std::min(line->y0, line->y1) - line->r2);
      box.y1 = std::max<double>(box.y1, std::max(line->y0, line->y1) + line->r2);
    }
    return box;
  }

  void composite(const Line<Real>* line, const Medium<Real>& medium) {
    const ScreenBox box = kernel_box(line, medium);
    const auto bound = [](double v, int size) {
      return static_cast<int>(std::clamp<double>(v, 0, size));
    };
    const int x0 = bound(std::floor(box.x0 - 1), picture_.width);
    const int x1 = bound(std::ceil(box.x1 + 1), picture_.width);
    const int y0 = bound(std::floor(box.y0 - 1), picture_.height);
    const int y1 = bound(std::ceil(box.y1 + 1), picture_.height);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) pixel(line, medium, x, y);
    }
  }

  static Real footprint(Real r) {
    const Real s = Real(0.48), t = Real(1.37);
    if (r < s) return 1 - r * r / (s * t);
    return r < t ? (t - r) * (t - r) / (t * (t - s)) : Real(0);
  }

  void pixel(const Line<Real>* line, const Medium<Real>& medium, int x, int y) {
    const Real X = (x + Real(0.5) - picture_.width / Real(2)) * pixel_;
    const Real Y = (y + Real(0.5) - picture_.height / Real(2)) * pixel_;
    Vec<Real> ray = forward_;  // forward component 1
    if (scene_.camera.perspective) {
      for (int a = 0; a < 3; ++a) ray[a] += X * right_[a] + Y * down_[a];
    }
    const Vec<Real> d = to_cells(ray);
    const Real cells = std::sqrt(dot(d, d));
    Real tau = 0;
    Real r = 0;
    // Splats that reach the near plane are divided exactly, others as if homogeneous over one cell.
    const bool cut = medium.drawn && near_;
    Real before = 0;            // part of the cell before the near plane
    Real closest = centre_[2];  // the view depth at which the ray is nearest to the sample
    if (medium.drawn) {
      // Origin of the ray: the eye in perspective projection, otherwise the pixel's point in the
      // eye's plane.
      Vec<Real> o{};
      for (int a = 0; a < 3; ++a) {
        Real from = from_eye_[a];
        if (!scene_.camera.perspective) from -= X * right_[a] + Y * down_[a];
        o[a] = from;
      }
      o = to_cells(o);
      const Vec<Real> c = cross(o, d);
      closest = dot(o, d) / dot(d, d);
      r = std::sqrt(dot(c, c)) / cells;
      tau = medium.rho * footprint(r) * std::sqrt(dot(ray, ray)) / (Real(1.4476982547) * cells);
      // The part in front of the near plane is excluded.
      const auto near = static_cast<Real>(scene_.camera.near);
      if (cut) {
        before = part_before(r, (near - closest) * cells);
        tau *= 1 - before;
      }
    }
    engine::reference::RibbonHit<Real> hit;
    if (line != nullptr) hit = hit_ribbon(*line, x + Real(0.5), y + Real(0.5));
    if (tau == 0 && hit.opacity == 0) return;
    // The part of the rest of the cell before a depth.
    const auto part_at = [&](Real depth) {
      const Real from_middle = (depth - closest) * cells;
      if (cut && before < 1) {
        return std::clamp((part_before(r, from_middle) - before) / (1 - before), Real(0), Real(1));
      }
      return std::clamp(Real(0.5) + from_middle, Real(0), Real(1));
    };
    const std::size_t index = static_cast<std::size_t>(y) * picture_.width + x;
    const Cell cell{tau, hit.opacity, part_at(hit.depth), medium.color, hit.color};
    if (body_.empty() || body_[index].opacity == 0) {
      return add(picture_.rgba.data() + 4 * index, cell, transmittance_[index]);
    }
    const auto depth = static_cast<Real>(body_[index].depth);
    divide(index, cell, medium.drawn ? part_at(depth) : 1, hit.depth < depth);
  }

  // A line of some opacity at `place` in a homogeneous cell.
  struct Cell {
    Real tau, opacity, place;
    Vec<Real> medium, line;
  };

  // The body lies at `part` of the cell: what is behind it shines through the rest of the pixel.
  void divide(std::size_t index, const Cell& cell, Real part, bool line_before) {
    Cell before = cell;
    before.tau = cell.tau * part;
    before.opacity = line_before ? cell.opacity : 0;
    before.place = part > 0 ? std::min(cell.place / part, Real(1)) : 0;
    add(picture_.rgba.data() + 4 * index, before, transmittance_[index]);
    Cell after = cell;
    after.tau = cell.tau * (1 - part);
    after.opacity = line_before ? 0 : cell.opacity;
    after.place = part < 1 ? std::max((cell.place - part) / (1 - part), Real(0)) : 0;
    add(farther_.data() + 4 * index, after, behind_[index]);
  }

  void add_body(std::size_t index) {
    const auto& body = body_[index];
    const Real front = transmittance_[index];
    Real* to = picture_.rgba.data() + 4 * index;
    for (int c = 0; c < 3; ++c) {
      to[c] += front * (static_cast<Real>(body.opacity * body.color[c]) + farther_[4 * index + c]);
    }
    to[3] = 1 - front * behind_[index];
  }

  Vec<Real> to_cells(const Vec<Real>& v) const {
    if (!scene_.lattice.places) return {v[0] / cell_[0], v[1] / cell_[1], v[2] / cell_[2]};
    return {dot(inverse_[0], v), dot(inverse_[1], v), dot(inverse_[2], v)};
  }

  // The three pieces of the paper composited in order: medium in front of the line, line, medium
  // behind it.
  void add_pieces(Real* to, Real absorbed, const Cell& cell, Real& t) {
    const Real alphas[3] = {cell.place * absorbed, cell.opacity, (1 - cell.place) * absorbed};
    const Vec<Real> colors[3] = {cell.medium, cell.line, cell.medium};
    if (cell.opacity == 0) return over(to, t, absorbed, cell.medium);
    for (int n = 0; n < 3; ++n) over(to, t, alphas[n], colors[n]);
  }

  static void over(Real* to, Real& t, Real alpha, const Vec<Real>& color) {
    for (int c = 0; c < 3; ++c) to[c] += t * alpha * color[c];
    to[3] += t * alpha;
    t *= 1 - alpha;
  }

  // A = -expm1(-tau) + a exp(-tau), I = c_s A + a exp(-tau x) (c_v - c_s), `over` front to back.
  // The other rules replace the second exponential with a chord or with nothing, or A with tau.
  void add(Real* to, const Cell& cell, Real& t) {
    const auto& [tau, opacity, place, medium, line] = cell;
    using scene::Compositing;
    const Compositing rule = scene_.compositing;
    const bool euler = rule == Compositing::cd_euler;
    const Real absorbed = euler ? std::min(tau, Real(1e6)) : -std::expm1(-tau);
    const Real transmitted = euler ? 1 - absorbed : std::exp(-tau);
    if (rule == Compositing::cd_naive) {
      return add_pieces(to, absorbed, cell, t);
    }
    Real before = std::exp(-tau * place);
    if (rule == Compositing::simple) before = transmitted;
    if (rule == Compositing::cd || euler) before = 1 - place * absorbed;
    const Real alpha = absorbed + opacity * transmitted;
    const Real own = opacity * before;
    for (int c = 0; c < 3; ++c) to[c] += t * (medium[c] * alpha + own * (line[c] - medium[c]));
    to[3] += t * alpha;
    t *= transmitted * (1 - opacity);
  }

  const Scene& scene_;
  View view_;
  Picture<Real> picture_;
  std::vector<Real> transmittance_;
  // With a body, by pixel: the body; the light from behind it; its transmittance and that of all
  // behind it.
  std::vector<engine::reference::Surface> body_;
  std::vector<Real> farther_;
  std::vector<Real> behind_;
  Vec<Real> right_{}, down_{}, forward_{};
  Real pixel_ = 1;
  // The current kernel.
  KernelPosition position_;
  bool near_ = false;  // its splat may reach the near plane
  Vec<Real> cell_{}, from_eye_{}, centre_{};
  std::array<Vec<Real>, 3> inverse_{};
};

}  // namespace

template <class Real>
Picture<Real> render(const scene::Scene& scene) {
  WINDSPLAT_CHECK((scene.level == std::array{0, 0, 0}));  // it draws no merged samples
  return Renderer<Real>(scene).run();
}

template Picture<double> render<double>(const scene::Scene& scene);
template Picture<float> render<float>(const scene::Scene& scene);

}  // namespace windsplat::naive
