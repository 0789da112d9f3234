// Lines, splats and surfaces on the ray of a pixel -> their shares of its opacity -> the largest.
#include "server/frame/pick/pick.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/engine/reference/body.hpp"
#include "server/engine/reference/chains.hpp"
#include "server/engine/reference/profile.hpp"
#include "server/engine/reference/ray.hpp"
#include "server/frame/pick/kernels_near.hpp"
#include "server/frame/pick/surfaces_near.hpp"
#include "server/frame/ray_kernels.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

constexpr double lowest = std::numeric_limits<double>::lowest();
// Transmittance behind which nothing can contribute picked_least.
constexpr double hidden_below = 1e-4;
// A splat is divided into so many pieces, and where other splats begin or end.
constexpr int pieces_each = 8;
// Samples that may meet the pixel, about 150 bytes each.
constexpr std::size_t candidates_max = std::size_t{1} << 22U;

enum class Kind { line, splat, surface };

// What the ray meets.
struct Candidate {
  const reference::LayerGroup* group = nullptr;  // of a splat or a straight line
  Kind kind = Kind::splat;
  std::size_t surface = 0;
  std::array<int, 3> sample{};
  std::size_t index = 0;  // of the sample in a field
  Vec place{};            // world units
  std::array<double, 2> at{};
  double depth = 0;  // of a line or a surface
  double value = 0;  // of a line the magnitude
  // Opacity that it adds to the pixel, and this times its depth.
  double weight = 0;
  double moment = 0;
};

struct LineOnRay {
  double depth = 0;
  double opacity = 0;
  double light = 0;                      // its brightest channel, premultiplied
  std::optional<std::size_t> candidate;  // empty: the body
  bool solid = false;                    // the body or a surface
};

struct SplatStretch {
  SplatOnRay on;
  double from = 0, to = 0;  // view depths
  std::size_t candidate = 0;
};

// Projected; not called for samples behind the eye.
std::array<double, 2> projected(const reference::View& view, const Vec& centre) {
  const double scale = view.pixel * (view.perspective ? centre[2] : 1);
  return {view.half_width + centre[0] / scale, view.half_height + centre[1] / scale};
}

// Lines that are followed through the field in place of straight ones through the samples.
bool has_segments(const scene::Scene& scene) {
  return scene.vector && scene.vector->streamlets != nullptr;
}

double magnitude_at(const data::Volume& field, std::size_t index) {
  double square = 0;
  for (int c = 0; c < field.components; ++c) {
    square += std::pow(static_cast<double>(field.component(c)[index]), 2);
  }
  return std::sqrt(square);
}

class PixelLight {
 public:
  PixelLight(const scene::Scene& scene, double x, double y)
      : scene_(scene),
        view_(reference::make_view(scene.camera)),
        ray_(picture_ray(view_, std::floor(x) + 0.5, std::floor(y) + 0.5)),
        nearest_(view_.perspective ? view_.near : lowest) {}

  // False: cancelled.
  bool gather(const std::vector<reference::LayerGroup>& groups, const CancelToken& cancel) {
    for (const reference::LayerGroup& group : groups) {
      if (group.lines == nullptr && group.media.empty()) continue;
      const auto visit = [&](const reference::KernelPosition& position) { add(group, position); };
      if (!visit_near(scene_, view_, group, ray_, cancel, visit)) return false;
    }
    if (has_segments(scene_) && !gather_segments(cancel)) return false;
    if (scene_.body) {
      const auto body = reference::body_surface(*scene_.body, view_, ray_.x, ray_.y);
      if (body.opacity > 0) lines_.push_back({body.depth, body.opacity, 0, std::nullopt, true});
    }
    if (!gather_surfaces(cancel)) return false;
    if (scene_.vector && scene_.vector->combine_or) keep_strongest();
    std::stable_sort(lines_.begin(), lines_.end(),
                     [](const LineOnRay& a, const LineOnRay& b) { return a.depth < b.depth; });
    return true;
  }

