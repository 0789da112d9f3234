// One queue and a few threads, each of which takes the first task whose key is not in use.
#include "server/tasks/task_executor.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "server/tasks/run_guarded.hpp"

namespace windsplat::tasks {

struct TaskExecutor::State {
  using Clock = std::chrono::steady_clock;

  State(const Settings& settings, std::function<void()> told)
      : places(settings.threads),
        tasks_max(settings.tasks_max),
        what(settings.what),
        refused(std::move(told)) {}

  // Cannot throw: memory for its bookkeeping was allocated before.
  void work() {
    std::unique_lock lock(mutex);
    for (;;) {
      const auto next = next_task(lock);
      if (next == tasks.end()) return;
      std::optional<Task> task(std::move(*next));
      tasks.erase(next);
      // A cancelled task needs no free key.
      const std::shared_ptr<const void> key =
          task->cancel.cancelled() ? nullptr : std::move(task->key);
      if (key) busy.push_back(key);
      const Clock::time_point begun = Clock::now();
      running.push_back(begun);
      lock.unlock();
      try {
        task->run();
      } catch (const std::exception& fault) {
        log_fault("a task failed", fault, what);
      }
      task.reset();  // release what the task holds before locking
      lock.lock();
      if (key) busy.erase(std::find(busy.begin(), busy.end(), key));
      running.erase(std::find(running.begin(), running.end(), begun));
      wake.notify_all();
    }
  }

  // Waits for a task that may start; none at shutdown.
  std::deque<Task>::iterator next_task(std::unique_lock<std::mutex>& lock) {
    for (;;) {
      const auto next = first_free();
      if (next == tasks.end()) {
        if (ending && tasks.empty()) return next;
        wake.wait(lock);
      } else if (running.size() < places) {
        return next;
      } else {
        // The most recent tasks are limited to the number of places until one has run for
        // `long_run`.
        const Clock::time_point at = running[running.size() - places] + long_run;
        if (at <= Clock::now()) return next;
        wake.wait_until(lock, at);
      }
    }
  }

  // Requires the mutex.
  [[nodiscard]] std::deque<Task>::iterator first_free() {
    return std::find_if(tasks.begin(), tasks.end(), [this](const Task& task) {
      return !task.key || task.cancel.cancelled() ||
             std::find(busy.begin(), busy.end(), task.key) == busy.end();
    });
  }

  // Requires the mutex.
  [[nodiscard]] bool has_room(const Task& task) const {
    if (task.admitted) return true;
    Count all;
    Count same;
    for (const Task& known : tasks) {
      if (known.admitted || known.cancel.cancelled()) continue;
      const bool own = !task.payer.empty() && known.payer == task.payer;
      all.add(own);
      if (known.key == task.key) same.add(own);
    }
    return same.has_room(tasks_max) && all.has_room(keys_full * tasks_max);
  }

  struct Count {
    std::size_t tasks = 0;
    std::size_t own = 0;  // waiting tasks of this payer
    void add(bool is_own) {
      ++tasks;
      own += is_own ? 1U : 0U;
    }
    [[nodiscard]] bool has_room(std::size_t most) const {
      return tasks < most && own < std::max<std::size_t>(most / 2, 1);
    }
  };

  const std::size_t places;
  const std::size_t tasks_max;
  const char* const what;
  const std::function<void()> refused;
  std::mutex mutex;
  std::condition_variable wake;
  std::deque<Task> tasks;
  // Reserved for one entry per thread:
  std::vector<std::shared_ptr<const void>> busy;
  std::vector<Clock::time_point> running;  // start times, oldest first
  bool ending = false;
  std::vector<std::thread> threads;
};

TaskExecutor::TaskExecutor(const Settings& settings, std::function<void()> refused)
    : state_(std::make_unique<State>(settings, std::move(refused))) {
  const std::size_t threads = settings.threads + settings.threads_spare;
  state_->busy.reserve(threads);
  state_->running.reserve(threads);
  state_->threads.reserve(threads);
  try {
    for (std::size_t i = 0; i < threads; ++i) {
      state_->threads.emplace_back([state = state_.get()] { state->work(); });
    }
  } catch (...) {  // a thread could not be started: the destructor does not run
    end();
    throw;
  }
}

TaskExecutor::~TaskExecutor() { end(); }

Result<void> TaskExecutor::submit(Task task) {
  {
    const std::lock_guard lock(state_->mutex);
    if (state_->ending) return make_error(ErrorKind::draining, "the server is shutting down");
    if (!state_->has_room(task)) {
      if (state_->refused) state_->refused();
      return make_error(ErrorKind::busy,
                        std::string("too many ") + state_->what +
                            " are waiting, for this address or in total; try again");
    }
    state_->tasks.push_back(std::move(task));
  }
  state_->wake.notify_all();  // every waiting thread checks for a free slot
  return {};
}

void TaskExecutor::end() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ending = true;
    for (const Task& task : state_->tasks) task.cancel.cancel();
  }
  state_->wake.notify_all();
  for (std::thread& thread : state_->threads) {
    if (thread.joinable()) thread.join();
  }
}

}  // namespace windsplat::tasks
