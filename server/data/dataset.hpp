// What a file or a built-in sample is once opened: its grid, what fields it holds, and a way to
// fetch one field at one step as an immutable Volume.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/stamp.hpp"
#include "server/data/samples.hpp"

namespace windsplat::data {

class Files;

enum class AxisKind { longitude, latitude, pressure, height, depth, level, cartesian };

// One axis of a rectilinear grid. Index 0 is west, south or bottom: readers turn every axis so
// that the index grows with the world coordinate (a pressure axis therefore descends in hPa).
struct Axis {
  std::string name;           // the dimension's name in the file
  std::string standard_name;  // CF, empty if none
  std::string units;          // as written in the file, empty if none
  AxisKind kind = AxisKind::cartesian;
  std::vector<double> coordinates;  // one a sample, strictly monotonic, in `units`
};

// Where each column of a grid stands whose longitudes and latitudes are 2-D: degrees, x fastest,
// all finite; longitudes continue from neighbour to neighbour, beyond 360 if need be.
struct Columns {
  std::vector<double> longitude;
  std::vector<double> latitude;
};

// x, y, z: always three axes; a dimension the data lacks has one coordinate.
struct Grid {
  std::array<Axis, 3> axes;
  std::shared_ptr<const Columns> columns;  // null: the axes say it all
  [[nodiscard]] std::array<int, 3> dims() const;
  [[nodiscard]] std::size_t samples() const;
};

enum class FieldKind { scalar, vector };

struct FieldInfo {
  std::string name;  // as the view names it: the variable's name, "wind" or the like for a vector
  FieldKind kind = FieldKind::scalar;
  std::vector<std::string> components;  // the file's variables, in x, y(, z) order; 1 for a scalar
  std::string units;                    // of a vector: its first component's
  std::vector<std::string> component_units;  // one a component; they may differ (m/s, Pa/s)
  std::string standard_name;
  std::string long_name;
  std::string dtype;     // of the file: "float32", "int16 packed", ...
  bool derived = false;  // made of other fields when it is asked for, not in the file
  // What is decoded to read one step, whole chunks counted; 0 where that is the volume itself.
  std::uint64_t decoded_bytes = 0;
  std::uint64_t chunk_bytes = 0;  // the largest chunk of it, decoded
};

// A variable of the file that is not shown, and why.
struct LeftOut {
  std::string name;
  std::string reason;
};

struct TimeStep {
  double value = 0;  // in the file's own unit
  std::string
      text;  // ISO 8601 where the calendar is understood ("2001-01-01T03:00:00Z"), else value
};

// One field at one step. Samples are x fastest, then y, then z; a vector's components follow each
// other as whole arrays. A masked sample is NaN (in a vector: in every component).
struct Volume {
  std::array<int, 3> dims{};
  int components = 1;  // 1 scalar, 2 a horizontal vector whose third component is zero, 3
  Samples values;
  std::array<float, 2> range{0, 0};  // of the values, or of a vector's magnitude; unmasked only
  std::int64_t masked = 0;

  [[nodiscard]] std::size_t samples() const {
    return static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
           static_cast<std::size_t>(dims[2]);
  }
  [[nodiscard]] const float* component(int c) const {
    return values.data() + static_cast<std::size_t>(c) * samples();
  }
  [[nodiscard]] std::size_t bytes() const { return values.size() * sizeof(float); }
};

// Counts masked samples, makes a vector's mask common to its components, sets range. Readers and
// samples call it last. Infinite values are masked too.
void finish_volume(Volume& volume);
// The two halves of it. Makes what is not finite NaN in all components; `values` as in Volume.
void mask_volume(float* values, std::size_t samples, int components);
// Sets range and masked. False if values are infinite, or NaN in some components only.
[[nodiscard]] bool measure_volume(Volume& volume);

// |V| of a sample in double, where the square of no float overflows; clamped to what a float can
// say.
float magnitude(const float* const* components, int count, std::size_t sample);

// Everything about a dataset that is known without loading a field.
struct DatasetInfo {
  std::string id;
  std::string title;
  std::string source;  // "built-in sample" or the file's name without its folder
  std::string format;  // "sample", "netCDF classic", "netCDF-4", "VTK image data", ...
  std::string digest;  // changes whenever the data may have changed
  Grid grid;
  std::vector<FieldInfo> fields;
  std::vector<LeftOut> left_out;
  std::vector<std::string> notes;  // what was done to the data: "resampled from 4096 cells ..."
  std::vector<TimeStep> steps;     // at least one
  std::string time_units;
  std::string time_calendar;       // CF; empty means standard
  std::uint64_t stored_bytes = 0;  // of the files opened by a loader; 0 for samples

  [[nodiscard]] const FieldInfo* find(const std::string& name) const;  // null if there is none
  [[nodiscard]] const FieldInfo* first(FieldKind kind) const;          // null if there is none
};

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
  // Gives back what is kept for the next read: nothing is read for a while.
  virtual void release() {}
  // Files that were opened for it besides those that its location names, as they were then.
  [[nodiscard]] virtual std::vector<Companion> companions() const { return {}; }
  // From now on called during reads, on the thread that reads.
  virtual void on_progress(Progress progress) { progress_ = std::move(progress); }

 protected:
  void tell_progress(double done) const {
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

// Built-in samples, made on the spot and deterministic. name: tornado, climate or efield.
// dims {0,0,0} and steps 0 mean the sample's own size.
Result<std::unique_ptr<Source>> open_sample(const std::string& name,
                                            std::array<int, 3> dims = {0, 0, 0}, int steps = 0);
std::vector<std::string> sample_names();

// A sample's name with a size of its own: "tornado:256" is a cube, "climate:640x320x38" a box, the
// bare name {0,0,0}. Empty: no sample is called so.
struct SizedSample {
  std::string name;
  std::array<int, 3> dims{};
};
std::optional<SizedSample> sized_sample(const std::string& text);

// Opens a dataset by the content of its files, whatever their names, in this process.
// Errors: not_found, bad_data, out_of_memory.
Result<std::unique_ptr<FileSource>> open_dataset(const std::shared_ptr<Files>& files);
// The same of a path or pattern (see locate()).
Result<std::unique_ptr<Source>> open_file(const std::string& path);

// Writes every field and step of a source as CF netCDF-4 that open_file reads back. Nothing is left
// behind where it fails or is cancelled. Errors: cancelled; those of reading and writing.
// Until it is whole the file has the name netcdf_part(path).
std::string netcdf_part(const std::string& path);
Result<void> write_netcdf(Source& source, const std::string& path, const CancelToken& cancel = {});

}  // namespace windsplat::data
