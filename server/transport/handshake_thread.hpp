// The thread that computes TLS handshakes: addresses take turns there, so that neither the
// network's thread nor another address waits for what one asks for.
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

namespace windsplat::net {

// Thread-safe. One step at a time; those of an address in their order, addresses in turn.
class HandshakeThread {
 public:
  HandshakeThread();
  ~HandshakeThread();
  HandshakeThread(const HandshakeThread&) = delete;
  HandshakeThread& operator=(const HandshakeThread&) = delete;

  // Where memory fails nothing has changed. What a step throws is logged. `owner`: for drop().
  template <class Body>
  void submit(const std::string& address, Body body, const void* owner = nullptr) {
    add(address, owner, std::make_unique<Holds<Body>>(std::move(body)));
  }
  // Lets go of the owner's steps that wait, on the calling thread. Needs no memory.
  void drop(const std::string& address, const void* owner);
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
  struct Waiting {
    const void* owner = nullptr;
    std::unique_ptr<Step> step;
  };
  // What goes in or out of them is made before the lock and freed after it: this thread's low
  // priority must not keep the io thread waiting.
  using Lane = std::list<Waiting>;
  using Lanes = std::map<std::string, Lane>;  // none is empty

  void add(const std::string& address, const void* owner, std::unique_ptr<Step> step);
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

// One handshake, as the steps of its operation see it.
class HandshakeTask : public std::enable_shared_from_this<HandshakeTask> {
 public:
  HandshakeTask(HandshakeThread& thread, std::string address)
      : thread_(thread), address_(std::move(address)) {}
  virtual ~HandshakeTask() = default;
  HandshakeTask(const HandshakeTask&) = delete;
  HandshakeTask& operator=(const HandshakeTask&) = delete;

  // On the io thread. Keeps this alive until the step is done. After drop() the step goes at once,
  // and with it what it holds.
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
  // On the io thread. Nothing is begun any more, and nothing waits for its turn: what this holds
  // goes with its last reference, for which only a step that runs now is waited.
  void drop() {
    dropped_ = true;
    thread_.drop(address_, this);
  }
  void begin_no_more() { dropped_ = true; }  // on the handshake thread
  [[nodiscard]] bool is_dropped() const { return dropped_; }
  [[nodiscard]] const std::string& address() const { return address_; }

 private:
  class Timed {  // a step that throws took its time, too
   public:
    explicit Timed(HandshakeTask& task) : task_(task) {}
    ~Timed() { task_.step_took(thread_cpu_us() - begin_); }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

   private:
    HandshakeTask& task_;
    const std::int64_t begin_ = thread_cpu_us();
  };

  // On the handshake thread: before each step (false: the operation is dropped), and after it.
  virtual bool may_go_on() = 0;
  virtual void step_took(std::int64_t cpu_us) = 0;
  // On the io thread: charges what the steps took that are done.
  virtual void pay() = 0;

  HandshakeThread& thread_;
  const std::string address_;
  std::atomic<bool> dropped_{false};
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
