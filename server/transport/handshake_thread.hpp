// Thread that computes TLS handshakes, round robin over client addresses, so that handshakes block
// neither the io thread nor other addresses.
#pragma once

#include <atomic>
#include <boost/asio/execution/blocking.hpp>
#include <boost/asio/execution/context.hpp>
#include <boost/asio/execution_context.hpp>
#include <condition_variable>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace windsplat::transport {

// Thread-safe. Runs one step at a time: steps of an address in order, addresses in turn.
class HandshakeThread {
 public:
  HandshakeThread();
  ~HandshakeThread();
  HandshakeThread(const HandshakeThread&) = delete;
  HandshakeThread& operator=(const HandshakeThread&) = delete;

  // Strong exception guarantee if an allocation fails. Exceptions of a step are logged. `owner`:
  // for drop().
  template <class Body>
  void submit(const std::string& address, Body body, const void* owner = nullptr) {
    add(address, owner, std::make_unique<Holds<Body>>(std::move(body)));
  }
  // Removes the owner's waiting steps on the calling thread. Does not allocate.
  void drop(const std::string& address, const void* owner);
  // Returns when the current step is done; waiting and later steps are dropped.
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
  struct Waiting {
    const void* owner = nullptr;
    std::unique_ptr<Step> step;
  };
  // Entries are allocated before locking and freed after it: the io thread must not wait for this
  // thread, which has low priority.
  using Lane = std::list<Waiting>;
  using Lanes = std::map<std::string, Lane>;  // none is empty

  void add(const std::string& address, const void* owner, std::unique_ptr<Step> step);
  std::unique_ptr<Step> next();  // blocks; null: shutdown
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  Lanes lanes_;
  std::string last_;  // last address served
  bool ended_ = false;
  std::thread thread_;
};

// Processor time of the calling thread, microseconds.
std::int64_t thread_cpu_us();

// One handshake as seen by the steps of its operation.
class HandshakeTask : public std::enable_shared_from_this<HandshakeTask> {
 public:
  HandshakeTask(HandshakeThread& thread, std::string address)
      : thread_(thread), address_(std::move(address)) {}
  virtual ~HandshakeTask() = default;
  HandshakeTask(const HandshakeTask&) = delete;
  HandshakeTask& operator=(const HandshakeTask&) = delete;

  // On the io thread. Keeps this alive until the step is done. After drop() the step and its
  // resources are released at once.
  template <class Step>
  void submit(Step step) {
    pay();
    if (dropped_) return;
    thread_.submit(
        address_,
        [task = shared_from_this(), step = std::move(step)]() mutable {
          if (!task->may_go_on()) return;
          const Timed timed(*task);
          step();
        },
        this);
  }

 protected:
  // On the io thread. Starts no further steps and removes waiting ones; the resources are released
  // with the last reference, after a running step at the latest.
  void drop() {
    dropped_ = true;
    thread_.drop(address_, this);
  }
  void begin_no_more() { dropped_ = true; }  // on the handshake thread
  [[nodiscard]] bool is_dropped() const { return dropped_; }
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  class Timed {  // charges the time of a step that throws, too
   public:
    explicit Timed(HandshakeTask& task) : task_(task) {}
    ~Timed() { task_.step_took(thread_cpu_us() - begin_); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

   private:
    HandshakeTask& task_;
    const std::int64_t begin_ = thread_cpu_us();
  };

  // On the handshake thread: before each step (false: the operation is dropped) and after it.
  virtual bool may_go_on() = 0;
  virtual void step_took(std::int64_t cpu_us) = 0;
  // On the io thread: charges the time of completed steps.
  virtual void pay() = 0;

  HandshakeThread& thread_;
  const std::string address_;
  std::atomic<bool> dropped_{false};
};

// Asio executor that runs the handlers of one handshake and keeps its task alive.
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

}  // namespace windsplat::transport
