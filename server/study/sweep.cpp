// Settings of the sweep, and their measurement against the reference.
#include "server/study/sweep.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "server/base/check.hpp"
#include "server/frame/difference.hpp"
#include "server/image/decode.hpp"
#include "server/image/encode.hpp"
#include "server/study/metrics.hpp"

namespace windsplat::study {

namespace {

using scene::Compositing;
using scene::Method;

class Planner {
 public:
  explicit Planner(const Knobs& own) : own_(own) {}

  // A curve from the subject's own parameters with one of them changed.
  template <class T>
  void curve(Method method, Compositing compositing, Knob knob, T Knobs::*member,
             const std::vector<T>& values) {
    Curve curve;
    curve.method = method;
    curve.compositing = compositing;
    curve.knob = knob;
    for (const T value : values) {
      Setting setting{method, compositing, own_};
      setting.knobs.*member = value;
      const std::size_t at = index_of(setting);
      if (std::find(curve.points.begin(), curve.points.end(), at) == curve.points.end()) {
        curve.points.push_back(at);
      }
    }
    sweep.curves.push_back(std::move(curve));
  }

  Sweep sweep;

 private:
  std::size_t index_of(const Setting& setting) {
    const auto at = std::find(sweep.settings.begin(), sweep.settings.end(), setting);
    if (at != sweep.settings.end()) {
      return static_cast<std::size_t>(at - sweep.settings.begin());
    }
    sweep.settings.push_back(setting);
    return sweep.settings.size() - 1;
  }

