// What a connection waits for, so that no fault in it reaches others, and none leaves it waiting.
#pragma once

#include <exception>
#include <memory>
#include <utility>

#include "server/base/log.hpp"

namespace windsplat::net {

// Ends it, and then says so: where memory is short there may be none for the words.
template <class Session>
void end_failed(Session& session, const char* fault) noexcept {
  try {
    session.abort();
  } catch (const std::exception&) {
    log::error("a connection could not be ended");
  }
  try {
    log::error("a connection failed", {{"request", session.request_id()}, {"fault", fault}});
  } catch (const std::exception&) {
    log::error("a connection failed, and there is no memory to say which");
  }
}

// A completion handler of a session: keeps it alive, and ends it alone when something throws. Also
// where an operation's own steps throw, which take the handler with them uncalled: what it was to
// go on with would never come.
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
    end_failed(*session_, "its next step was lost");
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

}  // namespace windsplat::net
