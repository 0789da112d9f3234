#include "server/transport/http/request_work.hpp"

#include <chrono>
#include <utility>

#include "server/transport/http/awaited_reply.hpp"
#include "server/transport/http/http_session.hpp"
#include "server/transport/http/packed_reply.hpp"

namespace windsplat::transport {
namespace {

constexpr std::chrono::milliseconds look_interval{40};

}  // namespace

RequestWork::RequestWork(HttpOwner& owner, HttpWire& wire)
    : owner_(owner), wire_(wire), timer_(wire.wire().get_executor()) {}

void RequestWork::start(const HttpContext& context, CurrentRequest& current) {
  awaited_ = true;
  look();
  const auto awaited =
      std::make_shared<AwaitedReply>(owner_, wire_.wire().get_executor(), reply_lost_);
  const http::Reply reply = [awaited](http::Response response) {
    awaited->answer(std::move(response));
  };
  context.router.route(current.request, packed_reply(context.packing, current.request, reply));
}

bool RequestWork::finish() {
  if (!awaited_) return false;
  awaited_ = false;
  timer_.cancel();
  return true;
}

// Unread data, such as a pipelined request, hides the end of stream from a read.
void RequestWork::look() {
  timer_.expires_after(look_interval);
  timer_.async_wait(owner_.handler([this](ErrorCode fault) {
    if (fault || !awaited_) return;
    if (*reply_lost_) return owner_.abort();
    if (wire_.peer_has_left()) return owner_.on_end();
    look();
  }));
}

}  // namespace windsplat::transport
