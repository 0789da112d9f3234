// A series of small volumes whose reads are recorded, and a store of it.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "server/data/model/source.hpp"
#include "server/data/resident/store.hpp"

namespace windsplat::data::recorded {

inline constexpr std::size_t edge = 10;
inline constexpr std::uint64_t volume_bytes = edge * edge * edge * sizeof(float);
inline constexpr std::size_t last_step = 99;

// A field of 10 x 10 x 10 samples, 100 steps; sample n of step s is s + n / 1000, of the last step
// s + n / 125. Records what is read and when.
class Series : public Source {
 public:
  struct Log {
    std::mutex mutex;
    std::vector<std::size_t> steps;
    std::atomic<bool> hold{false};
    bool heeds_cancel = false;
    std::size_t unreadable = last_step + 1;  // a step
    std::atomic<int> cancelled{0};
    std::atomic<int> released{0};
    [[nodiscard]] std::vector<std::size_t> read() {
      const std::lock_guard lock(mutex);
      return steps;
    }
  };
  explicit Series(std::shared_ptr<Log> log) : log_(std::move(log)) {
    for (Axis& axis : info_.grid.axes) {
      for (std::size_t i = 0; i < edge; ++i) axis.coordinates.push_back(static_cast<double>(i));
    }
    FieldInfo field;
    field.name = "f";
    field.components = {"f"};
    info_.fields.push_back(field);
    info_.steps.resize(last_step + 1);
    info_.id = "series";
  }
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  void cancel() override { ++log_->cancelled; }
  void release() override { ++log_->released; }
  Result<Volume> read(std::size_t /*field*/, std::size_t step) override {
    report_progress(0.25);
    while (log_->hold) std::this_thread::yield();
    if (log_->heeds_cancel && log_->cancelled > 0) {
      return make_error(ErrorKind::cancelled, "reading was cancelled");
    }
    {
      const std::lock_guard lock(log_->mutex);
      log_->steps.push_back(step);
    }
    if (step == log_->unreadable) return make_error(ErrorKind::bad_data, "a broken step");
    Volume volume;
    volume.dims = info_.grid.dims();
    volume.values = Samples(volume.samples());
    const float per_unit = step == last_step ? 125.0F : 1000.0F;
    for (std::size_t n = 0; n < volume.samples(); ++n) {
      volume.values[n] = static_cast<float>(step) + static_cast<float>(n) / per_unit;
    }
    finish_volume(volume);
    return volume;
  }

 private:
  DatasetInfo info_;
  std::shared_ptr<Log> log_;
};

struct Fixture {
  explicit Fixture(std::uint64_t volumes, Storage storage = Storage::float32)
      : store([&] {
          StoreOptions options;
          options.bytes_max = volumes * volume_bytes;
          options.storage = storage;
          options.open = [log = log](const Location&,
                                     const CancelToken&) -> Result<std::unique_ptr<Source>> {
            return std::unique_ptr<Source>(std::make_unique<Series>(log));
          };
          return options;
        }()),
        dataset(store.add(somewhere()).value()) {}

  static Location somewhere() {
    Location location;
    location.folder = "/";
    location.members = {{"s", "/s"}};
    location.stem = "series";
    return location;
  }

  void request_prefetch(const std::vector<std::size_t>& steps, std::uint64_t owner = 1) {
    std::vector<PrefetchRequest> requests;
    for (const std::size_t step : steps) requests.push_back({*dataset, "f", step, {}, {}});
    store.request_prefetch(owner, requests);
  }
  [[nodiscard]] bool is_resident(std::size_t step) const {
    return dataset->resident_only().volume("f", step).has_value();
  }
  // A volume is read before it is resident.
  void wait_until_resident(std::size_t step) const {
    for (int i = 0; i < 10000 && !is_resident(step); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  // Waits until that many volumes were read, or for ten seconds.
  void wait_for_reads(std::size_t count) const {
    for (int i = 0; i < 10000 && log->read().size() < count; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  void wait_until_reading() const {
    for (int i = 0; i < 10000 && !dataset->loading(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  // Time in which a thread with pending loads would have started.
  static void settle() { std::this_thread::sleep_for(std::chrono::milliseconds(50)); }

  std::shared_ptr<Series::Log> log = std::make_shared<Series::Log>();
  Store store;
  std::shared_ptr<Dataset> dataset;
};

}  // namespace windsplat::data::recorded