  // Follows the ray; false: cancelled.
  bool pass(const CancelToken& cancel) {
    std::sort(splats_.begin(), splats_.end(),
              [](const SplatStretch& a, const SplatStretch& b) { return a.from < b.from; });
    const std::vector<double> cuts = divided();
    std::vector<const SplatStretch*> active;
    std::size_t next_splat = 0;
    std::size_t next_line = 0;
    for (std::size_t n = 0; n + 1 < cuts.size() && transmittance_ > hidden_below; ++n) {
      if (n % 1024 == 0 && cancel.cancelled()) return false;
      const double from = cuts[n];
      const double middle = 0.5 * (from + cuts[n + 1]);
      for (; next_line < lines_.size() && lines_[next_line].depth <= from; ++next_line) {
        cross(lines_[next_line]);
      }
      for (; next_splat < splats_.size() && splats_[next_splat].from <= middle; ++next_splat) {
        active.push_back(&splats_[next_splat]);
      }
      std::erase_if(active, [&](const SplatStretch* one) { return one->to <= middle; });
      absorb(active, middle, cuts[n + 1] - from);
    }
    for (; next_line < lines_.size(); ++next_line) cross(lines_[next_line]);
    return true;
  }

  [[nodiscard]] std::optional<Picked> strongest() const {
    Picked out;
    double most = picked_least;
    for (const Candidate& one : candidates_) {
      if (one.weight < most) continue;
      const auto [medium, part] = one.kind == Kind::splat ? strongest_medium(one) : Part{};
      if (one.weight * part < most) continue;
      most = one.weight * part;
      out.medium = medium;
      out.surface.reset();
      if (one.kind == Kind::surface) out.surface = one.surface;
      out.sample = one.sample;
      out.place = one.place;
      out.value = medium ? scene_.scalars[*medium].field->values[one.index] : one.value;
      out.share = std::min(1.0, most / (1 - transmittance_));  // rounding
      out.depth = one.moment / one.weight;
      out.at = one.at;
    }
    if (most <= picked_least) return std::nullopt;
    return out;
  }

  [[nodiscard]] bool is_full() const { return candidates_.size() >= candidates_max; }

 private:
  struct Part {
    std::optional<std::size_t> medium;
    double part = 1;  // of the extinction of the sample
  };

  void add(const reference::LayerGroup& group, const reference::KernelPosition& position) {
    if (candidates_.size() >= candidates_max) return;
    Candidate one;
    one.group = &group;
    one.sample = position.sample;
    one.index = position.index;
    one.place = reference::plus(position.from_eye, 1, view_.eye);
    if (group.lines != nullptr) add_line(position, one);
    if (group.media.empty() || !reference::lies_beyond_near(view_, position)) return;
    const auto density = reference::make_density(scene_, group.media, position);
    if (density.rho <= 0) return;
    const SplatOnRay on =
        splat_on_ray({position.from_eye, position.inverse, density.rho, density.color}, ray_);
    const double half = half_extent(on);
    if (on.tau <= 0 || on.middle + half <= nearest_) return;
    const bool behind_eye = view_.perspective && position.centre[2] <= view_.near;
    one.at = behind_eye ? std::array{ray_.x, ray_.y} : projected(view_, position.centre);
    splats_.push_back(
        {on, std::max(on.middle - half, nearest_), on.middle + half, candidates_.size()});
    candidates_.push_back(one);
  }

  void add_line(const reference::KernelPosition& position, Candidate one) {
    const auto line = reference::make_ribbon(scene_, view_, *one.group->lines, position);
    if (!line) return;
    const auto hit = reference::hit_ribbon(*line, ray_.x, ray_.y);
    if (hit.opacity <= 0) return;
    one.at = {0.5 * (line->x0 + line->x1), 0.5 * (line->y0 + line->y1)};
    const scene::VectorLayer& layer = *one.group->lines;
    one.value = magnitude_at(*layer.field, scene::vector_number(layer, scene_.lattice, one.sample));
    keep_line(hit, one);
  }

  void keep_line(const reference::RibbonHit<double>& hit, Candidate one) {
    one.kind = Kind::line;
    one.depth = hit.depth;
    const double light = std::max({hit.color[0], hit.color[1], hit.color[2]});
    lines_.push_back({hit.depth, hit.opacity, hit.opacity * light, candidates_.size(), false});
    candidates_.push_back(one);
  }

