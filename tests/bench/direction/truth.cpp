#include "tests/bench/direction/truth.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "server/engine/reference/kernels.hpp"

namespace windsplat::bench {
namespace {

namespace reference = engine::reference;
using reference::Ribbon;

Axis axis_of(const Ribbon& line) { return {line.x0, line.y0, line.x1, line.y1}; }

double length_of(const Axis& axis) { return std::hypot(axis.x1 - axis.x0, axis.y1 - axis.y0); }

// Which lines of a scene of plain lines can be seen, and where two of them cross.
class Finder {
 public:
  explicit Finder(const scene::Scene& scene)
      : scene_(scene),
        scale_(std::max(1.0, scene.camera.height / 720.0)),
        lines_(reference::list_kernels(scene, reference::make_view(scene.camera)).ribbons) {}

  Truth find() {
    constexpr std::size_t lines_tried = 500;
    Truth truth;
    const std::size_t every = std::max<std::size_t>(1, lines_.size() / lines_tried);
    for (std::size_t i = every / 2; i < lines_.size(); i += every) {
      if (length_of(axis_of(lines_[i])) < 6 || !is_inside(lines_[i]) || clear(i, false) < 0.5) {
        continue;
      }
      truth.lines.push_back({axis_of(lines_[i]), clear(i, true) > 0.6});
      add_crossings(i, truth);
    }
    return truth;
  }

 private:
  [[nodiscard]] bool is_inside(const Ribbon& line) const {
    const double right = scene_.camera.width;
    const double bottom = scene_.camera.height;
    return std::min(line.x0, line.x1) > 0 && std::max(line.x0, line.x1) < right &&
           std::min(line.y0, line.y1) > 0 && std::max(line.y0, line.y1) < bottom;
  }

  // The share of light that other lines, or those in front alone, let pass along a line.
  [[nodiscard]] double clear(std::size_t of, bool all) const {
    const Ribbon& line = lines_[of];
    double sum = 0;
    for (const double w : {0.1, 0.3, 0.5, 0.7, 0.9}) {
      const double x = line.x0 + w * (line.x1 - line.x0);
      const double y = line.y0 + w * (line.y1 - line.y0);
      const double depth = reference::hit_ribbon(line, x, y).depth;
      double left = 1;
      for (std::size_t n = 0; n < lines_.size() && left > 0.01; ++n) {
        if (n == of || !reaches(lines_[n], x, y)) continue;
        const auto hit = reference::hit_ribbon(lines_[n], x, y);
        if (all || hit.depth < depth) left *= 1 - hit.opacity;
      }
      sum += left / 5;
    }
    return sum;
  }

  static bool reaches(const Ribbon& line, double x, double y) {
    return x > std::min(line.x0, line.x1) - line.r2 && x < std::max(line.x0, line.x1) + line.r2 &&
           y > std::min(line.y0, line.y1) - line.r2 && y < std::max(line.y0, line.y1) + line.r2;
  }

  void add_crossings(std::size_t i, Truth& truth) const {
    const Axis a = axis_of(lines_[i]);
    const double room = 5.5 * scale_;  // along each line, on both sides
    for (std::size_t n = 0; n < lines_.size(); ++n) {
      const Axis b = axis_of(lines_[n]);
      const double ax = a.x1 - a.x0;
      const double ay = a.y1 - a.y0;
      const double bx = b.x1 - b.x0;
      const double by = b.y1 - b.y0;
      const double cross = ax * by - ay * bx;
      if (n == i || std::abs(cross) < 0.5 * length_of(a) * length_of(b)) continue;
      const double s = ((b.x0 - a.x0) * by - (b.y0 - a.y0) * bx) / cross;
      const double t = ((b.x0 - a.x0) * ay - (b.y0 - a.y0) * ax) / cross;
      const double s_least = room / length_of(a);
      const double t_least = room / length_of(b);
      if (!(s > s_least && s < 1 - s_least && t > t_least && t < 1 - t_least)) continue;
      add_crossing(i, n, a.x0 + s * ax, a.y0 + s * ay, truth);
    }
  }

  // If no other line covers the place before the farther one.
  void add_crossing(std::size_t i, std::size_t n, double x, double y, Truth& truth) const {
    const double di = reference::hit_ribbon(lines_[i], x, y).depth;
    const double dn = reference::hit_ribbon(lines_[n], x, y).depth;
    double left = 1;
    for (std::size_t k = 0; k < lines_.size(); ++k) {
      if (k == i || k == n || !reaches(lines_[k], x, y)) continue;
      const auto hit = reference::hit_ribbon(lines_[k], x, y);
      if (hit.depth < std::max(di, dn)) left *= 1 - hit.opacity;
    }
    if (left < 0.6 || di == dn) return;
    const Axis a = axis_of(lines_[i]);
    const Axis b = axis_of(lines_[n]);
    truth.crossings.push_back(di < dn ? Crossing{a, b, x, y} : Crossing{b, a, x, y});
  }

  const scene::Scene& scene_;
  double scale_;
  std::vector<Ribbon> lines_;
};

}  // namespace

Truth truth_of(const scene::Scene& scene) { return Finder(scene).find(); }

}  // namespace windsplat::bench
