// Effects of a session become render and load jobs; their results become events of the session.
#include "server/tasks/viewer.hpp"

#include <atomic>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "protocol/codec.hpp"
#include "server/base/log.hpp"
#include "server/frame/frame_info.hpp"
#include "server/scene/build.hpp"
#include "server/scene/describe.hpp"
#include "server/scene/level/stand_in.hpp"
#include "server/tasks/calibration_job.hpp"
#include "server/tasks/drawing.hpp"
#include "server/tasks/error_report.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {
namespace {

frame::Encoding frame_encoding(const session::Encoding& wanted) {
  frame::Encoding encoding;
  const bool png = wanted.codec == protocol::Codec::png;
  encoding.format = png ? frame::Format::png : frame::Format::jpeg;
  encoding.quality = wanted.quality;
  encoding.subsampling = wanted.full_chroma ? image::Subsampling::s444 : image::Subsampling::s420;
  encoding.measure = wanted.measure;
  encoding.key = wanted.key;
  return encoding;
}

void report_video(Backend& backend, const frame::Frame& drawn, session::Drawn& out) {
  out.video = drawn.coded == frame::Coded::video || drawn.coded == frame::Coded::video_key;
  out.key = drawn.coded == frame::Coded::video_key;
  if (drawn.coded != frame::Coded::video_failed) return;
  log::warn("video could not be encoded; JPEG is sent", {{"why", drawn.video_fault}});
  backend.metrics.video_failed();
}

Result<session::Drawn> draw(Backend& backend, const PreparedPicture& picture,
                            data::Dataset& dataset, std::int64_t queue_us, Loading loading,
                            const CancelToken& cancel) {
  auto drawn = frame::produce(picture.frame, dataset, *backend.pool, cancel, backend.frames);
  if (!drawn) return drawn.error();
  session::Drawn out;
  out.info = frame::frame_info(*drawn, drawn->view);
  Observation observed = observed_in(*drawn, picture.frame.setting);
  report_error(*drawn, observed, picture.frame.setting, picture.frame.encoding, backend.quality,
               out.info);
  out.signature = std::move(observed.signature);
  out.viewpoint = observed.viewpoint;
  out.halvings = drawn->halvings;
  out.view_json = protocol::encode_view(drawn->view);
  if (!picture.frame.encoding.measure && loading == Loading::none &&
      picture.frame.scene.missing_bytes == 0) {
    if (const auto listed = quality::index_of(picture.frame.setting)) {
      backend.quality.add_frame(out.signature, *listed, out.viewpoint,
                                1e-3 * static_cast<double>(drawn->render_us));
    }
  }
  learn_describing(backend, drawn->view.dataset, drawn->describe_us);
  out.payload = std::make_shared<const std::vector<std::uint8_t>>(std::move(drawn->bytes));
  report_video(backend, *drawn, out);
  out.queue_us = queue_us;
  out.render_us = drawn->render_us;
  out.measure_us = drawn->measure_us;
  out.encode_us = drawn->encode_us;
  backend.metrics.stage_took(metrics::Metrics::Stage::queue, out.queue_us);
  backend.metrics.stage_took(metrics::Metrics::Stage::render, out.render_us);
  backend.metrics.stage_took(metrics::Metrics::Stage::encode, out.encode_us);
  return out;
}

// Serialised here, without long lists, to keep the io thread free.
Result<protocol::DatasetDescription> encoded(Result<protocol::DatasetDescription> description) {
  if (!description) return description;
  description->encoded =
      std::make_shared<const std::string>(protocol::encode_dataset(*description));
  description->steps = {};
  description->axes = {};
  return description;
}

Error frame_cancelled() { return make_error(ErrorKind::cancelled, "frame cancelled"); }

constexpr int describing_max = 4;  // limit per session

Result<std::vector<data::PrefetchRequest>> prefetch_requests_of(const data::Dataset& dataset,
                                                                const session::Prefetch& wanted,
                                                                ViewCompletion& completion) {
  data::Dataset prefetching = dataset.prefetching();
  const auto completed = completion.of(wanted.view, prefetching);
  if (!completed) return completed.error();
  const auto drawn = frame::at_setting(*completed, wanted.setting);
  if (!drawn) return drawn.error();
  const auto needs = scene::needs_of(*drawn, dataset);
  if (!needs) return needs.error();
  std::optional<data::ResidentKey> places;
  if (!needs->places.empty()) places = dataset.auxiliary_key(needs->places);
  std::vector<data::PrefetchRequest> requests;
  for (const int step : wanted.steps) {
    for (const auto& [field, how] : needs->fields) {
      requests.push_back({dataset, field, static_cast<std::size_t>(step), how, places});
    }
  }
  return requests;
}

}  // namespace

