// Completion handlers of connections: an exception ends one connection and never leaves it hanging.
#pragma once

#include <exception>
#include <memory>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::transport {

// End the session first: logging may fail when memory is exhausted.
template <class Session>
void end_failed(Session& session, const char* fault) noexcept {
  try {
    session.abort();
  } catch (const std::exception&) {
    log::error("cannot close a connection");
  }
  try {
    log::error("connection failed", {{"request", session.request_id()}, {"fault", fault}});
  } catch (const std::exception&) {
    log::error("connection failed; no memory to log details");
  }
}

// A completion handler that keeps its session alive and ends only that session when something
// throws, even when an operation throws internally and destroys the handler without calling it: the
// session would otherwise wait forever.
template <class Session, class Body>
class Guarded {
 public:
  Guarded(std::shared_ptr<Session> session, Body body)
      : session_(std::move(session)), body_(std::move(body)) {}
  Guarded(Guarded&&) noexcept = default;
  Guarded(const Guarded&) = delete;
  Guarded& operator=(const Guarded&) = delete;
  Guarded& operator=(Guarded&&) = delete;
  ~Guarded() {
    if (session_ == nullptr || std::uncaught_exceptions() == 0) return;
    end_failed(*session_, "completion handler destroyed without a call");
  }

  template <class... Results>
  void operator()(Results&&... results) {
    const std::shared_ptr<Session> session = std::move(session_);
    try {
      body_(std::forward<Results>(results)...);
    } catch (const std::exception& fault) {
      end_failed(*session, fault.what());
    }
  }

 private:
  std::shared_ptr<Session> session_;
  Body body_;
};

template <class Session, class Body>
auto guarded(std::shared_ptr<Session> session, Body body) {
  return Guarded<Session, Body>(std::move(session), std::move(body));
}

}  // namespace windsplat::transport
