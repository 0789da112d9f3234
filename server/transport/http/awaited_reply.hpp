// The reply to a request in progress, posted back to the io thread.
#pragma once

#include <atomic>
#include <boost/asio/any_io_executor.hpp>
#include <memory>

#include "server/http/exchange.hpp"
#include "server/transport/http/http_owner.hpp"

namespace windsplat::transport {

// Holds the session weakly: it must not be destroyed on the renderer's thread; its timer keeps it
// alive while a response is pending. If the work is lost and no response arrives, the connection is
// closed; if there is too little memory to post that, `lost` is set, and the timer detects it.
class AwaitedReply {
 public:
  AwaitedReply(HttpOwner& owner, boost::asio::any_io_executor executor,
               std::shared_ptr<std::atomic<bool>> lost);
  ~AwaitedReply();
  AwaitedReply(const AwaitedReply&) = delete;
  AwaitedReply& operator=(const AwaitedReply&) = delete;

  void answer(http::Response response);  // any thread

 private:
  template <class Body>
  void tell(Body body);

  const std::weak_ptr<HttpOwner> owner_;
  const boost::asio::any_io_executor executor_;
  const std::shared_ptr<std::atomic<bool>> lost_;
  bool answered_ = false;
};

}  // namespace windsplat::transport