  Knobs own_;
};

double milliseconds(std::chrono::steady_clock::duration took) {
  return std::chrono::duration<double, std::milli>(took).count();
}

}  // namespace

Sweep plan_sweep(const Subject& subject, bool quick) {
  const Knobs own = own_knobs(subject);
  const bool lines = subject.view.vector.field.kind == protocol::FieldChoice::Kind::named;
  const bool medium = !subject.view.scalars->empty();
  const std::size_t kinds = medium ? compositings.size() : 1;
  const int n = own.stride;
  Planner planner(own);
  const std::vector<int> strides = quick ? std::vector{n, 2 * n} : std::vector{n, 2 * n, 3 * n};
  for (std::size_t i = 0; i < kinds; ++i) {
    const bool all = i == 0 || !quick;
    planner.curve(Method::kernel, compositings[i], Knob::stride, &Knobs::stride,
                  all ? strides : std::vector{n});
  }
  for (std::size_t i = 0; i < (quick ? 1 : kinds); ++i) {
    planner.curve(Method::slab, compositings[i], Knob::slab_thickness, &Knobs::slab_thickness,
                  {2.0, 1.0, 0.5, 0.25});
  }
  planner.curve(Method::slab, Compositing::analytic, Knob::stride, &Knobs::stride, strides);
  for (const Method method : {Method::kernel, Method::slab}) {
    const int w = own.width;
    planner.curve(
        method, Compositing::analytic, Knob::width, &Knobs::width,
        quick ? std::vector{std::max(1, w / 2), w}
              : std::vector{std::max(1, w / 4), std::max(1, w / 2), std::max(1, 3 * w / 4), w});
    if (quick) continue;
    planner.curve(method, Compositing::analytic, Knob::stop_transmittance,
                  &Knobs::stop_transmittance, {0.1, 0.02, 2e-3, 1.5e-4, 0.0});
    if (!lines) continue;
    planner.curve(method, Compositing::analytic, Knob::span, &Knobs::span, {1.0, 2.0, 4.0, 7.0});
  }
  return std::move(planner.sweep);
}

Result<engine::Image> draw(const Subject& subject, const Setting& setting, ThreadPool& pool,
                           const CancelToken& cancel) {
  const auto scene = scene_at(subject, setting);
  if (!scene) return scene.error();
  auto rendered = engine::render(*scene, pool, cancel);
  if (!rendered) return rendered.error();
  return std::move(rendered->image);
}

Result<Measurement> measure(const Subject& subject, const Setting& setting, const Picture& truth,
                            ThreadPool& pool, const CancelToken& cancel, int runs) {
  using Clock = std::chrono::steady_clock;
  const auto scene = scene_at(subject, setting);
  if (!scene) return scene.error();
  auto rendered = engine::render(*scene, pool, cancel);
  if (!rendered) return rendered.error();
  std::vector<double> times;
  for (int run = 0; run < runs; ++run) {
    const Clock::time_point start = Clock::now();
    const auto again = engine::render(*scene, pool, cancel);
    times.push_back(milliseconds(Clock::now() - start));
    if (!again) return again.error();
  }
  const engine::Image& image = rendered->image;
  const std::vector<float> rgba =
      resample(image.rgba, image.width, image.height, truth.width, truth.height);

  Measurement out;
  const frame::Difference apart = frame::difference_of(rgba, truth.rgba);
  out.rmse = apart.rmse;
  out.max = apart.max;
  out.psnr = apart.psnr;
  out.flip = mean_flip(displayed(to_floats(truth), truth.width, truth.height, scene->background),
                       displayed(rgba, truth.width, truth.height, scene->background), truth.width,
                       truth.height);
  out.ms = median(times);
  out.ms_min = *std::min_element(times.begin(), times.end());
  out.ms_max = *std::max_element(times.begin(), times.end());
  out.stable = within_unit(image.rgba, unit_slack);
  return out;
}

std::vector<std::uint8_t> displayed(std::span<const float> rgba, int width, int height,
                                    const std::array<float, 3>& background) {
  return image::tone_map(rgba, width, height, background);
}

std::vector<float> to_floats(const Picture& picture) {
  return {picture.rgba.begin(), picture.rgba.end()};
}

Result<Extrapolated> extrapolate(const Subject& subject, ThreadPool& pool,
                                 const CancelToken& cancel) {
  Setting setting{Method::slab, Compositing::analytic, own_knobs(subject)};
  setting.knobs.stop_transmittance = 0;
  setting.knobs.slab_thickness = 0.25;
  const auto coarse = draw(subject, setting, pool, cancel);
  if (!coarse) return coarse.error();
  setting.knobs.slab_thickness = 0.125;
  const auto fine = draw(subject, setting, pool, cancel);
  if (!fine) return fine.error();
  Extrapolated out;
  out.picture.width = fine->width;
  out.picture.height = fine->height;
  double squares = 0;
  for (std::size_t i = 0; i < fine->rgba.size(); ++i) {
    const double term = (static_cast<double>(fine->rgba[i]) - coarse->rgba[i]) / 3;
    out.picture.rgba.push_back(fine->rgba[i] + term);
    squares += term * term;
  }
  out.estimate = std::sqrt(squares / static_cast<double>(fine->rgba.size()));
  return out;
}

Result<std::vector<Encoded>> measure_encoding(const Subject& subject, ThreadPool& pool,
                                              const CancelToken& cancel) {
  const Setting setting{Method::kernel, Compositing::analytic, own_knobs(subject)};
  const auto scene = scene_at(subject, setting);
  if (!scene) return scene.error();
  const auto rendered = engine::render(*scene, pool, cancel);
  if (!rendered) return rendered.error();
  const auto& [width, height, rgba] = rendered->image;
  const auto rgb = displayed(rgba, width, height, scene->background);
  std::vector<Encoded> all;
  for (const int quality : {40, 60, 80, 90, 95, 99}) {
    const auto jpeg = image::encode_jpeg(rgb, width, height, quality, image::Subsampling::s444);
    if (!jpeg) return jpeg.error();
    const auto decoded = image::decode_jpeg(*jpeg, width, height);
    if (!decoded) return decoded.error();
    Encoded encoded;
    encoded.quality = quality;
    encoded.rmse = linear_rmse(rgb, *decoded);
    encoded.psnr = frame::psnr_of(encoded.rmse);
    encoded.flip = mean_flip(rgb, *decoded, width, height);
    encoded.bytes = jpeg->size();
    all.push_back(encoded);
  }
  return all;
}

}  // namespace windsplat::study
