#include "server/transport/websocket/session_work.hpp"

#include <chrono>
#include <utility>

#include "server/transport/post_or_retry.hpp"

namespace windsplat::transport {
namespace {

constexpr std::chrono::seconds throttle_max{10};

}  // namespace

SessionWork::SessionWork(StreamOwner& owner, const boost::asio::any_io_executor& executor,
                         tasks::Backend& backend, access::Admission& admission,
                         const std::string& address, tasks::DrawnReply on_rendered,
                         tasks::DescribedReply on_described)
    : owner_(owner),
      executor_(executor),
      admission_(admission),
      address_(address),
      viewer_(backend, owner.id(), address),
      on_rendered_(std::move(on_rendered)),
      on_described_(std::move(on_described)),
      timer_(executor) {}

// A callback that may run on any thread and after the session ended. Holds the session weakly,
// since the renderer must not destroy it; the io thread checks whether it still exists.
template <class Body>
auto SessionWork::back(Body body) {
  return [weak = owner_.weak_from_this(), executor = executor_, lost = reply_lost_, body](
             auto number, auto result) {
    const bool posted =
        post_or_retry(executor, [weak, body, number, result = std::move(result)]() mutable {
          const auto owner = weak.lock();
          if (!owner || owner->has_ended()) return;
          guarded(owner, [&] { body(number, std::move(result)); })();
        });
    if (!posted) *lost = true;
  };
}

void SessionWork::start(const session::StartRender& effect) {
  const std::chrono::microseconds wait(admission_.throttle_delay(address_));
  if (wait.count() == 0) return begin(effect);
  if (wait > throttle_max) {
    return owner_.close(close_full, "this address exceeded its quota; try again in " +
                                        std::to_string(wait / std::chrono::seconds(1)) + " s");
  }
  throttled_ = effect;
  timer_.expires_after(wait);
  timer_.async_wait(owner_.handler([this](const boost::system::error_code& fault) {
    if (!fault && throttled_) begin_throttled();
  }));
}

void SessionWork::begin_throttled() {
  const auto effect = std::exchange(throttled_, std::nullopt);
  if (owner_.is_open()) begin(*effect);
}

void SessionWork::begin(const session::StartRender& effect) {
  viewer_.start(effect, back([this](std::uint64_t ticket, Result<session::Drawn> drawn) {
                  viewer_.done(ticket);
                  on_rendered_(ticket, std::move(drawn));
                }));
}

void SessionWork::start(const session::Describe& effect) {
  viewer_.start(effect,
                back([this](std::uint32_t id, Result<protocol::DatasetDescription> description) {
                  on_described_(id, std::move(description));
                }));
}

void SessionWork::cancel(std::uint64_t ticket) {
  if (throttled_ && throttled_->ticket == ticket) begin_throttled();  // waiting for a reply
  viewer_.cancel(ticket);
}

void SessionWork::stop() {
  viewer_.cancel_all();
  timer_.cancel();
}

}  // namespace windsplat::transport
