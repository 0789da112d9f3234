// For each subject: reference, every point of the sweep, reconstruction ripple, encodings, pictures
// and calibration. Points in the folder are not measured again.
#include "server/study/study.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "server/base/elapsed.hpp"
#include "server/study/keys.hpp"
#include "server/study/metrics.hpp"
#include "server/study/points_file.hpp"
#include "server/study/truth_file.hpp"

namespace windsplat::study {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double truth_weight = 12;       // cost of a reference, in points
constexpr double pictures_weight = 2;     // work of the remaining part of a scene
constexpr double calibration_weight = 3;  // work of one view of a calibration
constexpr int amplification = 10;

bool finite(const Picture& picture) {
  return std::all_of(picture.rgba.begin(), picture.rgba.end(),
                     [](double v) { return std::isfinite(v); });
}

class Study {
 public:
  Study(const std::vector<Subject>& subjects, const Options& options, ThreadPool& pool,
        const CancelToken& cancel, const Listener& listen, PointsFile points, Machine machine)
      : subjects_(subjects),
        options_(options),
        pool_(pool),
        cancel_(cancel),
        listen_(listen),
        points_(std::move(points)) {
    report_.machine = std::move(machine);
    report_.quick = options.quick;
    report_.runs = options.quick ? quick_runs : timed_runs;
  }

  Result<Report> run() {
    const Clock::time_point start = Clock::now();
    estimate_work();
    for (const Subject& subject : subjects_) {
      if (const auto done = study_scene(subject); !done) return done.error();
    }
    auto stability = stiffness_sweep(pool_, cancel_);
    if (!stability) return stability.error();
    report_.stability = std::move(*stability);
    report_.seconds = seconds_since(start);
    return std::move(report_);
  }

 private:
  std::string point_key(const Subject& subject, const Setting& setting) const {
    return study::point_key(subject, setting, report_.machine,
                            {bool(options_.truth), options_.tolerance, report_.runs});
  }

  std::filesystem::path truth_path(const Subject& subject) const {
    std::string name = "truth-";
    name += truth_key(subject, report_.machine, options_.tolerance);
    name += ".f64";
    return options_.folder / name;
  }

  // Estimates the work of this run, in points.
  void estimate_work() {
    for (const Subject& subject : subjects_) {
      for (const Setting& setting : plan_sweep(subject, options_.quick).settings) {
        if (!points_.find(point_key(subject, setting))) left_ += 1;
      }
      if (options_.truth && !std::filesystem::exists(truth_path(subject))) left_ += truth_weight;
      left_ += pictures_weight;
      if (is_calibrated(subject)) left_ += calibration_weight * views_of(subject);
    }
  }

  bool is_calibrated(const Subject& subject) const {
    return options_.calibrate && subject.calibrated;
  }

  int views_of(const Subject& subject) const {
    const CalibrationPlan plan = calibration_plan(subject, options_.quick);
    return static_cast<int>(variants_of(subject).size()) * (plan.calibrated + plan.held_out);
  }

  void report_progress(const Subject& subject, const std::string& doing) const {
    if (listen_) listen_({subject.name, doing, left_ > 0 ? std::min(1.0, done_ / left_) : 1.0});
  }

  Result<Picture> find_truth(const Subject& subject, SceneReport& scene) {
    scene.integral = bool(options_.truth);
    const Clock::time_point start = Clock::now();
    if (!scene.integral) {
      auto made = extrapolate(subject, pool_, cancel_);
      if (!made) return made.error();
      scene.truth_estimate = made->estimate;
      scene.truth_seconds = seconds_since(start);
      return std::move(made->picture);
    }
    const std::filesystem::path path = truth_path(subject);
    scene.tolerance = options_.tolerance;
    if (auto kept = read_truth(path, scene.width, scene.height, options_.tolerance)) {
      scene.truth_seconds = kept->seconds;
      return std::move(kept->picture);
    }
    report_progress(subject, "reference");
    const auto truth_scene = scene_at(
        subject, {scene::Method::reference, scene::Compositing::analytic, own_knobs(subject)});
    if (!truth_scene) return truth_scene.error();
    auto truth = options_.truth(*truth_scene);
    if (!truth) return truth.error();
    if (!finite(*truth)) {
      return make_error(ErrorKind::internal,
                        "the reference of '" + printable(subject.name) + "' is not finite");
    }
    scene.truth_seconds = seconds_since(start);
    KeptTruth made{std::move(*truth), scene.truth_seconds, options_.tolerance};
    if (const auto kept = write_truth(path, made); !kept) return kept.error();
    done_ += truth_weight;
    return std::move(made.picture);
  }

  Result<void> measure_points(const Subject& subject, const Picture& truth, SceneReport& scene) {
    Sweep sweep = plan_sweep(subject, options_.quick);
    scene.curves = std::move(sweep.curves);
    for (const Setting& setting : sweep.settings) {
      const std::string key = point_key(subject, setting);
      if (const auto known = points_.find(key)) {
        ++report_.skipped;
        scene.points.push_back({setting, *known, false});
        continue;
      }
      // Small pictures finish before the engine polls for cancellation.
      if (cancel_.cancelled()) return make_error(ErrorKind::cancelled, "the study was interrupted");
      report_progress(subject,
                      std::string(name_of(setting.method)) + " " + name_of(setting.compositing));
      const auto measured = measure(subject, setting, truth, pool_, cancel_, report_.runs);
      if (!measured) return measured.error();
      if (const auto kept = points_.append(key, *measured); !kept) return kept.error();
      scene.points.push_back({setting, *measured, false});
      ++report_.measured;
      ++done_;
    }
    mark_pareto(scene.points);
    for (Curve& curve : scene.curves) find_order(scene.points, curve);
    return {};
  }

