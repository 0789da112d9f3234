// Source -> CF 1.8 netCDF-4. Writes every field and step to a temporary file in the same folder and
// renames it when complete.
#include "server/data/formats/netcdf/writer.hpp"

#include <netcdf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "server/base/ascii.hpp"
#include "server/base/whole_file.hpp"
#include "server/data/cf/written/attributes.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "server/data/model/box.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

namespace {

constexpr int deflate_level = 1;  // higher levels are much slower for little gain
constexpr std::size_t chunk_bytes = std::size_t{4} << 20;
constexpr float fill_value = NC_FILL_FLOAT;

struct OutVariable : cf::WrittenVariable {
  int id = -1;
};

// Calls the library under its lock.
template <class Call>
Result<void> call(const char* what, Call&& library_call) {
  const netcdf::LibraryLock lock;
  const int status = std::forward<Call>(library_call)();
  if (status != NC_NOERR) {
    return make_error(ErrorKind::internal,
                      std::string("writing netCDF failed: ") + what + ": " + nc_strerror(status));
  }
  return {};
}

int put_texts(int ncid, int variable, const cf::WrittenAttributes& attributes) {
  int status = NC_NOERR;
  for (const auto& [name, text] : attributes) {
    if (status != NC_NOERR) break;
    status = nc_put_att_text(ncid, variable, name.c_str(), text.size(), text.c_str());
  }
  return status;
}

// Replaces "HDF error" with an error of a full disk if there is no space left.
Error with_room_left(Error error, const std::string& path) {
  std::error_code fault;
  const auto room = std::filesystem::space(std::filesystem::path(path).parent_path(), fault);
  if (!fault && error.kind == ErrorKind::internal) {
    error.message += " (the disk has " + std::to_string(room.available >> 20) + " MiB left)";
  }
  return error;
}

// One step and as many levels as fit, because data are read step by step.
std::vector<std::size_t> chunk_of(const std::array<int, 3>& dims, bool has_time) {
  const std::size_t row = static_cast<std::size_t>(dims[0]) * sizeof(float);
  const auto y = std::clamp<std::size_t>(chunk_bytes / row, 1, static_cast<std::size_t>(dims[1]));
  const auto z =
      std::clamp<std::size_t>(chunk_bytes / (row * y), 1, static_cast<std::size_t>(dims[2]));
  const auto x = static_cast<std::size_t>(dims[0]);
  if (has_time) return {1, z, y, x};
  return {z, y, x};
}

// Whole chunks of the written file that take about 16 MiB; all levels where they are read together.
int levels_at_once(const DatasetInfo& info, const FieldInfo& field) {
  constexpr std::size_t values_max = std::size_t{4} << 20;
  const auto [nx, ny, nz] = info.grid.dims();
  if (!field.is_read_by_boxes()) return nz;
  const std::size_t level =
      static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * field.components.size();
  const std::size_t chunk = chunk_of(info.grid.dims(), false)[0];
  const std::size_t levels = std::max<std::size_t>(values_max / level / chunk, 1) * chunk;
  return static_cast<int>(std::min(levels, static_cast<std::size_t>(nz)));
}

class Writer {
 public:
  Writer(Source& source, std::string path, const CancelToken& cancel)
      : source_(source),
        info_(source.info()),
        part_(netcdf_part(path)),
        path_(std::move(path)),
        cancel_(cancel) {}
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  ~Writer() {
    close();
    if (is_part_) std::remove(part_.c_str());
  }

  Result<void> write(const std::function<void(double)>& progress) {
    std::remove(part_.c_str());  // left by a killed process with the same id
    if (auto done =
            call("creating the file",
                 [&] { return nc_create(part_.c_str(), NC_NETCDF4 | NC_NOCLOBBER, &ncid_); });
        !done) {
      ncid_ = -1;
      return done;
    }
    is_part_ = true;
    if (auto done = call("describing the data", [&] { return define(); }); !done) {
      return done;
    }
    if (auto done = call("writing coordinates", [&] { return write_coordinates(); }); !done) {
      return done;
    }
    if (auto done = write_fields(progress); !done) {
      return done;
    }
    if (auto done = call("closing the file", [&] { return close_library(); }); !done) {
      return done;
    }
    if (std::rename(part_.c_str(), path_.c_str()) != 0) {
      return make_error(ErrorKind::internal, in_quotes(path_) +
                                                 " cannot be renamed to its final name: " +
                                                 std::generic_category().message(errno));
    }
    is_part_ = false;
    return {};
  }

