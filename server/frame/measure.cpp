// Draws pictures twice and computes the RMS of the difference.
#include "server/frame/measure.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <mutex>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "server/base/trim_storage.hpp"
#include "server/engine/plan.hpp"
#include "server/frame/content.hpp"
#include "server/frame/pixel_trials.hpp"
#include "server/quality/laws.hpp"
#include "server/scene/build.hpp"

namespace windsplat::frame {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t channels = 4;

double samples_of(const scene::Lattice& lattice) {
  if (lattice.part) return static_cast<double>(lattice.part->samples());
  double samples = 1;
  for (const int n : lattice.dims) samples *= n;
  return samples;
}

// Whether the thickness of slabs is most of the error: pictures drawn with thinner ones approach
// the reference but for what is lost where rays end, at most this transmittance.
bool is_exact(const scene::Scene& scene) {
  constexpr double usual_stop = 1.5e-4;
  return scene.compositing == scene::Compositing::analytic &&
         scene.stop_transmittance <= usual_stop;
}

// Thickness of slabs in cells of which the error is known to be of second order: half of the
// view's, and no more than half a cell. Thicker slabs may hide structure together with those of
// twice their thickness, so that the difference of the two tells nothing.
double reference_thickness(const scene::CompletedView& completed) {
  return 0.5 * std::min(completed.view().method.slab_thickness, 1.0);
}

// The view with analytic slabs of a thickness, from every sample if possible. The second value:
// whether every sample is used.
Result<std::pair<scene::Scene, bool>> finer_scene(const scene::CompletedView& completed,
                                                  data::Dataset& dataset, double thickness,
                                                  double samples_max) {
  const auto finer = completed.coarsened(0).with([&](protocol::View& view) {
    protocol::MethodView& method = view.method;
    method.name = protocol::MethodName::slab;
    method.compositing = protocol::Compositing::analytic;
    method.stop_transmittance = std::min(method.stop_transmittance, quality::stop_of_the_truth);
    method.slab_thickness = thickness;
  });
  if (!finer) return finer.error();
  const bool few = samples_of(completed.lattice()) <= samples_max;
  if (few) {
    const auto full =
        finer->with([](protocol::View& view) { view.method.detail = protocol::Detail::full; });
    if (!full) return full.error();
    auto scene = scene::build_scene(*full, dataset);
    if (scene) return std::pair{std::move(*scene), true};
    if (scene.error().kind != ErrorKind::not_resident) return scene.error();
  }
  auto scene = scene::build_scene(*finer, dataset);
  if (!scene) return scene.error();
  const bool every = scene->level == std::array<int, 3>{0, 0, 0};
  return std::pair{std::move(*scene), every};
}

// Calls value(index in the picture, float) for every value of a part.
template <class Value>
void each_value(const engine::TilePixels& tile, int width, const Value& value) {
  for (int y = 0; y < tile.height; ++y) {
    const float* from = tile.rgba + static_cast<std::size_t>(y) * tile.stride;
    std::size_t at =
        channels * (static_cast<std::size_t>(tile.y + y) * static_cast<std::size_t>(width) +
                    static_cast<std::size_t>(tile.x));
    for (std::size_t i = 0; i < channels * static_cast<std::size_t>(tile.width); ++i) {
      value(at++, from[i]);
    }
  }
}

// Sums over the parts of a picture, which threads deliver in any order. They are added in the order
// of the parts, so that the total has the same bits for any number of threads.
class PartSums {
 public:
  void add(const engine::TilePixels& part, double sum) {
    const std::lock_guard lock(mutex_);
    sums_.emplace_back(part.y, part.x, sum);
  }
  [[nodiscard]] double total() {
    std::sort(sums_.begin(), sums_.end());
    double total = 0;
    for (const auto& [y, x, sum] : sums_) total += sum;
    return total;
  }

