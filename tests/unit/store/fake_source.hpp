// A source in memory whose reads can be blocked and made to fail.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <vector>

#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data {

// A source of 10 x 10 x 10 volumes in which every sample encodes field and step. It can be made to
// wait at a gate, and to fail.
class FakeSource : public Source {
 public:
  FakeSource() {
    for (Axis& axis : info_.grid.axes) {
      axis.coordinates = test::counting(10);
    }
    for (const char* name : {"a", "b", "c"}) {
      FieldInfo field;
      field.name = name;
      field.components = {name};
      info_.fields.push_back(field);
    }
    FieldInfo vector;
    vector.name = "v";
    vector.kind = FieldKind::vector;
    vector.components = {"a", "b", "c"};
    info_.fields.push_back(vector);
    info_.steps.resize(100);
  }
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t step) override {
    const int inside = inside_.fetch_add(1) + 1;
    EXPECT_EQ(inside, 1) << "a source is not thread-safe";
    if (gate != nullptr) {
      gate->wait();
    }
    inside_.fetch_sub(1);
    if (failures > 0) {
      --failures;
      return make_error(ErrorKind::bad_data, "read failed");
    }
    if (throws_logic) {
      throw std::logic_error("a bug");
    }
    if (throws_memory) {
      throw std::bad_alloc();
    }
    Volume volume;
    volume.dims = {10, 10, 10};
    volume.components = static_cast<int>(info_.fields[field].components.size());
    volume.values =
        std::vector<float>(volume.samples() * static_cast<std::size_t>(volume.components),
                           static_cast<float>(field * 1000 + step));
    finish_volume(volume);
    return volume;
  }

  // Blocks readers until it is opened.
  class Gate {
   public:
    void wait() {
      std::unique_lock lock(mutex_);
      ++waiting_;
      changed_.notify_all();
      changed_.wait(lock, [this] { return open_; });
    }
    void open() {
      const std::lock_guard lock(mutex_);
      open_ = true;
      changed_.notify_all();
    }
    void wait_for_reader() {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return waiting_ > 0; });
    }

   private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool open_ = false;
    int waiting_ = 0;
  };

  DatasetInfo& change() { return info_; }

  std::shared_ptr<Gate> gate;
  int failures = 0;
  bool throws_logic = false;
  bool throws_memory = false;

 private:
  DatasetInfo info_;
  std::atomic<int> inside_{0};
};

}  // namespace windsplat::data
