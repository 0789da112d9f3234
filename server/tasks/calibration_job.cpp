// Loads data, renders every setting in the background, and stores the results in the tables.
#include "server/tasks/calibration_job.hpp"

#include <memory>
#include <optional>
#include <utility>

#include "server/frame/measure.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {
namespace {

// An entry in the tables that marks a running calibration; removed by its destructor.
class Study {
 public:
  Study(Backend& backend, scene::CompletedView completed, quality::SceneSignature signature,
        const std::optional<quality::Content>& content)
      : backend_(backend),
        completed_(std::move(completed)),
        signature_(std::move(signature)),
        content_(content) {}
  ~Study() {
    backend_.quality.end_study(signature_, complete_);
    backend_.metrics.background_done(!complete_);
  }
  Study(const Study&) = delete;
  Study& operator=(const Study&) = delete;

  // Nothing is pinned: others may need the memory until the renderer is idle.
  Result<void> load(data::Dataset& dataset, const CancelToken& unwanted) {
    return frame::load_for_calibration(completed_, dataset, unwanted);
  }

  void draw(data::Dataset& dataset, const CancelToken& stop, const CancelToken& unwanted) {
    const auto keep = [&](const frame::CalibrationSample& found) {
      if (unwanted.cancelled()) stop.cancel();
      backend_.quality.add(signature_, found.setting, found.viewpoint, found.measured);
    };
    const auto run = run_guarded<void>("a calibration run", stop, [&]() -> Result<void> {
      const auto room =
          backend_.catalogue.store().reserve(frame::calibration_bytes(completed_.view().image));
      if (!room) return room.error();  // other users occupy the memory
      return frame::calibrate(completed_, dataset, *backend_.pool, stop, backend_.frames, keep,
                              content_);
    });
    complete_ = static_cast<bool>(run);
    if (!run) {
      log::debug("calibration ended early",
                 {{"dataset", completed_.view().dataset}, {"error", run.error().message}});
    }
  }

 private:
  Backend& backend_;
  scene::CompletedView completed_;
  quality::SceneSignature signature_;
  std::optional<quality::Content> content_;
  bool complete_ = false;
};

std::shared_ptr<Study> begin(Backend& backend, const scene::CompletedView& completed,
                             const data::Dataset& dataset, const CancelToken& unwanted) {
  quality::SceneSignature signature = quality::signature_of(completed.view());
  const quality::Viewpoint viewpoint =
      describe_view(backend, completed, dataset, unwanted).viewpoint;
  if (unwanted.cancelled()) return nullptr;
  if (!frame::is_worth_calibrating(completed.view())) return nullptr;
  if (!backend.quality.begin_study(signature, viewpoint)) return nullptr;
  return std::make_shared<Study>(backend, completed, std::move(signature), viewpoint.content);
}

}  // namespace

void submit_calibration(Backend& backend, std::uint64_t owner, const protocol::View& view,
                        const std::shared_ptr<ViewCompletion>& completion,
                        const CancelToken& unwanted) {
  const auto found = find_shown(backend.catalogue, view);
  if (!found) return;
  const auto run = [&backend, owner, view, completion, unwanted, dataset = *found] {
    std::shared_ptr<Study> study;
    const auto loaded = run_guarded<void>("calibration load", unwanted, [&]() -> Result<void> {
      data::Dataset prefetching = dataset->prefetching();
      const auto completed = completion->of(view, prefetching);
      if (!completed) return completed.error();
      study = begin(backend, *completed, prefetching, unwanted);
      if (!study) return make_error(ErrorKind::not_found, "no settings to calibrate");
      return study->load(prefetching, unwanted);
    });
    if (!loaded) return;
    RenderJob job;
    job.kind = RenderKind::background;
    job.owner = owner;
    job.run = [study, dataset, unwanted, stop = job.cancel](std::int64_t /*queue_us*/) {
      if (unwanted.cancelled()) return;
      data::Dataset resident = dataset->resident_only();
      study->draw(resident, stop, unwanted);
    };
    (void)backend.renderer.submit(std::move(job));  // if refused, the calibration run ends with the
                                                    // job
  };
  (void)backend.loads.submit({unwanted, run, true, (*found)->shared_info()});
}

void learn_describing(Backend& backend, const std::string& dataset, std::int64_t took_us) {
  if (took_us <= 0) return;
  backend.metrics.stage_took(metrics::Metrics::Stage::describe, took_us);
  backend.request_times.learn_describing(dataset, took_us);
}

frame::Described describe_view(Backend& backend, const scene::CompletedView& completed,
                               const scene::Scene& scene, const CancelToken& cancel) {
  frame::Described out = frame::described(completed, scene, backend.quality, cancel);
  learn_describing(backend, completed.view().dataset, out.describe_us);
  return out;
}

frame::Described describe_view(Backend& backend, const scene::CompletedView& completed,
                               const data::Dataset& dataset, const CancelToken& cancel) {
  frame::Described out = frame::described(completed, dataset, backend.quality, cancel);
  learn_describing(backend, completed.view().dataset, out.describe_us);
  return out;
}

}  // namespace windsplat::tasks
