// Places in the picture -> rays -> differences of their light.
#include "server/frame/pixel_trials.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "server/frame/ray_kernels.hpp"
#include "server/frame/ray_light.hpp"
#include "server/frame/ray_places.hpp"

namespace windsplat::frame {
namespace {

namespace reference = engine::reference;

// Places over the picture, of which some are tried, evenly at any time: until the standard error of
// the mean square is this share of it, which is half as much of the error, or they are too many.
constexpr int tried_least = 64;
constexpr double told_share = 0.35;
// The same for the change by what tolerances leave out.
constexpr double skipped_share = 0.1;
// Errors that are surely less than the least one that is reported need not be known.
constexpr int tried_for_none = 256;
constexpr double none_below = 1e-10;

// Mean of what was found at places.
class MeanOf {
 public:
  void add(double value) {
    ++count_;
    sum_ += value;
    squares_ += value * value;
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] double mean() const { return count_ > 0 ? sum_ / count_ : 0; }
  [[nodiscard]] double standard_error() const {
    if (count_ < 2) return mean();
    return std::sqrt(std::max(0.0, squares_ / count_ - mean() * mean()) / (count_ - 1));
  }
  // Whether the standard error is less than a share of it.
  [[nodiscard]] bool is_within(double share, int least) const {
    return count_ >= least && standard_error() < share * mean();
  }
  [[nodiscard]] bool is_told() const {
    if (is_within(told_share, tried_least)) return true;
    return count_ >= tried_for_none && mean() + 3 * standard_error() < none_below;
  }

 private:
  int count_ = 0;
  double sum_ = 0;
  double squares_ = 0;
};

struct Squares {
  double kernel = 0;
  double slab = 0;
  double half = 0;
  double stop = 0;
};

class TryingPixels {
 public:
  TryingPixels(const scene::Scene& scene, RayGround& ground, const CancelToken& cancel)
      : scene_(scene), cancel_(cancel), kernels_(scene), light_(scene, ground) {}

  // Few places may have most of the error, and sooner too few than too many of them are met: the
  // standard error is added.
  // Nothing if too few places can be tried for their work, or if it is not known where.
  PixelTrials run(const Spread& spread) {
    MeanOf kernel;
    MeanOf slab;
    MeanOf half;
    MeanOf stop;
    PixelTrials out;
    if (spread.empty) out.trials.emplace();
    if (spread.empty || spread.places.empty()) return out;
    for (std::uint32_t n = 0; n < places_count; ++n) {
      if (kernel.is_told() && (scene_.scalars.empty() || slab.is_told())) break;
      if (cancel_.cancelled()) return {};
      if (out.places == trial_places_most || work() > trial_work_most) break;
      const Place& place = spread.nth(n);
      Squares here;
      if (place.inside && kernels_.meets(place.near, ray(place.x + 0.5, place.y + 0.5))) {
        const auto differences = differences_at(place);
        if (!differences) continue;
        here = *differences;
        ++out.places;
      }
      kernel.add(here.kernel);
      slab.add(here.slab);
      half.add(here.half);
      stop.add(here.stop);
    }
    out.work = work();
    const bool told = kernel.count() >= tried_least && (kernel.is_told() || kernel.mean() > 0);
    if (!told) return out;
    const double pixels = static_cast<double>(scene_.camera.width) * scene_.camera.height;
    const auto error = [&](const MeanOf& of) {
      return std::sqrt(spread.area / pixels * (of.mean() + of.standard_error()));
    };
    // In n pieces of a slab a method of order 2 lacks 1 / n^2 of its error: of quarters a
    // sixteenth, of two pieces of half a slab a quarter.
    const auto of_pieces = [](double n) { return n * n / (n * n - 1); };
    const double n = light_.pieces_of_slab();
    out.trials = {error(kernel), error(slab) * of_pieces(n), error(half) * of_pieces(0.5 * n),
                  light_.thinnest(), error(stop)};
    return out;
  }

 private:
  [[nodiscard]] double work() const { return kernels_.visited() + met_; }
  [[nodiscard]] PictureRay ray(double x, double y) const {
    return picture_ray(kernels_.view(), x, y);
  }

  // Nothing if the pixels meet too many kernels or slabs.
  std::optional<Squares> differences_at(const Place& place) {
    // Errors of lines are in few pixels, those of a medium in many.
    take_block(scene_.camera, kernels_.view(), place, scene_.scalars.empty(), rays_);
    const double wide = scene_.vector ? scene::outer_radius(*scene_.vector) : 0;
    const RayKernelList* const around = kernels_.around(place.near, rays_, wide);
    if (around == nullptr) return std::nullopt;
    const RayKernelList& found = *around;
    const auto count = static_cast<double>(rays_.size());
    met_ += count * static_cast<double>(found.size());
    Squares out;
    ends_.clear();
    for (const PictureRay& one : rays_) {
      const Light drawn = light_.by_kernels(found, one);
      const RayLight::ByDepth by_depth = light_.by_depth(found, one);
      if (!by_depth.known) return std::nullopt;
      out.kernel += square_difference(drawn, by_depth.exact) / count;
      out.slab += square_difference(by_depth.slabs, by_depth.exact) / count;
      out.half += square_difference(by_depth.halves, by_depth.exact) / count;
      ends_.push_back({by_depth.exact, by_depth.end});
    }
    out.stop = lost_behind();
    return out;
  }

