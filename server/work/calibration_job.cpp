// Loads data, renders every setting in the background, and stores the results in the tables.
#include "server/work/calibration_job.hpp"

#include <memory>
#include <utility>

#include "server/frame/measure.hpp"
#include "server/scene/build.hpp"
#include "server/work/run_guarded.hpp"

namespace windsplat::net {
namespace {

// A study that is started in the tables and ended there by its destructor.
class Study {
 public:
  Study(Backend& backend, protocol::View completed, quality::SceneSignature signature)
      : backend_(backend), completed_(std::move(completed)), signature_(std::move(signature)) {}
  ~Study() {
    backend_.quality.end_study(signature_, complete_);
    backend_.metrics.background_done(!complete_);
  }
  Study(const Study&) = delete;
  Study& operator=(const Study&) = delete;

  // Prepares the averages of coarser settings as far as memory allows. Nothing is pinned: until the
  // renderer is idle, others may need the memory.
  Result<void> load(data::Dataset& dataset, const CancelToken& unwanted) {
    for (const int coarser : {0, 1, 2}) {
      if (unwanted.cancelled()) return make_error(ErrorKind::cancelled, "calibration cancelled");
      frame::Encoding encoding;
      encoding.coarser = coarser;
      const auto loaded = frame::load(completed_, dataset, encoding);
      if (!loaded && coarser == 0) return loaded.error();
    }
    return {};
  }

  void draw(data::Dataset& dataset, const CancelToken& stop, const CancelToken& unwanted) {
    const auto keep = [&](const frame::CalibrationSample& found) {
      if (unwanted.cancelled()) stop.cancel();
      backend_.quality.add(signature_, found.setting, found.viewpoint, found.measured);
    };
    complete_ = static_cast<bool>(run_guarded<void>("a survey", stop, [&]() -> Result<void> {
      const auto room = backend_.catalogue.reserve(frame::calibration_bytes(completed_.image));
      if (!room) return room.error();  // memory is in use by others
      return frame::calibrate(completed_, dataset, *backend_.pool, stop, backend_.frames, keep);
    }));
  }

 private:
  Backend& backend_;
  protocol::View completed_;
  quality::SceneSignature signature_;
  bool complete_ = false;
};

std::shared_ptr<Study> begin(Backend& backend, const protocol::View& view, data::Dataset& dataset) {
  auto completed = scene::complete_and_place(view, dataset);
  if (!completed || !frame::is_worth_calibrating(completed->view)) return nullptr;
  const auto viewpoint = frame::viewpoint_of(*completed);
  quality::SceneSignature signature = quality::signature_of(completed->view);
  if (!viewpoint || !backend.quality.begin_study(signature, *viewpoint)) return nullptr;
  return std::make_shared<Study>(backend, std::move(completed->view), std::move(signature));
}

}  // namespace

void submit_calibration(Backend& backend, std::uint64_t owner, const protocol::View& view,
                        const CancelToken& unwanted) {
  const auto found = backend.catalogue.find(view.dataset);
  if (!found) return;
  const auto run = [&backend, owner, view, unwanted, dataset = *found] {
    std::shared_ptr<Study> study;
    const auto loaded = run_guarded<void>("calibration load", unwanted, [&]() -> Result<void> {
      data::Dataset prefetching = dataset->prefetching();
      study = begin(backend, view, prefetching);
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
    (void)backend.renderer.submit(std::move(job));  // if refused, the study ends with the job
  };
  (void)backend.loads.submit({unwanted, run, true, (*found)->shared_info()});
}

}  // namespace windsplat::net