// The encoder of the session's video stream. Used by one render at a time.
struct Viewer::Video {
  std::shared_ptr<image::VideoEncoder> encoder;
  std::shared_ptr<const void> memory;  // reserved for it
  std::uint64_t bytes = 0;

  // Gives the picture the encoder; without memory for it the picture remains a JPEG.
  void encode(PreparedPicture& picture, const data::Dataset& dataset) {
    const scene::Camera& camera = picture.frame.scene.camera;
    const std::uint64_t needed = image::VideoEncoder::bytes_for(camera.width, camera.height);
    if (needed > bytes) {
      auto reserved = dataset.reserve(needed);
      if (!reserved) return;
      memory = std::move(*reserved);
      bytes = needed;
    }
    picture.frame.encoding.video = encoder.get();
  }
};

// A render of the session. It replies once.
struct Viewer::Running {
  explicit Running(DrawnReply to, bool video) : as_video(video), send(std::move(to)) {}
  void reply(std::uint64_t ticket, Result<session::Drawn> drawn) {
    if (!replied.exchange(true)) send(ticket, std::move(drawn));
  }
  const CancelToken cancel;
  const bool as_video;  // uses the encoder until it replies
  // Whichever comes second sees the other.
  static constexpr unsigned waits_for_data = 1;
  static constexpr unsigned was_cancelled = 2;
  std::atomic<unsigned> events = 0;
  std::atomic<bool> replied = false;
  const DrawnReply send;
};

// What is loaded while the view moves, by the thread that prefetches: it is requested as long as
// the view is shown.
struct Viewer::Loads {
  // Of a moving frame; nothing if that was cancelled, as a later one may have renewed them.
  void renew(Backend& backend, std::uint64_t owner, const scene::CompletedView& drawn,
             const data::Dataset& dataset, const CancelToken& cancel) {
    std::vector<data::PrefetchRequest> requests;
    const auto step = static_cast<std::size_t>(drawn.view().step);
    for (auto& [field, how] : scene::loads_of(drawn, dataset)) {
      requests.push_back({dataset, field, step, std::move(how), std::nullopt});
    }
    const std::lock_guard lock(mutex);
    if (ended || cancel.cancelled() || (requests.empty() && !of)) return;
    of.reset();
    if (!requests.empty()) of.emplace(drawn.view().dataset, drawn.view().step);
    backend.catalogue.store().request_prefetch(owner_of(owner), std::move(requests));
  }
  // Withdraws those of another dataset or step.
  void keep(Backend& backend, std::uint64_t owner, const protocol::View& view) {
    const std::lock_guard lock(mutex);
    if (!of || *of == std::pair(view.dataset, view.step)) return;
    of.reset();
    backend.catalogue.store().request_prefetch(owner_of(owner), {});
  }
  void withdraw(Backend& backend, std::uint64_t owner, bool for_ever) {
    const std::lock_guard lock(mutex);
    ended = ended || for_ever;
    of.reset();
    backend.catalogue.store().request_prefetch(owner_of(owner), {});
  }

 private:
  // Beside the session's requests for other steps.
  static std::uint64_t owner_of(std::uint64_t session) { return session | std::uint64_t{1} << 63; }
  std::mutex mutex;
  bool ended = false;
  std::optional<std::pair<std::string, int>> of;  // dataset and step of what is requested
};

// Pending prefetch requests. A dataset has at most one waiting job, however often the view changes;
// the job evaluates the newest request when it runs.
struct Viewer::PrefetchState {
  struct Newest {
    data::Dataset dataset;
    session::Prefetch effect;
  };
  std::mutex
      mutex;  // held while a request is submitted, so that none is submitted after it was withdrawn
  std::optional<Newest> newest;           // set until the request is evaluated
  const data::DatasetInfo* of = nullptr;  // dataset of the newest request; compared only
  std::uint64_t epoch = 0;                // counts withdrawals and changes of dataset
  std::set<const data::DatasetInfo*> queued;
};

