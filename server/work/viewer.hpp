// What a viewer's session asks of the renderer: jobs out, answers back by callback.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "server/session/effects.hpp"
#include "server/work/backend.hpp"

namespace windsplat::net {

// Called on a thread of the renderer's or the loader's, or at once.
using DrawnReply = std::function<void(std::uint64_t ticket, Result<session::Drawn>)>;
using DescribedReply = std::function<void(std::uint32_t id, Result<protocol::DatasetDescription>)>;

// The jobs of one session. Used by the io thread alone.
class Viewer {
 public:
  // `payer`: the address that drawing is charged to.
  Viewer(Backend& backend, std::uint64_t owner, std::string payer);
  ~Viewer() { cancel_all(); }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void start(const session::StartRender& effect, DrawnReply reply);
  void start(const session::Describe& effect, DescribedReply reply);
  // Has the steps that may come next made resident, as far as memory goes.
  void start(const session::Prefetch& effect);
  // Learns what settings cost and err for a view, while the renderer has nothing else to do.
  void start(const session::Calibrate& effect);
  void cancel(std::uint64_t ticket);
  void done(std::uint64_t ticket) { running_.erase(ticket); }
  void cancel_all();

 private:
  struct PrefetchState;
  static void resolve_prefetch(Backend& backend, std::uint64_t owner, PrefetchState& requests,
                               const data::DatasetInfo* of);
  void cancel_prefetch();

  Backend& backend_;
  const std::uint64_t owner_;
  const std::string payer_;
  std::map<std::uint64_t, CancelToken> running_;  // by ticket
  std::shared_ptr<PrefetchState> requests_;       // shared with the jobs that work them out
  CancelToken gone_;                              // for descriptions
  std::shared_ptr<const char> describing_ = std::make_shared<const char>();  // held by each
  CancelToken calibration_;  // the last one that was asked for
};

}  // namespace windsplat::net