 private:
  int close_library() {
    const int status = ncid_ < 0 ? NC_NOERR : nc_close(ncid_);
    ncid_ = -1;
    return status;
  }

  void close() {
    const netcdf::LibraryLock lock;
    close_library();
  }

  // Records the first failure of a sequence of calls and skips the rest.
  template <class Call>
  void then(Call&& next) {
    if (status_ == NC_NOERR) {
      status_ = std::forward<Call>(next)();
    }
  }

  int define() {
    then([&] { return put_texts(ncid_, NC_GLOBAL, cf::dataset_attributes(info_)); });
    define_time();
    for (std::size_t which = 3; which-- > 0;) {
      define_axis(which);
    }
    for (cf::WrittenVariable& variable : cf::written_variables(info_)) {
      define_variable(variables_.emplace_back(OutVariable{std::move(variable)}));
    }
    then([&] { return nc_enddef(ncid_); });
    return status_;
  }

  void define_time() {
    if (!cf::has_times(info_)) {
      return;
    }
    int dimension = -1;
    then([&] { return nc_def_dim(ncid_, "time", info_.steps.size(), &dimension); });
    then([&] { return nc_def_var(ncid_, "time", NC_DOUBLE, 1, &dimension, &time_); });
    then([&] { return put_texts(ncid_, time_, cf::time_attributes(info_)); });
    dimensions_.push_back(dimension);
  }

  void define_axis(std::size_t which) {
    const Axis& axis = info_.grid.axes.at(which);
    const std::string name = cf::axis_name(info_, which);
    int dimension = -1;
    int& id = axes_.at(which);
    then([&] { return nc_def_dim(ncid_, name.c_str(), axis.coordinates.size(), &dimension); });
    then([&] { return nc_def_var(ncid_, name.c_str(), NC_DOUBLE, 1, &dimension, &id); });
    then([&] { return put_texts(ncid_, id, cf::axis_attributes(axis, which)); });
    dimensions_.push_back(dimension);
  }

  void define_variable(OutVariable& variable) {
    const std::vector<std::size_t> chunks = chunk_of(info_.grid.dims(), time_ >= 0);
    int& id = variable.id;
    then([&] {
      return nc_def_var(ncid_, variable.name.c_str(), NC_FLOAT,
                        static_cast<int>(dimensions_.size()), dimensions_.data(), &id);
    });
    then([&] { return nc_def_var_chunking(ncid_, id, NC_CHUNKED, chunks.data()); });
    then([&] { return nc_def_var_deflate(ncid_, id, 1, 1, deflate_level); });
    then([&] { return nc_def_var_fill(ncid_, id, NC_FILL, &fill_value); });
    then([&] { return put_texts(ncid_, id, cf::variable_attributes(info_, variable)); });
  }

  int write_coordinates() {
    for (std::size_t which = 0; which < 3; ++which) {
      then([&] {
        return nc_put_var_double(ncid_, axes_.at(which),
                                 info_.grid.axes.at(which).coordinates.data());
      });
    }
    if (time_ >= 0) {
      std::vector<double> values;
      for (const TimeStep& step : info_.steps) {
        values.push_back(step.value);
      }
      then([&] { return nc_put_var_double(ncid_, time_, values.data()); });
    }
    return status_;
  }

  Result<void> write_fields(const std::function<void(double)>& progress) {
    const std::size_t fields = info_.fields.size();
    const auto steps = static_cast<double>(info_.steps.size());
    for (std::size_t step = 0; step < info_.steps.size(); ++step) {
      for (std::size_t field = 0; field < info_.fields.size(); ++field) {
        if (cancel_.cancelled()) {
          return interrupted();
        }
        if (progress)
          progress(static_cast<double>(step * fields + field) /
                   (steps * static_cast<double>(fields)));
        if (auto done = write_field(field, step); !done) {
          return done;
        }
      }
    }
    return {};
  }

