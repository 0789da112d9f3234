// What a viewer's session asks of the renderer: jobs out, answers back by callback.
#pragma once

#include <cstdint>
#include <functional>
#include <map>

#include "server/net/router.hpp"
#include "server/session/effects.hpp"

namespace windsplat::net {

// Called on the renderer's thread.
using DrawnReply = std::function<void(std::uint64_t ticket, Result<session::Drawn>)>;
using DescribedReply = std::function<void(std::uint32_t id, Result<protocol::DatasetDescription>)>;

// The jobs of one session. Used by the io thread alone.
class Viewer {
 public:
  Viewer(Services& services, std::uint64_t owner) : services_(services), owner_(owner) {}
  ~Viewer() { cancel_all(); }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  void start(const session::StartRender& effect, DrawnReply reply);
  void start(const session::Describe& effect, DescribedReply reply);
  void cancel(std::uint64_t ticket);
  void done(std::uint64_t ticket) { running_.erase(ticket); }
  void cancel_all();

 private:
  Services& services_;
  const std::uint64_t owner_;
  std::map<std::uint64_t, CancelToken> running_;  // by ticket
  CancelToken gone_;                              // for descriptions
};

}  // namespace windsplat::net
