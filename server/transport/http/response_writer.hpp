// The sending side of an HTTP session: one response at a time, counted and logged.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "server/transport/http/current_request.hpp"
#include "server/transport/http/http_owner.hpp"
#include "server/transport/http/http_wire.hpp"

namespace windsplat::transport {

struct HttpContext;

class ResponseWriter {
 public:
  // Responds to `current`, whose address is charged with the bytes sent.
  ResponseWriter(HttpOwner& owner, HttpWire& wire, const HttpContext& context,
                 CurrentRequest& current);

  // Ends in HttpOwner::on_written(). Decides whether the connection is kept alive.
  void send(http::Response response);
  // Call when the client disconnects before the response: counts and logs the request.
  void send_nothing();
  [[nodiscard]] bool is_sending() const { return sending_; }

 private:
  void on_sent(std::size_t bytes, std::chrono::steady_clock::time_point since);
  void log_access(int status, std::size_t bytes) const;

  HttpOwner& owner_;
  HttpWire& wire_;
  const HttpContext& context_;
  CurrentRequest& current_;
  http::Response response_;
  std::string head_;
  bool sending_ = false;
};

}  // namespace windsplat::transport
