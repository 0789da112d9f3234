// Views of a fixed sequence: some are calibrated, the others rendered at every setting and
// compared.
#include "server/study/calibration.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <random>
#include <utility>

#include "server/base/elapsed.hpp"
#include "server/engine/render.hpp"
#include "server/frame/difference.hpp"
#include "server/frame/measure.hpp"
#include "server/image/decode.hpp"
#include "server/image/jpeg_encoder.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/pick.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/place.hpp"
#include "server/study/metrics.hpp"
#include "server/study/sweep.hpp"

namespace windsplat::study {

namespace {

constexpr double density_factor = 10;
constexpr double thick_radius = 4;  // pixels at a height of 720
constexpr double zoom_least = 0.6;
constexpr double zoom_most = 4;
// Indices into the sequence. quality/laws.cpp was fitted to views before the first one.
constexpr std::uint64_t first_view = 100'000;
constexpr std::uint64_t views_per_variant = 1000;  // upper bound
constexpr std::array<double, 7> max_errors{0.1, 0.05, 0.03, 0.02, 0.01, 3e-3, 1e-3};
constexpr std::array<int, 5> qualities{40, 60, 75, 90, 95};
constexpr int learnt_quality = 90;

double uniform(std::mt19937_64& random, double low, double high) {
  const double share = static_cast<double>(random() >> 11U) * 0x1p-53;
  return low + share * (high - low);
}

// Errors of one view by setting; NaN where a setting is not allowed.
using SettingErrors = std::array<double, quality::settings_count>;

class Calibrator {
 public:
  Calibrator(const Subject& subject, const CalibrationPlan& plan, const Truth& truth,
             ThreadPool& pool, const CancelToken& cancel, const std::function<void(int)>& progress)
      : subject_(subject), truth_(truth), pool_(pool), cancel_(cancel), progress_(progress) {
    out_.plan = plan;
    for (const double error : max_errors) out_.aimed.push_back({error, 0, 0, 0, 0, 0});
  }

  Result<Calibration> run() {
    const auto start = std::chrono::steady_clock::now();
    const std::vector<Variant> variants = variants_of(subject_);
    for (variant_ = 0; variant_ < variants.size(); ++variant_) {
      out_.variants.push_back(variants[variant_].name);
      if (auto done = calibrate_variant(variants[variant_].view); !done) return done.error();
    }
    out_.seconds = seconds_since(start);
    return std::move(out_);
  }

 private:
  Result<void> calibrate_variant(const protocol::View& view) {
    const quality::SceneSignature signature = quality::signature_of(view);
    quality::Table table(signature.kind);
    for (int n = 0; n < out_.plan.calibrated + out_.plan.held_out; ++n) {
      if (cancel_.cancelled()) return make_error(ErrorKind::cancelled, "interrupted");
      auto seen =
          seen_from(view, *subject_.dataset,
                    first_view + views_per_variant * variant_ + static_cast<std::uint64_t>(n));
      if (!seen) return seen.error();
      protocol::View held = std::move(*seen);
      held.image.width = out_.plan.width;
      held.image.height = out_.plan.height;
      const auto done =
          n < out_.plan.calibrated
              ? calibrate(held, n == 0, table)
              : compare(held, static_cast<std::size_t>(n - out_.plan.calibrated), signature, table);
      if (!done) return done.error();
      if (progress_) progress_(++views_);
    }
    return {};
  }

  Result<void> calibrate(const protocol::View& view, bool first, quality::Table& table) {
    const auto completed = frame::complete(view, *subject_.dataset);
    if (!completed) return completed.error();
    auto done = frame::calibrate(*completed, *subject_.dataset, pool_, cancel_, workspace_,
                                 [&](const frame::CalibrationSample& found) {
                                   table.add(found.setting, found.viewpoint, found.measured);
                                 });
    if (!done || !first) return done;
    if (auto drawn = draw_measured(view); !drawn) return drawn.error();
    const auto jpeg = encoded(view, learnt_quality, image::Subsampling::s444);
    if (!jpeg) return jpeg.error();
    const auto error = image::encoding_error(workspace_.planes, *jpeg);
    if (!error) return error.error();
    table.add_encoding(learnt_quality, quality::viewpoint_of(view), *error);
    return {};
  }