 private:
  std::mutex mutex_;
  std::vector<std::tuple<int, int, double>> sums_;  // row and column of the part
};

double rms(const std::vector<float>& values) {
  double squares = 0;
  for (const float v : values) squares += static_cast<double>(v) * v;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

// RMS of the difference between the reference and a picture resampled to its size: bilinear between
// pixel centres, as displayed by the page.
double apart(const engine::Image& picture, const std::vector<float>& truth, int width, int height,
             ThreadPool& pool) {
  struct Tap {
    std::size_t low, high;
    float weight;
  };
  const auto taps = [](int from, int to) {
    std::vector<Tap> out;
    for (int i = 0; i < to; ++i) {
      const double at = std::clamp((i + 0.5) * from / to - 0.5, 0.0, from - 1.0);
      const auto low = static_cast<std::size_t>(at);
      out.push_back({low, std::min(low + 1, static_cast<std::size_t>(from) - 1),
                     static_cast<float>(at - static_cast<double>(low))});
    }
    return out;
  };
  const std::vector<Tap> columns = taps(picture.width, width);
  const std::vector<Tap> rows = taps(picture.height, height);
  std::vector<double> squares(rows.size());
  const std::size_t stride = channels * static_cast<std::size_t>(picture.width);
  pool.run(rows.size(), [&](std::size_t y, unsigned) {
    const float* const above = picture.rgba.data() + rows[y].low * stride;
    const float* const below = picture.rgba.data() + rows[y].high * stride;
    const float* to = truth.data() + channels * y * static_cast<std::size_t>(width);
    double sum = 0;
    for (const Tap& x : columns) {
      for (std::size_t c = 0; c < channels; ++c) {
        const auto along = [&](const float* row) {
          const float low = row[channels * x.low + c];
          return low + x.weight * (row[channels * x.high + c] - low);
        };
        const float top = along(above);
        const double d = top + rows[y].weight * (along(below) - top) - *to++;
        sum += d * d;
      }
    }
    squares[y] = sum;
  });
  double sum = 0;
  for (const double row : squares) sum += row;
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

// The reference of a view, and the errors of the two renderings from which it is extrapolated.
struct Truth {
  std::vector<float> rgba;
  double squares = 0;  // over all values
  double error_of_half = 0;
  double error_of_quarter = 0;
};

class CalibrationRun {
 public:
  CalibrationRun(scene::CompletedView completed, data::Dataset& dataset, ThreadPool& pool,
                 const CancelToken& cancel, Workspace& workspace,
                 const std::function<void(const CalibrationSample&)>& report,
                 const std::optional<quality::Content>& content)
      : completed_(std::move(completed)),
        dataset_(dataset),
        pool_(pool),
        cancel_(cancel),
        workspace_(workspace),
        report_(report),
        content_(content) {}

  Result<void> run() {
    workspace_.space.image() = {};  // a picture that was drawn before
    if (auto drawn = draw_truth(); !drawn) return drawn.error();
    const std::size_t own = quality::own_setting(completed_.view());
    for (std::size_t i = 0; i < quality::settings_count; ++i) {
      const quality::Setting& setting = quality::settings[i];
      if (!quality::is_allowed(setting, completed_.view())) continue;
      const bool slab = setting.method == protocol::MethodName::slab;
      if (slab && setting.thinner > 1 && told_) continue;
      const auto measured = measure(setting);
      if (!measured && i != own && is_absent(measured.error())) continue;
      if (!measured) return measured.error();
      report_({i, viewpoint_, *measured});
    }
    return {};
  }

 private:
  // The merged data of another setting do not fit into memory.
  static bool is_absent(const Error& error) {
    return error.kind == ErrorKind::not_resident || error.kind == ErrorKind::out_of_memory;
  }

  Result<void> draw_truth() {
    const auto own = scene::build_scene(completed_, dataset_);
    if (!own) return own.error();
    viewpoint_ = viewpoint_of(completed_, content_ ? nullptr : &*own, cancel_);
    if (content_) viewpoint_.content = content_;
    if (cancel_.cancelled()) return make_error(ErrorKind::cancelled, "calibration cancelled");
    const std::array<int, 3> own_level = own->level;
    const double half = reference_thickness(completed_);
    bool told = false;
    for (const double thickness : {half, half / 2}) {
      const auto finer = finer_scene(completed_, dataset_, thickness, truth_samples_max);
      if (!finer) return finer.error();
      if (engine::has_thicker_slabs(finer->first)) return {};
      const Clock::time_point start = Clock::now();
      auto drawn = thickness == half ? draw_half(finer->first) : draw_quarter(finer->first);
      if (!drawn) return drawn.error();
      ms_.push_back(milliseconds_since(start));
      told = finer->first.level == own_level && is_exact(*own) &&
             half == completed_.view().method.slab_thickness / 2;
    }
    known_ = true;
    told_ = told;
    if (!told_) return {};
    tell_run({protocol::MethodName::slab, 0, 0, 2}, truth_.error_of_half, ms_[0]);
    tell_run({protocol::MethodName::slab, 0, 0, 4}, truth_.error_of_quarter, ms_[1]);
    return {};
  }

  Result<void> draw_half(const scene::Scene& scene) {
    const std::size_t values = channels * static_cast<std::size_t>(completed_.view().image.width) *
                               completed_.view().image.height;
    truth_.rgba.assign(values, 0);
    const int width = completed_.view().image.width;
    const auto keep = [&](const engine::TilePixels& tile) {
      each_value(tile, width, [&](std::size_t at, float value) { truth_.rgba[at] = value; });
    };
    const auto work = engine::render(scene, pool_, cancel_, workspace_.space, keep);
    if (!work) return work.error();
    return {};
  }

  // I + (I - I_half) / 3: the error of slabs is of order 2.
  Result<void> draw_quarter(const scene::Scene& scene) {
    PartSums squares;
    const int width = completed_.view().image.width;
    const auto extrapolate = [&](const engine::TilePixels& tile) {
      double sum = 0;
      each_value(tile, width, [&](std::size_t at, float value) {
        const float d = value - truth_.rgba[at];
        truth_.rgba[at] = value + d / 3;
        sum += static_cast<double>(d) * d;
      });
      squares.add(tile, sum);
    };
    const auto work = engine::render(scene, pool_, cancel_, workspace_.space, extrapolate);
    if (!work) return work.error();
    const double difference = std::sqrt(squares.total() / static_cast<double>(truth_.rgba.size()));
    for (const float v : truth_.rgba) truth_.squares += static_cast<double>(v) * v;
    truth_.error_of_half = difference * 4 / 3;
    truth_.error_of_quarter = difference / 3;
    return {};
  }

  // The reference is drawn farther than pictures of the setting, whose rays end earlier.
  void tell_run(const quality::Setting& setting, double error, double ms) {
    if (!quality::is_allowed(setting, completed_.view())) return;
    const quality::Kind kind = quality::signature_of(completed_.view()).kind;
    error = std::hypot(error, quality::stop_error(kind, viewpoint_));
    report_({quality::index_of(setting).value(),
             viewpoint_,
             {std::max(quality::error_least, error), ms}});
  }

  Result<quality::Measured> measure(const quality::Setting& setting) {
    const auto drawn = at_setting(completed_, setting);
    if (!drawn) return drawn.error();
    const auto scene = scene::build_scene(*drawn, dataset_);
    if (!scene) return scene.error();
    quality::Measured out;
    const bool full = known_ && setting.half_level == 0;
    double beyond = 0;
    // The first rendering fills caches that are independent of the camera.
    constexpr double quick_ms = 20;  // shorter renderings are repeated, because other load disturbs
                                     // them most
    for (int run = 0; run < 4; ++run) {
      if (run > 1 && *out.ms > quick_ms) break;
      const Clock::time_point start = Clock::now();
      const auto work =
          full ? compare(*scene, beyond) : engine::render(*scene, pool_, cancel_, workspace_.space);
      if (!work) return work.error();
      const double ms = milliseconds_since(start);
      out.ms = std::min(ms, out.ms.value_or(ms));
    }
    if (full) {
      const double values = static_cast<double>(truth_.rgba.size());
      out.error = std::max(quality::error_least,
                           std::sqrt(std::max(0.0, truth_.squares + beyond) / values));
      return out;
    }
    if (!known_) return out;
    const engine::Image& picture = workspace_.space.image();
    out.error = apart(picture, truth_.rgba, completed_.view().image.width,
                      completed_.view().image.height, pool_);
    return out;
  }

  // Pictures of the size of the reference are compared tile by tile: the sum of (v - t)^2 - t^2
  // over the tiles drawn, since pixels outside them are 0.
  Result<engine::WorkReport> compare(const scene::Scene& scene, double& beyond) {
    PartSums sums;
    const int width = completed_.view().image.width;
    const auto add = [&](const engine::TilePixels& tile) {
      double sum = 0;
      each_value(tile, width, [&](std::size_t at, float value) {
        const double t = truth_.rgba[at];
        const double d = value - t;
        sum += d * d - t * t;
      });
      sums.add(tile, sum);
    };
    auto work = engine::render(scene, pool_, cancel_, workspace_.space, add);
    beyond = sums.total();
    return work;
  }

  static double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  }

  scene::CompletedView completed_;
  data::Dataset& dataset_;
  ThreadPool& pool_;
  const CancelToken& cancel_;
  Workspace& workspace_;
  const std::function<void(const CalibrationSample&)>& report_;
  const std::optional<quality::Content> content_;  // if known
  quality::Viewpoint viewpoint_;
  Truth truth_;
  std::vector<double> ms_;
  bool known_ = false;  // the reference; without it only times are measured
  bool told_ = false;   // the two renderings of the reference are pictures of settings too and have
                        // been reported
};

// The view with a picture of at most retained_pixels.
Result<scene::CompletedView> calibrated(const scene::CompletedView& completed) {
  const protocol::ImageView& image = completed.view().image;
  const double pixels = static_cast<double>(image.width) * image.height;
  const double scale = std::sqrt(static_cast<double>(retained_pixels) / pixels);
  return completed.with([scale](protocol::View& view) {
    if (scale >= 1) return;
    view.image.width = std::max(1, static_cast<int>(view.image.width * scale));
    view.image.height = std::max(1, static_cast<int>(view.image.height * scale));
  });
}

}  // namespace

quality::Viewpoint viewpoint_of(const scene::CompletedView& completed, const scene::Scene* scene,
                                const CancelToken& cancel) {
  quality::Viewpoint viewpoint = quality::viewpoint_of(completed.view());
  viewpoint.detail = scene::detail_shown(completed);
  if (scene != nullptr) viewpoint.content = content_of(*scene, cancel);
  return viewpoint;
}

quality::Viewpoint viewpoint_of(const scene::CompletedView& completed, const data::Dataset& dataset,
                                const CancelToken& cancel) {
  data::Dataset resident = dataset.resident_only();
  const auto scene = scene::build_scene(completed, resident);
  return viewpoint_of(completed, scene ? &*scene : nullptr, cancel);
}

bool is_measured(const Prepared& prepared) {
  const scene::Scene& scene = prepared.scene;
  const double pixels = static_cast<double>(scene.camera.width) * scene.camera.height;
  return prepared.encoding.measure && prepared.setting.half_level == 0 &&
         scene.method != scene::Method::reference && pixels <= static_cast<double>(retained_pixels);
}

Result<std::optional<double>> measured_error(const Prepared& prepared, data::Dataset& dataset,
                                             ThreadPool& pool, const CancelToken& cancel,
                                             Workspace& workspace, bool keep) {
  // Reads no file, and takes no longer than a few frames, or than a frame of this many samples.
  constexpr double times_as_many = 4;
  constexpr double samples_always = 4e6;
  const scene::Scene& scene = prepared.scene;
  data::Dataset resident = dataset.resident_only();
  const double thickness = reference_thickness(prepared.completed);
  const auto finer =
      finer_scene(prepared.completed, resident, thickness,
                  std::min(truth_samples_max,
                           std::max(samples_always, times_as_many * samples_of(scene.lattice))));
  if (!finer || !finer->second || engine::has_thicker_slabs(finer->first)) {
    return std::optional<double>();
  }
  // The picture itself is encoded afterwards.
  std::vector<float>& rgba = workspace.space.image().rgba;
  std::vector<float> copy;
  if (keep || workspace.encoding.format != Format::jpeg) copy = rgba;
  std::vector<float>& left = copy.empty() ? rgba : copy;
  const int width = scene.camera.width;
  const auto subtract = [&](const engine::TilePixels& tile) {
    each_value(tile, width, [&](std::size_t at, float value) { left[at] -= value; });
  };
  const auto work = engine::render(finer->first, pool, cancel, workspace.space, subtract);
  if (!work) return work.error();
  const bool order_two =
      scene.method == scene::Method::slab && scene.level == finer->first.level && is_exact(scene);
  const double ratio2 = std::pow(scene.slab_thickness / thickness, 2);
  const double error = rms(left) * (order_two ? ratio2 / (ratio2 - 1) : 1.0);
  return std::optional(std::max(quality::error_least, error));
}

// Times in those of the picture, on the trial fields at 1280x720 (bench_left_out): what is left out
// of lines alone takes 0.02 to 0.33 of what is drawn, since the lines are shorter and often hidden,
// and beside a medium up to 0.14. Measuring the error takes 3.3 to 27 pictures by `kernel`; slabs
// of half the thickness 1.3 to 2.5.
bool is_change_measured(const scene::Scene& scene, const engine::WorkReport& work) {
  // Weak streamlets were not traced and cannot be drawn.
  if (scene.vector && scene.vector->streamlets && scene.vector->min_magnitude > 0) return false;
  const bool slab = scene.method == scene::Method::slab;
  const double few = slab ? 0x1p18 : 0x1p20;  // take no longer than describing the view
  const double pictures_most = slab ? 2.5 : 5;
  constexpr double of_left_out = 0.25;
  const auto visible = static_cast<double>(work.samples - work.culled);
  const auto left_out = static_cast<double>(work.skipped_both);
  return visible <= few ||
         visible - left_out + of_left_out * left_out <= pictures_most * (visible - left_out);
}

Result<double> measured_skipped_change(const Prepared& prepared, ThreadPool& pool,
                                       const CancelToken& cancel, Workspace& workspace) {
  const scene::Scene whole = without_tolerances(prepared.scene);
  const std::vector<float>& rgba = workspace.space.image().rgba;
  const int width = whole.camera.width;
  PartSums sums;
  // Tiles in which neither picture has anything are not delivered.
  const auto add = [&](const engine::TilePixels& tile) {
    double sum = 0;
    double most = 0;
    each_value(tile, width, [&](std::size_t at, float value) {
      most = std::max(most, std::abs(static_cast<double>(value) - rgba[at]));
      if (at % channels != channels - 1) return;
      sum += most;
      most = 0;
    });
    sums.add(tile, sum);
  };
  const auto work = engine::render(whole, pool, cancel, workspace.space, add);
  if (!work) return work.error();
  return sums.total() * channels / static_cast<double>(rgba.size());
}

Result<void> load_for_calibration(const scene::CompletedView& completed, data::Dataset& dataset,
                                  const CancelToken& cancel) {
  const auto sized = calibrated(completed);
  if (!sized) return sized.error();
  const std::size_t own = quality::own_setting(sized->view());
  if (auto scene = prepare(*sized, quality::settings[own], dataset, {}); !scene) {
    return scene.error();
  }
  std::set<std::array<int, 2>> loaded;
  for (const quality::Setting& setting : quality::settings) {
    if (!quality::is_allowed(setting, sized->view())) continue;
    if (!loaded.insert({setting.half_level, setting.coarser}).second) continue;
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "calibration cancelled");
    (void)prepare(*sized, setting, dataset, {});  // without memory the setting is left out
  }
  return {};
}

Result<void> calibrate(const scene::CompletedView& completed, data::Dataset& dataset,
                       ThreadPool& pool, const CancelToken& cancel, Workspace& workspace,
                       const std::function<void(const CalibrationSample&)>& report,
                       const std::optional<quality::Content>& content) {
  const auto sized = calibrated(completed);
  if (!sized) return sized.error();
  // A smaller picture may show data of another level.
  const bool own_size = sized->view().image.height == completed.view().image.height;
  return CalibrationRun(*sized, dataset, pool, cancel, workspace, report,
                        own_size ? content : std::nullopt)
      .run();
}

}  // namespace windsplat::frame
