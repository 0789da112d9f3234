// Where the values of a dataset come from: one implementation for each format.
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/stamp.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

// How much of a read is done, from 0 to 1.
using Progress = std::function<void(double done)>;

// Where a dataset's numbers come from: one implementation a format. Called under the store's lock
// for that dataset, so it need not be thread-safe itself, but for cancel().
class Source {
 public:
  virtual ~Source() = default;
  [[nodiscard]] virtual const DatasetInfo& info() const = 0;
  // field indexes info().fields; 0 <= step < info().steps.size().
  virtual Result<Volume> read(std::size_t field, std::size_t step) = 0;
  // From any thread: a read in work ends soon, with cancelled, where the source can do that.
  virtual void cancel() {}
  // Releases what is cached for the next read; called when the dataset is idle.
  virtual void release() {}
  // Files that were opened for it besides those that its location names, as they were then.
  [[nodiscard]] virtual std::vector<Companion> companions() const { return {}; }
  // From now on called during reads, on the thread that reads.
  virtual void on_progress(Progress progress) { progress_ = std::move(progress); }

 protected:
  void report_progress(double done) const {
    if (progress_) progress_(done);
  }

 private:
  Progress progress_;
};

// A source that reads files. It fills memory of the caller's, so that a process apart can read into
// memory that is shared.
class FileSource : public Source {
 public:
  // All components of a field at a step, as whole arrays one after another, into `out`, which holds
  // zeros. Masked samples become NaN; what is infinite counts as masked too (finish_volume).
  virtual Result<void> fill(std::size_t field, std::size_t step, float* out) = 0;
  // fill(), then finish_volume().
  Result<Volume> read(std::size_t field, std::size_t step) override;
};

}  // namespace windsplat::data