  Result<void> compare(const protocol::View& view, std::size_t n,
                       const quality::SceneSignature& signature, const quality::Table& table) {
    Subject seen = subject_;
    seen.view = view;
    const auto truth = extrapolate(seen, pool_, cancel_);
    if (!truth) return truth.error();
    auto errors = setting_errors(view, truth->picture);
    if (!errors) return errors.error();
    const auto completed = frame::complete(view, *subject_.dataset);
    if (!completed) return completed.error();
    const quality::Viewpoint viewpoint = frame::viewpoint_of(*completed, *subject_.dataset);
    const quality::Forecasts forecasts = table.forecasts(viewpoint);
    for (std::size_t i = 0; i < errors->size(); ++i) {
      if (std::isnan((*errors)[i])) continue;
      out_.compared.push_back({variant_, n, i, (*errors)[i], forecasts[i],
                               quality::prior(signature.kind, quality::settings[i], viewpoint)});
    }
    aim(view, forecasts, *errors);
    for (const auto method : {protocol::MethodName::kernel, protocol::MethodName::slab}) {
      protocol::View own = view;
      own.method.name = method;
      if (auto done = draw_measured(own); !done) return done.error();
      if (!workspace_.drawn.error) continue;
      const double error =
          frame::difference_of(workspace_.space.image().rgba, truth->picture.rgba).rmse;
      out_.measured.push_back(
          {variant_, method == protocol::MethodName::slab, error, *workspace_.drawn.error});
    }
    if (auto done = compare_encodings(view, signature, table); !done) return done.error();
    return n == 0 && truth_ ? check_truth(view) : Result<void>();
  }

  Result<SettingErrors> setting_errors(const protocol::View& view, const Picture& truth) {
    const auto completed = frame::complete(view, *subject_.dataset);
    if (!completed) return completed.error();
    SettingErrors errors;
    errors.fill(std::nan(""));
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const quality::Setting& setting = quality::settings[i];
      if (!quality::is_allowed(setting, view)) continue;
      const auto at_setting = frame::at_setting(*completed, setting);
      if (!at_setting) return at_setting.error();
      const auto scene = scene::build_scene(*at_setting, *subject_.dataset);
      if (!scene) return scene.error();
      const auto drawn = engine::render(*scene, pool_, cancel_);
      if (!drawn) return drawn.error();
      const auto& [width, height, rgba] = drawn->image;
      errors[i] =
          frame::difference_of(resample(rgba, width, height, truth.width, truth.height), truth.rgba)
              .rmse;
    }
    return errors;
  }

  void aim(const protocol::View& view, const quality::Forecasts& forecasts,
           const SettingErrors& errors) {
    for (Aimed& aimed : out_.aimed) {
      protocol::View asked = view;
      asked.quality.max_error = aimed.max_error;
      const std::size_t chosen =
          quality::pick(asked, forecasts, {std::nullopt, aimed.max_error}).setting;
      const bool kept = errors[chosen] <= aimed.max_error;
      const bool promised = quality::error_bound(forecasts[chosen]) <= aimed.max_error;
      const bool possible = std::any_of(errors.begin(), errors.end(),
                                        [&](double error) { return error <= aimed.max_error; });
      ++aimed.frames;
      aimed.promised += promised ? 1 : 0;
      aimed.promised_kept += promised && kept ? 1 : 0;
      aimed.possible += possible ? 1 : 0;
      aimed.possible_kept += possible && kept ? 1 : 0;
    }
  }

  // Leaves the picture and its measured error in the workspace.
  Result<void> draw_measured(const protocol::View& view) {
    frame::Encoding encoding;
    encoding.format = frame::Format::npy;
    encoding.measure = true;
    const auto completed = frame::complete(view, *subject_.dataset);
    if (!completed) return completed.error();
    const auto prepared =
        frame::prepare(*completed, frame::own_setting(*completed), *subject_.dataset, encoding);
    if (!prepared) return prepared.error();
    return frame::draw(*prepared, *subject_.dataset, pool_, cancel_, workspace_);
  }