  // The segments of curved lines that the ray meets; false: cancelled.
  bool gather_segments(const CancelToken& cancel) {
    const scene::VectorLayer& layer = *scene_.vector;
    const trace::Segments& from = *layer.streamlets;
    const double wide = (scene::outer_radius(layer) + 1) * view_.pixel;
    // From the ray, to both sides of it along a plane of constant view depth, world units: a vertex
    // lies within this of it if a point of its segment covers the pixel.
    const double reach = from.longest * (1 + ray_.length);
    for (std::size_t v = 0; v + 1 < from.vertices(); ++v) {
      if (v % 65536 == 0 && cancel.cancelled()) return false;
      if (from.magnitudes[v] < 0) continue;
      if (candidates_.size() >= candidates_max) return true;
      Vec from_eye{};
      for (std::size_t a = 0; a < 3; ++a) {
        from_eye.at(a) = static_cast<double>(from.places[v].at(a)) - view_.eye.at(a);
      }
      const double depth = reference::dot(from_eye, view_.forward);
      const Vec aside =
          reference::plus(reference::plus(from_eye, -1, ray_.origin), -depth, ray_.direction);
      const double far = view_.perspective ? std::max(depth + from.longest, 0.0) : 1;
      if (reference::length(aside) > reach + wide * far) continue;
      add_segment(v);
    }
    return true;
  }

  void add_segment(std::size_t v) {
    const scene::VectorLayer& layer = *scene_.vector;
    const trace::Segments& from = *layer.streamlets;
    const auto line = reference::make_segment(scene_, view_, layer, v);
    if (!line) return;
    const auto hit = reference::hit_ribbon(*line, ray_.x, ray_.y);
    if (hit.opacity <= 0) return;
    const double ux = line->x1 - line->x0;
    const double uy = line->y1 - line->y0;
    const double along = (ray_.x - line->x0) * ux + (ray_.y - line->y0) * uy;
    const double part = std::clamp(along / std::max(ux * ux + uy * uy, 1e-12), 0.0, 1.0);
    Candidate one;
    one.index = from.samples[v];
    const auto columns = static_cast<std::size_t>(scene_.lattice.dims[0]);
    const auto rows = static_cast<std::size_t>(scene_.lattice.dims[1]);
    one.sample = {static_cast<int>(one.index % columns),
                  static_cast<int>(one.index / columns % rows),
                  static_cast<int>(one.index / columns / rows)};
    one.at = {line->x0 + part * ux, line->y0 + part * uy};
    one.place = place_at(one.at, hit.depth);
    one.value = static_cast<double>(from.magnitudes[v]) / from.magnitude_scale;
    keep_line(hit, one);
  }

  // World units.
  [[nodiscard]] Vec place_at(const std::array<double, 2>& at, double depth) const {
    const PictureRay to = picture_ray(view_, at[0], at[1]);
    return reference::plus(reference::plus(view_.eye, 1, to.origin), depth, to.direction);
  }

  bool gather_surfaces(const CancelToken& cancel) {
    for (const SheetOnRay& sheet : sheets_on_ray(scene_, view_, ray_, cancel)) {
      const double opacity = scene_.surfaces[sheet.surface].opacity;
      if (opacity <= 0 || candidates_.size() >= candidates_max) continue;
      Candidate one;
      one.kind = Kind::surface;
      one.surface = sheet.surface;
      one.at = {ray_.x, ray_.y};
      one.depth = sheet.depth;
      one.place = place_at(one.at, sheet.depth);
      one.value = sheet.value;
      lines_.push_back({sheet.depth, opacity, 0, candidates_.size(), true});
      candidates_.push_back(one);
    }
    return !cancel.cancelled();
  }

