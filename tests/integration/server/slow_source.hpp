// Slow data sources that block at a gate while they are read.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"

namespace server_test {

// Blocks every caller until it is opened.
class Gate {
 public:
  void open() { set(true); }
  void close() { set(false); }
  void pass() {
    std::unique_lock lock(mutex_);
    ++arrived_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return open_; });
  }
  // Waits until that many callers arrived; false on a timeout.
  bool wait_for(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [&] { return arrived_ >= count; });
  }
  int arrived() {
    const std::lock_guard lock(mutex_);
    return arrived_;
  }

 private:
  void set(bool open) {
    const std::lock_guard lock(mutex_);
    open_ = open;
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int arrived_ = 0;
};

// Another source behind a gate; ignores cancel(), like a hanging disk.
class SlowSource : public windsplat::data::Source {
 public:
  SlowSource(std::unique_ptr<windsplat::data::Source> source, std::shared_ptr<Gate> gate)
      : source_(std::move(source)), gate_(std::move(gate)) {}
  [[nodiscard]] const windsplat::data::DatasetInfo& info() const override {
    return source_->info();
  }
  windsplat::Result<windsplat::data::Volume> read(std::size_t field, std::size_t step) override {
    gate_->pass();
    return source_->read(field, step);
  }

 private:
  std::unique_ptr<windsplat::data::Source> source_;
  std::shared_ptr<Gate> gate_;
};

}  // namespace server_test