  // Encodes the workspace's picture; leaves its planes in the workspace.
  Result<image::Bytes> encoded(const protocol::View& view, int quality,
                               image::Subsampling subsampling) {
    const auto& [width, height, rgba] = workspace_.space.image();
    workspace_.planes.reset(view.image.width, view.image.height, subsampling,
                            workspace_.background);
    workspace_.planes.put({0, 0, width, height, rgba.data(), std::size_t{4} * width});
    image::Bytes bytes;
    auto done = workspace_.jpeg.encode(workspace_.planes, quality, pool_, bytes);
    if (!done) return done.error();
    return bytes;
  }

  Result<void> compare_encodings(const protocol::View& view,
                                 const quality::SceneSignature& signature,
                                 const quality::Table& table) {
    const auto& [width, height, rgba] = workspace_.space.image();
    const auto rgb = displayed(rgba, width, height, workspace_.background);
    const quality::Table untaught(signature.kind);
    const quality::Viewpoint viewpoint = quality::viewpoint_of(view);
    for (const auto subsampling : {image::Subsampling::s444, image::Subsampling::s420}) {
      for (const int quality : qualities) {
        const auto jpeg = encoded(view, quality, subsampling);
        if (!jpeg) return jpeg.error();
        const auto decoded = image::decode_jpeg(*jpeg, width, height);
        if (!decoded) return decoded.error();
        const bool full = subsampling == image::Subsampling::s444;
        out_.encodings.push_back({variant_, quality, full, linear_rmse(rgb, *decoded),
                                  table.encoding_error(quality, full, viewpoint),
                                  untaught.encoding_error(quality, full, viewpoint)});
      }
    }
    return {};
  }

  Result<void> check_truth(const protocol::View& view) {
    Subject seen = subject_;
    seen.view = view;
    seen.view.image = subject_.view.image;
    const auto made = extrapolate(seen, pool_, cancel_);
    if (!made) return made.error();
    const auto scene =
        scene_at(seen, {scene::Method::reference, scene::Compositing::analytic, own_knobs(seen)});
    if (!scene) return scene.error();
    const auto integral = truth_(*scene);
    if (!integral) return integral.error();
    out_.checks.push_back({variant_,
                           frame::difference_of(to_floats(made->picture), integral->rgba).rmse,
                           made->estimate});
    return {};
  }

  const Subject& subject_;
  const Truth& truth_;
  ThreadPool& pool_;
  const CancelToken& cancel_;
  const std::function<void(int)>& progress_;
  frame::Workspace workspace_;
  Calibration out_;
  std::size_t variant_ = 0;
  int views_ = 0;
};

struct Pair {
  double estimate = 0;
  double truth = 0;
  double bound = 0;
};

Agreement agreement_of(const std::vector<Pair>& pairs) {
  Agreement out;
  out.count = pairs.size();
  if (pairs.empty()) return out;
  std::vector<double> ratios;
  std::size_t within = 0;
  std::size_t bounded = 0;
  for (const Pair& pair : pairs) {
    const double truth = std::max(pair.truth, quality::error_least);
    const double ratio = std::max(pair.estimate, quality::error_least) / truth;
    ratios.push_back(ratio);
    within += ratio >= 0.5 && ratio <= 2 ? 1 : 0;
    bounded += truth <= std::max(pair.bound, quality::error_least) ? 1 : 0;
  }
  const auto share = [&](std::size_t n) {
    return static_cast<double>(n) / static_cast<double>(pairs.size());
  };
  out.within_two = share(within);
  out.bounded = share(bounded);
  out.median = median(std::move(ratios));
  return out;
}

}  // namespace