Viewer::Viewer(Backend& backend, std::uint64_t owner, std::string payer)
    : backend_(backend),
      owner_(owner),
      payer_(std::move(payer)),
      requests_(std::make_shared<PrefetchState>()),
      loads_(std::make_shared<Loads>()) {}

void Viewer::start(const session::StartRender& effect, DrawnReply reply) {
  calibration_.cancel();  // the view is changing again
  loads_->keep(backend_, owner_, effect.view);
  auto dataset = find_shown(backend_.catalogue, effect.view);
  if (!dataset) return reply(effect.ticket, dataset.error());
  shown_ = backend_.catalogue.use(effect.view.dataset);
  const auto& minus = effect.view.difference;
  subtracted_ = minus && minus->dataset ? backend_.catalogue.use(*minus->dataset) : nullptr;
  // A final frame may be larger than the view that was checked before.
  if (const auto fits = backend_.check(effect.view); !fits) {
    return reply(effect.ticket, fits.error());
  }
  const bool as_video = effect.encoding.codec == protocol::Codec::h264;
  const auto running = std::make_shared<Running>(std::move(reply), as_video);
  const CancelToken& cancel = running->cancel;
  running_.emplace(effect.ticket, running);
  if (as_video && video_ == nullptr) {
    if (auto encoder = backend_.video.open()) {
      video_ = std::make_shared<Video>(Video{std::move(encoder), {}, 0});
    }
  }
  const auto video = as_video ? video_ : nullptr;
  Drawing drawing{
      RenderService::Kind::stream, owner_, cancel, std::move(*dataset), {}, {}, {}, 0, payer_};
  drawing.prepare = [&backend = backend_, effect, cancel, video, completion = completion_, running,
                     loads = loads_, owner = owner_](data::Dataset& available, Loading loading) {
    return run_guarded<PreparedPtr>("preparing a frame", cancel, [&]() -> Result<PreparedPtr> {
      const auto completed = completion->of(effect.view, available);
      if (!completed) return completed.error();
      auto picture = prepare_picture(
          *completed, effect.setting, frame_encoding(effect.encoding), available, loading,
          effect.may_stand_in ? scene::StandIn::allowed : scene::StandIn::none);
      if (!picture && picture.error().kind == ErrorKind::not_resident) {
        const unsigned before = running->events.fetch_or(Running::waits_for_data);
        if ((before & Running::was_cancelled) != 0) return frame_cancelled();
      }
      if (picture && effect.may_stand_in) {
        loads->renew(backend, owner, (*picture)->frame.completed, available, cancel);
      }
      if (picture && video) video->encode(**picture, available);
      if (picture && effect.encoding.measure) {
        (*picture)->frame.content = frame::known_viewpoint_of(*completed, backend.quality).content;
      }
      return picture;
    });
  };
  drawing.draw = [&backend = backend_, ticket = effect.ticket, cancel, running](
                     const PreparedPicture& picture, data::Dataset& resident, std::int64_t queue_us,
                     Loading loading) {
    auto drawn = run_guarded<session::Drawn>("a frame", cancel, [&] {
      return draw(backend, picture, resident, queue_us, loading, cancel);
    });
    if (drawn) drawn->loaded = loading == Loading::allowed;
    running->reply(ticket, std::move(drawn));
  };
  drawing.fail = [ticket = effect.ticket, running](const Error& error) {
    running->reply(ticket, error);
  };
  // Jobs of streams are refused at shutdown only.
  if (const auto queued = submit(backend_, std::move(drawing)); !queued) {
    running->reply(effect.ticket, queued.error());
  }
}

namespace {

// Of a dataset that a stream can show: not of one whose fields can only be probed. Errors: those of
// Catalogue::describe(), out_of_memory.
Result<protocol::DatasetDescription> describe_shown(Catalogue& catalogue, const std::string& id,
                                                    const CancelToken& cancel) {
  const auto dataset = catalogue.find(id);
  if (!dataset) return dataset.error();
  const auto unfit = scene::why_not_shown(**dataset);
  if (unfit && !unfit->empty()) {
    return make_error(ErrorKind::out_of_memory, "dataset " + in_quotes(id) + ": " + *unfit);
  }
  return catalogue.describe(id, cancel);
}

}  // namespace