  // The reference, every compositing operator of method kernel, and method slab, with the
  // parameters of the view.
  Result<void> draw_pictures(const Subject& subject, const Picture& truth, SceneReport& scene) {
    const auto base = scene_at(
        subject, {scene::Method::kernel, scene::Compositing::analytic, own_knobs(subject)});
    if (!base) return base.error();
    const auto& background = base->background;
    const std::vector<std::uint8_t> true_rgb =
        displayed(to_floats(truth), truth.width, truth.height, background);
    scene.pictures.push_back({"reference", true_rgb, {}});
    std::vector<std::pair<scene::Method, scene::Compositing>> wanted{
        {scene::Method::slab, scene::Compositing::analytic}};
    for (const scene::Compositing compositing : compositings) {
      wanted.emplace_back(scene::Method::kernel, compositing);
      if (subject.view.scalars->empty()) break;
    }
    for (const auto& [method, compositing] : wanted) {
      const auto image = draw(subject, {method, compositing, own_knobs(subject)}, pool_, cancel_);
      if (!image) return image.error();
      Shown shown;
      shown.title = name_of(method);
      shown.title += ' ';
      shown.title += name_of(compositing);
      shown.rgb = displayed(image->rgba, image->width, image->height, background);
      for (std::size_t i = 0; i < shown.rgb.size(); ++i) {
        const int apart = std::abs(static_cast<int>(shown.rgb[i]) - true_rgb[i]);
        shown.difference_rgb.push_back(
            static_cast<std::uint8_t>(std::min(255, amplification * apart)));
      }
      scene.pictures.push_back(std::move(shown));
    }
    return {};
  }

  Result<Calibration> calibrate_scene(const Subject& subject) {
    report_progress(subject, "calibration");
    return calibrate(subject, calibration_plan(subject, options_.quick), options_.truth, pool_,
                     cancel_, [&](int) {
                       done_ += calibration_weight;
                       report_progress(subject, "calibration");
                     });
  }

  Result<void> study_scene(const Subject& subject) {
    SceneReport scene;
    scene.name = subject.name;
    scene.view = subject.view;
    scene.width = subject.view.image.width;
    scene.height = subject.view.image.height;
    const auto truth = find_truth(subject, scene);
    if (!truth) return truth.error();
    scene.pieces = truth->pieces;
    scene.evaluations = truth->evaluations;
    if (const auto done = measure_points(subject, *truth, scene); !done) return done.error();
    report_progress(subject, "pictures");
    if (!subject.view.scalars->empty()) {
      const auto ripple = reconstruction_ripple(subject, pool_, cancel_);
      if (!ripple) return ripple.error();
      scene.reconstruction_ripple = *ripple;
    }
    auto encoded = measure_encoding(subject, pool_, cancel_);
    if (!encoded) return encoded.error();
    scene.encoded = std::move(*encoded);
    if (const auto drawn = draw_pictures(subject, *truth, scene); !drawn) return drawn.error();
    done_ += pictures_weight;
    if (is_calibrated(subject)) {
      auto calibration = calibrate_scene(subject);
      if (!calibration) return calibration.error();
      scene.calibration = std::move(*calibration);
    }
    report_progress(subject, "done");
    report_.scenes.push_back(std::move(scene));
    return {};
  }

  const std::vector<Subject>& subjects_;
  const Options& options_;
  ThreadPool& pool_;
  const CancelToken& cancel_;
  const Listener& listen_;
  PointsFile points_;
  Report report_;
  double left_ = 0;
  double done_ = 0;
};

Result<void> make_folder(const std::filesystem::path& folder) {
  std::error_code fault;
  std::filesystem::create_directories(folder, fault);
  if (!fault) return {};
  std::string message = "cannot create the folder '";
  message += printable(folder.native());
  message += "': ";
  message += fault.message();
  return make_error(ErrorKind::internal, std::move(message));
}

}  // namespace

Result<Report> study_extremes(const std::vector<std::string>& group_names,
                              const std::filesystem::path& folder, ThreadPool& pool,
                              const CancelToken& cancel, const GroupListener& listen) {
  if (auto made = make_folder(folder); !made) return made.error();
  const Clock::time_point start = Clock::now();
  Report report;
  auto machine = this_machine(pool.size());
  if (!machine) return machine.error();
  report.machine = std::move(*machine);
  auto extremes = run_extremes(group_names, pool, cancel, listen);
  if (!extremes) return extremes.error();
  report.extremes = std::move(*extremes);
  report.seconds = seconds_since(start);
  return report;
}

Result<Report> run_study(const std::vector<Subject>& subjects, const Options& options,
                         ThreadPool& pool, const CancelToken& cancel, const Listener& listen) {
  if (auto made = make_folder(options.folder); !made) return made.error();
  auto points = PointsFile::open(options.folder / "points.csv");
  if (!points) return points.error();
  auto machine = this_machine(pool.size());
  if (!machine) return machine.error();
  return Study(subjects, options, pool, cancel, listen, std::move(*points), std::move(*machine))
      .run();
}

}  // namespace windsplat::study