std::vector<Variant> variants_of(const Subject& subject) {
  const protocol::View& own = subject.view;
  const bool lines = own.vector.field.kind == protocol::FieldChoice::Kind::named;
  const bool medium = !own.scalars->empty();
  std::vector<Variant> variants{{"unchanged", own}};
  if (lines && medium) {
    variants.push_back({"lines only", own});
    variants.back().view.scalars->clear();
    variants.push_back({"medium only", own});
    variants.back().view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  }
  if (medium) {
    variants.push_back({"ten times as dense", own});
    for (protocol::ScalarView& layer : *variants.back().view.scalars) {
      for (auto& point : *layer.extinction) point[1] = std::min(density_factor * point[1], 1e30);
    }
  }
  if (lines) {
    variants.push_back({"thick lines", own});
    protocol::VectorView& vector = variants.back().view.vector;
    vector.r1 = thick_radius / 2;
    vector.r2 = thick_radius;
    *vector.length *= 2;
  }
  return variants;
}

Result<protocol::View> seen_from(const protocol::View& view, data::Dataset& dataset,
                                 std::uint64_t n) {
  const auto placed = scene::place_dataset(view.geometry, dataset);
  if (!placed) return placed.error();
  std::mt19937_64 random(n);
  const double azimuth = uniform(random, 0, 360);
  const double elevation = uniform(random, -20, 80);
  const double zoom = std::exp(uniform(random, std::log(zoom_least), std::log(zoom_most)));
  protocol::View out = view;
  scene::orbit(out, (*placed)->lattice, azimuth, elevation, zoom);
  return out;
}

CalibrationPlan calibration_plan(const Subject& subject, bool quick) {
  CalibrationPlan plan;
  plan.width = 2 * subject.view.image.width;
  plan.height = 2 * subject.view.image.height;
  if (quick) plan.held_out = 2;
  return plan;
}

Result<Calibration> calibrate(const Subject& subject, const CalibrationPlan& plan,
                              const Truth& truth, ThreadPool& pool, const CancelToken& cancel,
                              const std::function<void(int)>& progress) {
  return Calibrator(subject, plan, truth, pool, cancel, progress).run();
}

SettingClass class_of(const quality::Setting& setting) {
  const bool slab = setting.method == protocol::MethodName::slab;
  if (setting.coarser > 0) return slab ? SettingClass::slab_coarser : SettingClass::kernel_coarser;
  if (setting.half_level > 0) {
    return slab ? SettingClass::slab_smaller : SettingClass::kernel_smaller;
  }
  return slab ? SettingClass::slab : SettingClass::kernel;
}

const char* name_of(SettingClass kind) {
  switch (kind) {
    case SettingClass::kernel:
      return "kernel";
    case SettingClass::kernel_smaller:
      return "kernel, fewer pixels";
    case SettingClass::kernel_coarser:
      return "kernel, coarser data";
    case SettingClass::slab:
      return "slab";
    case SettingClass::slab_smaller:
      return "slab, fewer pixels";
    case SettingClass::slab_coarser:
      return "slab, coarser data";
  }
  return "";
}

Agreement agreement(const Calibration& calibration,
                    const std::function<bool(const Compared&)>& counts) {
  std::vector<Pair> pairs;
  for (const Compared& one : calibration.compared) {
    if (!counts(one)) continue;
    pairs.push_back({one.forecast.error, one.error, quality::error_bound(one.forecast)});
  }
  return agreement_of(pairs);
}

Agreement agreement(const Calibration& calibration) {
  return agreement(calibration, [](const Compared&) { return true; });
}

Agreement agreement_of_priors(const Calibration& calibration) {
  std::vector<Pair> pairs;
  for (const Compared& one : calibration.compared) {
    pairs.push_back({one.prior.error, one.error, quality::error_bound(one.prior)});
  }
  return agreement_of(pairs);
}

Agreement agreement_of_measured(const Calibration& calibration) {
  std::vector<Pair> pairs;
  for (const MeasuredFrame& one : calibration.measured) {
    pairs.push_back({one.measured, one.error, one.measured});
  }
  return agreement_of(pairs);
}

Agreement agreement_of_encodings(const Calibration& calibration) {
  std::vector<Pair> pairs;
  for (const ComparedEncoding& one : calibration.encodings) {
    pairs.push_back({one.forecast, one.error, one.forecast});
  }
  return agreement_of(pairs);
}

}  // namespace windsplat::study
