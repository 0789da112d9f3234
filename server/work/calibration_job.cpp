// Loader -> renderer, in the background -> tables.
#include "server/work/calibration_job.hpp"

#include <memory>
#include <utility>

#include "server/frame/measure.hpp"
#include "server/scene/build.hpp"
#include "server/work/run_guarded.hpp"

namespace windsplat::net {
namespace {

// A study that was begun in the tables, and ends there however it ends.
class Study {
 public:
  Study(Backend& backend, protocol::View completed, quality::Style style)
      : backend_(backend), completed_(std::move(completed)), style_(std::move(style)) {}
  ~Study() {
    backend_.quality.end_study(style_, complete_);
    backend_.metrics.background_done(!complete_);
  }
  Study(const Study&) = delete;
  Study& operator=(const Study&) = delete;

  // The averages of coarser settings, as far as there is room for them. Nothing is held: until the
  // renderer has nothing else to do, others may need the room.
  Result<void> load(data::Dataset& dataset, const CancelToken& unwanted) {
    for (const int coarser : {0, 1, 2}) {
      if (unwanted.cancelled()) return make_error(ErrorKind::cancelled, "nobody looks any more");
      frame::Encoding encoding;
      encoding.coarser = coarser;
      const auto loaded = frame::load(completed_, dataset, encoding);
      if (!loaded && coarser == 0) return loaded.error();
    }
    return {};
  }

  void draw(data::Dataset& dataset, const CancelToken& stop, const CancelToken& unwanted) {
    const auto keep = [&](const frame::Surveyed& found) {
      if (unwanted.cancelled()) stop.cancel();
      backend_.quality.add(style_, found.setting, found.sight, found.measured);
    };
    complete_ = static_cast<bool>(attempt<void>("a survey", stop, [&]() -> Result<void> {
      const auto room = backend_.catalogue.reserve(frame::survey_bytes(completed_.image));
      if (!room) return room.error();  // others need it more
      return frame::survey(completed_, dataset, *backend_.pool, stop, backend_.frames, keep);
    }));
  }

 private:
  Backend& backend_;
  protocol::View completed_;
  quality::Style style_;
  bool complete_ = false;
};

std::shared_ptr<Study> begin(Backend& backend, const protocol::View& view, data::Dataset& dataset) {
  auto completed = scene::complete_and_place(view, dataset);
  if (!completed || !frame::is_worth_a_survey(completed->view)) return nullptr;
  const auto sight = frame::sight_of(*completed);
  quality::Style style = quality::style_of(completed->view);
  if (!sight || !backend.quality.begin_study(style, *sight)) return nullptr;
  return std::make_shared<Study>(backend, std::move(completed->view), std::move(style));
}

}  // namespace

void submit_survey(Backend& backend, std::uint64_t owner, const protocol::View& view,
                   const CancelToken& unwanted) {
  const auto found = backend.catalogue.find(view.dataset);
  if (!found) return;
  const auto run = [&backend, owner, view, unwanted, dataset = *found] {
    std::shared_ptr<Study> study;
    const auto loaded = attempt<void>("data for a survey", unwanted, [&]() -> Result<void> {
      data::Dataset ahead = dataset->ahead();
      study = begin(backend, view, ahead);
      if (!study) return make_error(ErrorKind::not_found, "there is nothing to learn");
      return study->load(ahead, unwanted);
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
