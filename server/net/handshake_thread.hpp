// The thread that computes TLS handshakes: addresses take turns there, so that neither the
// network's thread nor another address waits for what one asks for.
#pragma once

#include <boost/asio/execution/blocking.hpp>
#include <boost/asio/execution/context.hpp>
#include <boost/asio/execution_context.hpp>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace windsplat::net {

// Thread-safe. One step at a time; those of an address in their order, addresses in turn.
class HandshakeThread {
 public:
  HandshakeThread();
  ~HandshakeThread();
  HandshakeThread(const HandshakeThread&) = delete;
  HandshakeThread& operator=(const HandshakeThread&) = delete;

  // Where memory fails nothing has changed. What a step throws is logged.
  template <class Body>
  void submit(const std::string& address, Body body) {
    add(address, std::make_unique<Holds<Body>>(std::move(body)));
  }
  // Returns when the step under way is done; those that wait are dropped, as are further ones.
  void stop();

 private:
  struct Step {
    virtual ~Step() = default;
    virtual void run() = 0;
  };
  template <class Body>
  struct Holds final : Step {
    explicit Holds(Body given) : body(std::move(given)) {}
    void run() override { body(); }
    Body body;
  };
  using Lanes = std::map<std::string, std::deque<std::unique_ptr<Step>>>;  // none is empty

  void add(const std::string& address, std::unique_ptr<Step> step);
  std::unique_ptr<Step> next();  // waits for it; null: the end
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  Lanes lanes_;
  std::string last_;  // address that had its turn
  bool ended_ = false;
  std::thread thread_;
};

// Processor time of the calling thread, microseconds.
std::int64_t thread_cpu_us();

// One handshake, as the steps of its operation see it. On the handshake thread alone.
class HandshakeTask : public std::enable_shared_from_this<HandshakeTask> {
 public:
  HandshakeTask(HandshakeThread& thread, std::string address)
      : thread_(thread), address_(std::move(address)) {}
  virtual ~HandshakeTask() = default;
  HandshakeTask(const HandshakeTask&) = delete;
  HandshakeTask& operator=(const HandshakeTask&) = delete;

  // Keeps this alive until the step is done.
  template <class Step>
  void submit(Step step) {
    thread_.submit(address_, [task = shared_from_this(), step = std::move(step)]() mutable {
      if (!task->may_go_on()) return;
      const std::int64_t begin = thread_cpu_us();
      step();
      task->step_took(thread_cpu_us() - begin);
    });
  }

 private:
  virtual bool may_go_on() = 0;  // before each step; false: the operation is dropped
  virtual void step_took(std::int64_t cpu_us) = 0;

  HandshakeThread& thread_;
  const std::string address_;
};

// Of Asio: where the handlers of one handshake run, which keep its task alive.
class HandshakeExecutor {
 public:
  HandshakeExecutor(HandshakeTask& task, boost::asio::execution_context& context) noexcept
      : task_(&task), context_(&context) {}

  template <class Function>
  void execute(Function function) const {
    task_->submit(std::move(function));
  }

  boost::asio::execution_context& query(boost::asio::execution::context_t /*of*/) const noexcept {
    return *context_;
  }
  static constexpr boost::asio::execution::blocking_t query(
      boost::asio::execution::blocking_t /*of*/) noexcept {
    return boost::asio::execution::blocking.never;
  }
  bool operator==(const HandshakeExecutor&) const noexcept = default;

 private:
  HandshakeTask* task_;
  boost::asio::execution_context* context_;
};

}  // namespace windsplat::net
