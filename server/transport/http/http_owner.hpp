// The interface of an HTTP session to its parts and to the reply to its request.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "server/http/exchange.hpp"
#include "server/transport/guarded.hpp"
#include "server/transport/stream.hpp"

namespace windsplat::transport {

class HttpOwner : public std::enable_shared_from_this<HttpOwner> {
 public:
  HttpOwner() = default;
  virtual ~HttpOwner() = default;
  HttpOwner(const HttpOwner&) = delete;
  HttpOwner& operator=(const HttpOwner&) = delete;

  [[nodiscard]] virtual const std::string& request_id() const = 0;
  virtual void on_header() = 0;   // of a request, without its body
  virtual void on_request() = 0;  // complete
  virtual void on_reply(http::Response response) = 0;
  virtual void on_written(ErrorCode fault) = 0;  // the response
  virtual void on_end() = 0;                     // end of stream or a connection error
  // Sends a response after which the connection is closed.
  virtual void refuse(http::Response response) = 0;
  virtual void abort() = 0;  // end immediately
  virtual void close() = 0;  // the deadline has passed, or the connection has failed

  // A completion handler that keeps the session alive.
  template <class Body>
  auto handler(Body body) {
    return guarded(shared_from_this(), std::move(body));
  }
};

}  // namespace windsplat::transport
