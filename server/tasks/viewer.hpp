// Requests of a session to the renderer and the loader; results return by callback.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "server/session/effects.hpp"
#include "server/tasks/backend.hpp"
#include "server/tasks/view_completion.hpp"

namespace windsplat::tasks {

// Called on a thread of the renderer or the loader, or synchronously.
using DrawnReply = std::function<void(std::uint64_t ticket, Result<session::Drawn>)>;
using DescribedReply = std::function<void(std::uint32_t id, Result<protocol::DatasetDescription>)>;

// The jobs of one session. Used by the io thread only.
class Viewer {
 public:
  // `payer`: the address charged with render time.
  Viewer(Backend& backend, std::uint64_t owner, std::string payer);
  ~Viewer() { cancel_all(); }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void start(const session::StartRender& effect, DrawnReply reply);
  void start(const session::Describe& effect, DescribedReply reply);
  // Prefetches the steps that may be needed next, as far as memory allows.
  void start(const session::Prefetch& effect);
  // Measures time and error of the settings for a view while the renderer is idle.
  void start(const session::Calibrate& effect);
  void start(const session::EndVideo& /*effect*/) { video_.reset(); }
  // Withdraws what moving frames asked for.
  void start(const session::Hide& effect);
  // A render that waits for data replies at once.
  void cancel(std::uint64_t ticket);
  void done(std::uint64_t ticket) { running_.erase(ticket); }
  void cancel_all();

 private:
  struct PrefetchState;
  static void resolve_prefetch(Backend& backend, std::uint64_t owner, PrefetchState& requests,
                               const std::shared_ptr<ViewCompletion>& completion,
                               const data::DatasetInfo* of);
  void cancel_prefetch();

  Backend& backend_;
  const std::uint64_t owner_;
  const std::string payer_;
  data::ChosenDatasets::Use shown_;       // of the dataset of the newest picture
  data::ChosenDatasets::Use subtracted_;  // of the one that it subtracts
  struct Running;
  std::map<std::uint64_t, std::shared_ptr<Running>> running_;  // keyed by ticket
  std::shared_ptr<PrefetchState> requests_;  // shared with the jobs that evaluate them
  // Shared with jobs.
  std::shared_ptr<ViewCompletion> completion_ = std::make_shared<ViewCompletion>();
  CancelToken gone_;  // cancels descriptions
  std::shared_ptr<const char> describing_ =
      std::make_shared<const char>();  // held by each description job
  struct Loads;
  std::shared_ptr<Loads> loads_;  // shared with the jobs that renew them
  struct Video;
  std::shared_ptr<Video> video_;  // shared with the job that uses it
  CancelToken calibration_;       // cancels the latest calibration
};

}  // namespace windsplat::tasks
