// What is known of a dataset before any field is loaded: its grid, its fields, its steps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace windsplat::data {

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
  bool derived = false;  // computed on request from other fields, not stored in the file
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

}  // namespace windsplat::data
