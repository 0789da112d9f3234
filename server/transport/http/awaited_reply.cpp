#include "server/transport/http/awaited_reply.hpp"

#include <exception>
#include <utility>

#include "server/transport/post_or_retry.hpp"

namespace windsplat::transport {

AwaitedReply::AwaitedReply(HttpOwner& owner, boost::asio::any_io_executor executor,
                           std::shared_ptr<std::atomic<bool>> lost)
    : owner_(owner.weak_from_this()), executor_(std::move(executor)), lost_(std::move(lost)) {}

template <class Body>
void AwaitedReply::tell(Body body) {
  const bool posted = post_or_retry(executor_, [weak = owner_, body = std::move(body)]() mutable {
    if (const auto owner = weak.lock()) body(*owner);
  });
  if (!posted) *lost_ = true;
}

AwaitedReply::~AwaitedReply() {
  if (answered_) return;
  try {
    tell([](HttpOwner& owner) { owner.abort(); });
  } catch (const std::exception&) {
    *lost_ = true;
  }
}

void AwaitedReply::answer(http::Response response) {
  if (answered_) return;
  answered_ = true;
  tell([response = std::move(response)](HttpOwner& owner) mutable {
    guarded(owner.shared_from_this(), [&] { owner.on_reply(std::move(response)); })();
  });
}

}  // namespace windsplat::transport