void Viewer::start(const session::Describe& effect, DescribedReply reply) {
  const auto shared = std::make_shared<const DescribedReply>(std::move(reply));
  if (describing_.use_count() > describing_max) {
    const auto busy = make_error(ErrorKind::busy, "earlier requests to open datasets are pending");
    return (*shared)(effect.id, busy);
  }
  const auto dataset = backend_.catalogue.find(effect.dataset);
  const auto queued = backend_.loads.submit(
      {gone_,
       [&backend = backend_, effect, cancel = gone_, shared, one = describing_] {
         (*shared)(effect.id,
                   run_guarded<protocol::DatasetDescription>("a description", cancel, [&] {
                     return encoded(describe_shown(backend.catalogue, effect.dataset, cancel));
                   }));
       },
       true, dataset ? (*dataset)->shared_info() : nullptr});
  if (!queued) (*shared)(effect.id, queued.error());
}

void Viewer::start(const session::Prefetch& effect) {
  const auto found = find_shown(backend_.catalogue, effect.view);
  if (effect.steps.empty() || !found) {
    cancel_prefetch();
    return;
  }
  const auto of = (*found)->shared_info();
  {
    const std::lock_guard lock(requests_->mutex);
    if (requests_->of != of.get()) ++requests_->epoch;
    requests_->of = of.get();
    requests_->newest.emplace(PrefetchState::Newest{**found, effect});
    if (!requests_->queued.insert(of.get()).second) return;
  }
  // Completing the view finds its fields and levels but may block, so the job does it.
  const auto run = [&backend = backend_, owner = owner_, requests = requests_,
                    completion = completion_, key = of.get()] {
    resolve_prefetch(backend, owner, *requests, completion, key);
  };
  (void)backend_.loads.submit({gone_, run, true, of});
}

void Viewer::resolve_prefetch(Backend& backend, std::uint64_t owner, PrefetchState& requests,
                              const std::shared_ptr<ViewCompletion>& completion,
                              const data::DatasetInfo* of) {
  std::optional<PrefetchState::Newest> newest;
  std::uint64_t epoch = 0;
  {
    const std::lock_guard lock(requests.mutex);
    requests.queued.erase(of);
    if (!requests.newest || requests.of != of) return;
    newest = std::exchange(requests.newest, std::nullopt);
    epoch = requests.epoch;
  }
  auto found = run_guarded<std::vector<data::PrefetchRequest>>("prefetch", {}, [&] {
    return prefetch_requests_of(newest->dataset, newest->effect, *completion);
  });
  const std::lock_guard lock(requests.mutex);
  if (found && requests.epoch == epoch)
    backend.catalogue.store().request_prefetch(owner, std::move(*found));
}

void Viewer::cancel_prefetch() {
  const std::lock_guard lock(requests_->mutex);
  requests_->newest.reset();
  requests_->of = nullptr;
  ++requests_->epoch;
  backend_.catalogue.store().request_prefetch(owner_, {});
}

void Viewer::start(const session::Hide& /*effect*/) { loads_->withdraw(backend_, owner_, false); }

void Viewer::start(const session::Calibrate& effect) {
  calibration_.cancel();
  calibration_ = CancelToken();
  submit_calibration(backend_, owner_, effect.view, completion_, calibration_);
}

void Viewer::cancel(std::uint64_t ticket) {
  const auto found = running_.find(ticket);
  if (found == running_.end()) return;
  const auto running = found->second;
  running->cancel.cancel();
  const unsigned before = running->events.fetch_or(Running::was_cancelled);
  if ((before & Running::waits_for_data) == 0 || running->as_video) return;
  running->reply(ticket, frame_cancelled());
}

void Viewer::cancel_all() {
  gone_.cancel();
  calibration_.cancel();
  cancel_prefetch();
  loads_->withdraw(backend_, owner_, true);
  for (const auto& [ticket, running] : running_) running->cancel.cancel();
}

}  // namespace windsplat::tasks
