#include "server/convert/workers.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <thread>
#include <utility>

namespace windsplat::convert {

namespace {

class Workers {
 public:
  Workers(const data::DatasetInfo& info, const Plan& plan, const Shares& shares, const Open& open,
          const std::filesystem::path& store, const Task& task, const CancelToken& cancel,
          const ShowDone& progress)
      : info_(info),
        plan_(plan),
        shares_(shares),
        open_(open),
        store_(store),
        task_(task),
        cancel_(cancel),
        progress_(progress),
        sources_(shares.workers) {
    for (const std::size_t unit : task.units) samples_ += plan.box_of(plan.units[unit]).samples();
  }

  Result<std::uint64_t> run() {
    {
      std::vector<std::jthread> threads;
      running_ = shares_.workers;
      for (unsigned n = 0; n < shares_.workers; ++n) threads.emplace_back([this, n] { work(n); });
      watch();
    }
    if (error_) return *error_;
    return read_bytes_;
  }

 private:
  // Ends reads that are under way once the run is cancelled, or a worker has failed.
  void watch() {
    constexpr std::chrono::milliseconds look_every{50};
    std::unique_lock lock(mutex_);
    while (running_ > 0) {
      changed_.wait_for(lock, look_every);
      if (!cancel_.cancelled() && !error_) continue;
      stop_.cancel();
      for (const auto& source : sources_) {
        if (source) source->cancel();
      }
    }
  }

  void work(unsigned n) {
    auto done = guarded(n);
    const std::lock_guard lock(mutex_);
    if (!done) {
      // The first one is the reason for those that follow it.
      if (!error_) error_ = done.error();
      stop_.cancel();
    }
    --running_;
    changed_.notify_all();
  }

  Result<void> guarded(unsigned n) {
    try {
      return work_on(n);
    } catch (const std::bad_alloc&) {
      return make_error(ErrorKind::out_of_memory, "the machine has no memory left");
    } catch (const std::exception& fault) {
      return make_error(ErrorKind::internal, "converting failed: " + printable(fault.what()));
    }
  }

  Result<void> work_on(unsigned n) {
    auto source = open_(shares_.loader_bytes);
    if (!source) return source.error();
    if ((*source)->info().digest != info_.digest) {
      return make_error(ErrorKind::bad_data,
                        in_quotes(info_.source) + " has changed since it was opened");
    }
    {
      const std::lock_guard lock(mutex_);
      sources_[n] = std::move(*source);
    }
    Reader reader(*sources_[n]);
    while (true) {
      const std::size_t at = next_++;
      if (at >= task_.units.size()) return {};
      if (cancel_.cancelled() || stop_.cancelled()) {
        return make_error(ErrorKind::cancelled, "interrupted");
      }
      const std::size_t unit = task_.units[at];
      auto files = make_unit(plan_, unit, store_, reader, shares_.across, stop_);
      if (!files) return files.error();
      if (auto done = task_.take(unit, std::move(*files)); !done) return done;
      count(unit);
    }
  }

  void count(std::size_t unit) {
    const Unit& made = plan_.units[unit];
    const std::size_t samples = plan_.box_of(made).samples();
    const std::lock_guard lock(mutex_);
    samples_done_ += samples;
    read_bytes_ +=
        samples * static_cast<std::size_t>(plan_.fields[made.field].components) * sizeof(float);
    progress_(static_cast<double>(samples_done_) / static_cast<double>(samples_));
  }

  const data::DatasetInfo& info_;
  const Plan& plan_;
  const Shares& shares_;
  const Open& open_;
  const std::filesystem::path& store_;
  const Task& task_;
  CancelToken cancel_;
  const ShowDone& progress_;
  CancelToken stop_;  // of this run alone
  std::atomic<std::size_t> next_{0};
  std::uint64_t samples_ = 0;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::vector<std::unique_ptr<data::Source>> sources_;
  std::optional<Error> error_;
  unsigned running_ = 0;
  std::uint64_t samples_done_ = 0;
  std::uint64_t read_bytes_ = 0;
};

}  // namespace

Result<std::uint64_t> make_units(const data::DatasetInfo& info, const Plan& plan,
                                 const Shares& shares, const Open& open,
                                 const std::filesystem::path& store, const Task& task,
                                 const CancelToken& cancel, const ShowDone& progress) {
  return Workers(info, plan, shares, open, store, task, cancel, progress).run();
}

}  // namespace windsplat::convert
