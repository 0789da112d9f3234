// Posts a handler to the io thread from another thread; retries when memory runs out.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <chrono>
#include <memory>
#include <new>
#include <thread>
#include <utility>

namespace windsplat::transport {

inline bool runs_here(const boost::asio::io_context::executor_type& executor) {
  return executor.running_in_this_thread();
}
inline bool runs_here(const boost::asio::any_io_executor& executor) {
  const auto* const io = executor.target<boost::asio::io_context::executor_type>();
  return io != nullptr && io->running_in_this_thread();
}

constexpr std::chrono::milliseconds post_retry{10};
constexpr std::chrono::milliseconds post_patience{5000};

// If allocation fails, blocks and retries up to this limit. On the io thread, which alone can free
// memory, the handler is called at once instead. The handler is destroyed by the thread that runs
// it. False: the handler was given up and destroyed on this thread.
template <class Executor, class Handler>
bool post_or_retry(const Executor& executor, Handler handler,
                   std::chrono::milliseconds patience = post_patience) {
  const auto until = std::chrono::steady_clock::now() + patience;
  std::shared_ptr<Handler> held;
  while (true) {
    try {
      if (!held) held = std::make_shared<Handler>(std::move(handler));
      boost::asio::post(executor, [held] {
        Handler own = std::move(*held);
        own();
      });
      return true;
    } catch (const std::bad_alloc&) {
      if (runs_here(executor)) {
        held ? (*held)() : handler();
        return true;
      }
      if (std::chrono::steady_clock::now() >= until) return false;
      std::this_thread::sleep_for(post_retry);
    }
  }
}

}  // namespace windsplat::transport
