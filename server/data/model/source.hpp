// Source of the values of a dataset: one implementation per format.
#pragma once

#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/stamp.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

// The fraction of a read that is done, 0 to 1.
using Progress = std::function<void(double done)>;

// Source of the numbers of a dataset: one implementation per format. The store calls it under a
// lock per dataset, so it need not be thread-safe, except for cancel().
class Source {
 public:
  virtual ~Source() = default;
  [[nodiscard]] virtual const DatasetInfo& info() const = 0;
  // field is an index into info().fields; 0 <= step < info().steps.size().
  virtual Result<Volume> read(std::size_t field, std::size_t step) = 0;
  // A box of them, masked as by read(), with its own range, or of a stored level. Reads the whole
  // of fields that are not read by boxes (FieldInfo::box_chunk). Errors: those of read(); invalid:
  // a box beyond the grid, or a level that is not stored.
  virtual Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part);
  // May be called from any thread: a running read ends soon with the error cancelled, if the source
  // supports this.
  virtual void cancel() {}
  // Frees what is cached for the next read; called when the dataset is idle.
  virtual void release() {}
  // Files opened for the dataset besides those of its location, with their states at that time.
  [[nodiscard]] virtual std::vector<Companion> companions() const { return {}; }
  // Sets a function called during reads, on the reading thread.
  virtual void on_progress(Progress progress) { progress_ = std::move(progress); }

 protected:
  // Errors: invalid.
  [[nodiscard]] Result<void> check_part(std::size_t field, const StoredPart& part) const;
  void report_progress(double done) const {
    if (progress_) progress_(done);
  }

 private:
  Progress progress_;
};

// Some layers (samples of one z) of one component of a volume.
struct VolumePart {
  std::size_t component = 0;
  std::size_t first = 0;  // the lowest layer
  std::size_t layers = 0;
};

// Takes a volume part by part while it is read.
class PartTaker {
 public:
  virtual ~PartTaker() = default;
  // The most layers of a part; at least one.
  [[nodiscard]] virtual std::size_t layers_max() const = 0;
  // Memory for the values of the next part, which contains any numbers.
  virtual float* room() = 0;
  // Takes the values in room(), x fastest, then y, then z. Masked samples are NaN.
  virtual void take(const VolumePart& part) = 0;
};

// A source that reads files. It fills memory of the caller, so that a separate process can read
// into shared memory.
class FileSource : public Source {
 public:
  // Reads all components of a field at a step, as consecutive arrays, into `out`, which contains
  // zeros. Masked samples become NaN; infinite values are masked later (finish_volume()).
  virtual Result<void> fill(std::size_t field, std::size_t step, float* out) = 0;
  // Gives the values of fill() in parts, each layer of each component once, in any order. False:
  // the field has to be read as a whole, by fill(); no part was taken.
  virtual Result<bool> fill_in_parts(std::size_t /*field*/, std::size_t /*step*/,
                                     PartTaker& /*taker*/) {
    return false;
  }
  // Reads a part with all its components (components_of()), as fill() reads the whole; `out`
  // contains zeros. False: the field has to be read as a whole.
  virtual Result<bool> fill_part(std::size_t /*field*/, std::size_t /*step*/,
                                 const StoredPart& /*part*/, float* /*out*/) {
    return false;
  }
  // fill(), then finish_volume().
  Result<Volume> read(std::size_t field, std::size_t step) override;
  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override;
};

}  // namespace windsplat::data