  // The rays of a block end together, once no more than the stop is left of any. Behind it the
  // light is taken to be what it is on the whole ray. Mean of squares.
  [[nodiscard]] double lost_behind() const {
    std::int64_t last = std::numeric_limits<std::int64_t>::min();
    for (const auto& [exact, end] : ends_) {
      if (end.left.empty()) return 0;
      last = std::max(last, end.piece);
    }
    double sum = 0;
    for (const auto& [exact, end] : ends_) {
      const auto behind = static_cast<std::size_t>(last - end.piece);
      const double left = end.left[std::min(behind, end.left.size() - 1)];
      const double lost = std::max(0.0, left - exact.transmittance) / exact.alpha;
      sum += lost * lost * square_difference(exact, {});
    }
    return sum / static_cast<double>(ends_.size());
  }

  const scene::Scene& scene_;
  const CancelToken& cancel_;
  RayKernels kernels_;
  RayLight light_;
  std::vector<PictureRay> rays_;
  std::vector<std::pair<Light, RayLight::End>> ends_;  // of these rays
  double met_ = 0;                                     // kernels by each ray
};

// Those of the drawn scene: splats of several layers are left out below the least one.
Tolerances tolerances_of(const scene::Scene& scene) {
  Tolerances out;
  if (scene.vector) out.magnitude = scene.vector->min_magnitude;
  if (!scene.scalars.empty()) out.optical_depth = std::numeric_limits<double>::max();
  for (const scene::ScalarLayer& layer : scene.scalars) {
    out.optical_depth = std::min(out.optical_depth, layer.min_optical_depth);
  }
  return out;
}

class TryingSkipped {
 public:
  TryingSkipped(const scene::Scene& scene, RayGround& ground, const CancelToken& cancel)
      : scene_(without_tolerances(scene)),
        cancel_(cancel),
        kernels_(scene_, tolerances_of(scene)),
        light_(scene_, ground) {}

  std::optional<double> run(const Spread& spread) {
    if (spread.empty) return 0.0;
    if (spread.places.empty()) return std::nullopt;
    MeanOf change;
    for (std::uint32_t n = 0; n < places_count; ++n) {
      if (cancel_.cancelled()) return std::nullopt;
      if (change.count() == trial_places_most || kernels_.visited() + met_ > skipped_work_most) {
        break;
      }
      const auto here = change_at(spread.nth(n));
      if (here) change.add(*here);
      if (change.is_within(skipped_share, tried_least)) break;
    }
    if (change.count() < tried_least) return std::nullopt;
    const double pixels = static_cast<double>(scene_.camera.width) * scene_.camera.height;
    return std::min(1.0, spread.area / pixels) * change.mean();
  }

 private:
  // Nothing if its pixels meet too many kernels.
  std::optional<double> change_at(const Place& place) {
    const PictureRay middle = picture_ray(kernels_.view(), place.x + 0.5, place.y + 0.5);
    if (!place.inside || !kernels_.meets(place.near, middle)) return 0.0;
    take_block(scene_.camera, kernels_.view(), place, false, rays_);
    const double wide = scene_.vector ? scene::outer_radius(*scene_.vector) : 0;
    const RayKernelList* const found = kernels_.around(place.near, rays_, wide);
    if (found == nullptr) return std::nullopt;
    met_ += static_cast<double>(rays_.size()) * static_cast<double>(found->size());
    double sum = 0;
    for (const PictureRay& ray : rays_) {
      const Light whole = light_.by_kernels(*found, ray);
      const Light drawn = light_.by_kernels(*found, ray, true);
      double most = std::abs(whole.alpha - drawn.alpha);
      for (std::size_t c = 0; c < 3; ++c) {
        most = std::max(most, std::abs(whole.rgb[c] - drawn.rgb[c]));
      }
      sum += most;
    }
    return sum / static_cast<double>(rays_.size());
  }

  const scene::Scene scene_;  // with every line and splat
  const CancelToken& cancel_;
  RayKernels kernels_;
  RayLight light_;
  std::vector<PictureRay> rays_;
  double met_ = 0;  // kernels by each ray
};

}  // namespace

scene::Scene without_tolerances(scene::Scene scene) {
  if (scene.vector) scene.vector->min_magnitude = 0;
  for (scene::ScalarLayer& layer : scene.scalars) layer.min_optical_depth = 0;
  return scene;
}

PixelTrials pixel_trials(const scene::Scene& scene, const std::vector<RayThrough>& through,
                         const CancelToken& cancel) {
  if (!scene.surfaces.empty()) return {};  // which the rays of the trials do not meet
  const RayKernels kernels(scene);
  const Spread spread = spread_places(kernels, through);
  RayGround ground(scene);  // the same without tolerances
  PixelTrials out = TryingPixels(scene, ground, cancel).run(spread);
  const Tolerances skipped = tolerances_of(scene);
  const bool untraced = scene.vector && scene.vector->streamlets && skipped.magnitude > 0;
  if (!untraced) {
    out.skipped_change = skipped.magnitude > 0 || skipped.optical_depth > 0
                             ? TryingSkipped(scene, ground, cancel).run(spread)
                             : 0.0;
  }
  out.grounds = ground.computed();
  return out;
}

}  // namespace windsplat::frame