  Result<void> write_field(std::size_t field, std::size_t step) {
    const bool is_wanted = std::any_of(variables_.begin(), variables_.end(),
                                       [&](const OutVariable& v) { return v.field == field; });
    if (!is_wanted) {
      return {};
    }
    const Box whole = whole_box(info_.grid.dims());
    Box box = whole;
    box.count[2] = levels_at_once(info_, info_.fields[field]);
    for (; box.first[2] < whole.count[2]; box.first[2] += box.count[2]) {
      box.count[2] = std::min(box.count[2], whole.count[2] - box.first[2]);
      // Takes the library's lock itself if it needs it.
      auto volume =
          box == whole ? source_.read(field, step) : source_.read_part(field, step, {box});
      if (!volume) return volume.error();
      float* first = volume->values.data();
      std::replace_if(
          first, first + volume->values.size(), [](float v) { return std::isnan(v); }, fill_value);
      for (const OutVariable& variable : variables_) {
        if (variable.field != field) continue;
        const float* values = volume->component(static_cast<int>(variable.component));
        if (auto done = write_levels(variable, step, box, values); !done) return done;
      }
    }
    return {};
  }

  // Writes the levels of a box of whole levels, one chunk at a time, so that cancellation is
  // checked often.
  Result<void> write_levels(const OutVariable& variable, std::size_t step, const Box& box,
                            const float* values) {
    const auto layer =
        static_cast<std::size_t>(box.count[0]) * static_cast<std::size_t>(box.count[1]);
    const auto levels = static_cast<std::size_t>(box.count[2]);
    const std::vector<std::size_t> chunks = chunk_of(info_.grid.dims(), time_ >= 0);
    const std::size_t z = chunks.size() - 3;
    for (std::size_t first = 0; first < levels; first += chunks[z]) {
      if (cancel_.cancelled()) {
        return interrupted();
      }
      std::vector<std::size_t> start(chunks.size(), 0);
      std::vector<std::size_t> count{std::min(chunks[z], levels - first),
                                     static_cast<std::size_t>(box.count[1]),
                                     static_cast<std::size_t>(box.count[0])};
      start[z] = static_cast<std::size_t>(box.first[2]) + first;
      if (time_ >= 0) {
        start[0] = step;
        count.insert(count.begin(), 1);
      }
      const auto put = [&] {
        return nc_put_vara_float(ncid_, variable.id, start.data(), count.data(),
                                 values + first * layer);
      };
      if (auto done = call("writing values", put); !done) {
        return done;
      }
    }
    return {};
  }

  [[nodiscard]] Error interrupted() const {
    return make_error(ErrorKind::cancelled, "interrupted; " + in_quotes(path_) + " is not written");
  }

  Source& source_;
  const DatasetInfo& info_;
  std::string part_;
  std::string path_;
  CancelToken cancel_;
  bool is_part_ = false;  // the temporary file exists
  int ncid_ = -1;
  int status_ = NC_NOERR;
  int time_ = -1;
  std::array<int, 3> axes_{-1, -1, -1};
  std::vector<int> dimensions_;  // time if there is one, z, y, x
  std::vector<OutVariable> variables_;
};

}  // namespace

std::string netcdf_part(const std::string& path) { return part_of(end_of_links(path)).native(); }

Result<void> write_netcdf(Source& source, const std::string& path, const CancelToken& cancel,
                          const std::function<void(double)>& progress) {
  try {
    auto plain = netcdf::writable_path(path);
    if (!plain) {
      return plain.error();
    }
    auto done = Writer(source, *plain, cancel).write(progress);
    return done ? done : with_room_left(done.error(), *plain);
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "no memory to write " + in_quotes(path));
  } catch (const std::exception& fault) {
    return make_error(ErrorKind::internal,
                      "writing " + in_quotes(path) + " failed: " + printable(fault.what()));
  }
}

}  // namespace windsplat::data
