// Takes the body of a request while it is received, for bodies that are never whole in memory.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "server/http/exchange.hpp"

namespace windsplat::http {

class BodySink {
 public:
  BodySink() = default;
  // Without the last of the body: what was taken is discarded.
  virtual ~BodySink() = default;
  BodySink(const BodySink&) = delete;
  BodySink& operator=(const BodySink&) = delete;

  // A refusal ends the request.
  using Done = std::function<void(std::optional<Response> refusal)>;
  // Takes the next bytes; may return before that is done. `done` is called once, from any thread;
  // further bytes are received after it.
  virtual void take(std::vector<std::byte> bytes, Done done) = 0;
  // Answers the request, once all of its body was taken.
  virtual void answer(const Request& request, Reply reply) = 0;
};

}  // namespace windsplat::http
