// Renders and loads requested by a session: throttles them by the quota of its address, and posts
// their results to the io thread.
#pragma once

#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/access/admission.hpp"
#include "server/session/effects.hpp"
#include "server/tasks/viewer.hpp"
#include "server/transport/websocket/stream_owner.hpp"

namespace windsplat::transport {

class SessionWork {
 public:
  SessionWork(StreamOwner& owner, const boost::asio::any_io_executor& executor,
              tasks::Backend& backend, access::Admission& admission, const std::string& address,
              tasks::DrawnReply on_rendered, tasks::DescribedReply on_described);

  // A throttled address receives its frames later; a long delay closes the session.
  void start(const session::StartRender& effect);
  void start(const session::Describe& effect);
  void start(const session::Prefetch& effect) { viewer_.start(effect); }
  void start(const session::Calibrate& effect) { viewer_.start(effect); }
  void start(const session::EndVideo& effect) { viewer_.start(effect); }
  void start(const session::Hide& effect) { viewer_.start(effect); }
  void cancel(std::uint64_t ticket);
  void stop();

  // A result could not be posted to the io thread.
  [[nodiscard]] bool has_lost_reply() const { return *reply_lost_; }

 private:
  template <class Body>
  auto back(Body body);
  void begin(const session::StartRender& effect);
  void begin_throttled();

  StreamOwner& owner_;
  const boost::asio::any_io_executor executor_;
  access::Admission& admission_;
  const std::string& address_;
  tasks::Viewer viewer_;
  tasks::DrawnReply on_rendered_;
  tasks::DescribedReply on_described_;
  boost::asio::steady_timer timer_;
  std::optional<session::StartRender> throttled_;  // starts when timer_ expires
  const std::shared_ptr<std::atomic<bool>> reply_lost_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace windsplat::transport