  // Lines that are combined by `or`, between the body or a surface and the next: one of them, which
  // gives the opacity of all, the brightest. Those before the first are before the medium.
  void keep_strongest() {
    std::vector<LineOnRay> solid;
    for (const LineOnRay& line : lines_) {
      if (line.solid) solid.push_back(line);
    }
    std::stable_sort(solid.begin(), solid.end(),
                     [](const LineOnRay& a, const LineOnRay& b) { return a.depth < b.depth; });
    std::vector<std::optional<LineOnRay>> kept(solid.size() + 1);
    for (const LineOnRay& line : lines_) {
      if (line.solid) continue;
      std::size_t before = 0;
      while (before < solid.size() && solid[before].depth <= line.depth) ++before;
      auto& best = kept[before];
      const double opacity = best ? std::max(best->opacity, line.opacity) : line.opacity;
      if (!best || line.light > best->light) best = line;
      best->opacity = opacity;
    }
    lines_.clear();
    for (std::size_t n = 0; n < kept.size(); ++n) {
      if (kept[n]) {
        kept[n]->depth = n == 0 ? lowest : solid[n - 1].depth;
        lines_.push_back(*kept[n]);
      }
      if (n < solid.size()) lines_.push_back(solid[n]);
    }
  }

  // Depths between which the extinction is smooth, ascending.
  [[nodiscard]] std::vector<double> divided() const {
    std::vector<double> cuts;
    cuts.reserve(splats_.size() * (pieces_each + 1) + lines_.size());
    for (const SplatStretch& one : splats_) {
      for (int n = 0; n <= pieces_each; ++n) {
        cuts.push_back(one.from + (one.to - one.from) * n / pieces_each);
      }
    }
    for (const LineOnRay& line : lines_) {
      if (!splats_.empty() && line.depth > splats_.front().from) cuts.push_back(line.depth);
    }
    std::sort(cuts.begin(), cuts.end());
    return cuts;
  }

  void cross(const LineOnRay& line) {
    const double seen = transmittance_ * line.opacity;
    transmittance_ -= seen;
    if (!line.candidate) return;
    Candidate& one = candidates_[*line.candidate];
    one.weight += seen;
    one.moment += seen * one.depth;
  }

  // The extinction in the middle of a piece is that of the piece.
  void absorb(const std::vector<const SplatStretch*>& active, double middle, double length) {
    static const reference::Profile profile;
    if (length <= 0) return;
    std::vector<double>& parts = parts_;
    parts.clear();
    double tau = 0;
    for (const SplatStretch* one : active) {
      const double z = middle - one->on.middle;
      parts.push_back(length * one->on.rho * profile(one->on.least2 + one->on.cells2 * z * z));
      tau += parts.back();
    }
    if (tau <= 0) return;
    const double absorbed = -std::expm1(-tau) * transmittance_;
    for (std::size_t n = 0; n < active.size(); ++n) {
      Candidate& one = candidates_[active[n]->candidate];
      one.weight += absorbed * parts[n] / tau;
      one.moment += absorbed * parts[n] / tau * middle;
    }
    transmittance_ -= absorbed;
  }

  [[nodiscard]] Part strongest_medium(const Candidate& one) const {
    Part out{std::nullopt, 0};
    double all = 0;
    for (const scene::ScalarLayer* layer : one.group->media) {
      const auto value = static_cast<double>(layer->field->values[one.index]);
      const double rho = extinction_at(*layer, value);
      all += rho;
      if (rho <= out.part) continue;
      out = {static_cast<std::size_t>(layer - scene_.scalars.data()), rho};
    }
    out.part /= all;
    return out;
  }

  const scene::Scene& scene_;
  const reference::View view_;
  const PictureRay ray_;
  const double nearest_;
  std::vector<Candidate> candidates_;
  std::vector<LineOnRay> lines_;
  std::vector<SplatStretch> splats_;
  std::vector<double> parts_;  // of the splats of a piece
  double transmittance_ = 1;
};

}  // namespace

Result<std::optional<Picked>> pick(const scene::Scene& scene, double x, double y,
                                   const CancelToken& cancel) {
  std::vector<reference::LayerGroup> groups = reference::group_layers(scene);
  if (has_segments(scene)) {
    for (reference::LayerGroup& group : groups) group.lines = nullptr;
  }
  PixelLight light(scene, x, y);
  const bool gathered = light.gather(groups, cancel);
  if (light.is_full()) {
    return make_error(ErrorKind::too_large, "more than " + std::to_string(candidates_max) +
                                                " samples meet the pixel: look from nearer");
  }
  if (!gathered || !light.pass(cancel)) {
    return make_error(ErrorKind::cancelled, "request cancelled");
  }
  return light.strongest();
}

}  // namespace windsplat::frame
