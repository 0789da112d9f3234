// The work of a request: passed to the router, its reply awaited until the client leaves.
#pragma once

#include <atomic>
#include <boost/asio/steady_timer.hpp>
#include <memory>

#include "server/transport/http/current_request.hpp"
#include "server/transport/http/http_owner.hpp"
#include "server/transport/http/http_wire.hpp"

namespace windsplat::transport {

struct HttpContext;

class RequestWork {
 public:
  RequestWork(HttpOwner& owner, HttpWire& wire);

  // Ends in HttpOwner::on_reply(), or in on_end() if the client has disconnected.
  void start(const HttpContext& context, CurrentRequest& current);
  // The reply has arrived, or is awaited no longer. False: none is awaited.
  bool finish();
  void stop() { timer_.cancel(); }

 private:
  void look();

  HttpOwner& owner_;
  HttpWire& wire_;
  boost::asio::steady_timer timer_;
  bool awaited_ = false;
  // A response could not be posted to the io thread.
  const std::shared_ptr<std::atomic<bool>> reply_lost_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace windsplat::transport
