// Metadata of a dataset, known before any field is loaded: grid, fields, steps.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace windsplat::data {

enum class AxisKind { longitude, latitude, pressure, height, depth, level, cartesian };

// One axis of a rectilinear grid. Index 0 is west, south or bottom: readers orient every axis so
// that the index grows with the world coordinate (hence a pressure axis descends in hPa).
struct Axis {
  std::string name;           // name of the dimension in the file
  std::string standard_name;  // as in CF; empty if none
  std::string units;          // as in the file; empty if none
  AxisKind kind = AxisKind::cartesian;
  std::vector<double> coordinates;  // one per sample, strictly monotonic, in `units`
};

// Positions of the columns of a grid with 2-D longitudes and latitudes: degrees, x fastest, all
// finite; longitudes are continuous between neighbours, beyond 360 if necessary.
struct Columns {
  std::vector<double> longitude;
  std::vector<double> latitude;
};

enum class GroundKind { land, sea_floor };

// The height of the ground or the sea floor of every column as the file gives it, metres above sea
// level, x fastest; NaN: unknown.
struct Ground {
  std::string name;  // of the variable
  GroundKind kind = GroundKind::land;
  std::vector<float> heights;
};

// x, y, z: always three axes; a dimension that the data lack has one coordinate.
struct Grid {
  std::array<Axis, 3> axes;
  std::shared_ptr<const Columns> columns;  // null: the axes determine all positions
  std::shared_ptr<const Ground> ground;    // null: the file does not give it
  [[nodiscard]] std::array<int, 3> dims() const;
  [[nodiscard]] std::size_t samples() const;
};

enum class FieldKind { scalar, vector };

struct FieldInfo {
  std::string name;  // as used by views: the name of the variable, for a vector "wind" or similar
  FieldKind kind = FieldKind::scalar;
  std::vector<std::string> components;  // variables of the file, in the order x, y(, z); one for a
                                        // scalar
  std::string units;                    // for a vector: that of its first component
  std::vector<std::string> component_units;  // one per component; may differ (m/s, Pa/s)
  std::string standard_name;
  std::string long_name;
  std::string dtype;       // type in the file: "float32", "int16 packed", ...
  bool derived = false;    // computed on request from other fields, not stored in the file
  bool off_level = false;  // not at the place of the vertical axis, which a chosen level gives
  // Bytes decoded to read one step, including whole chunks; 0 if equal to the size of the volume.
  std::uint64_t decoded_bytes = 0;
  std::uint64_t chunk_bytes = 0;  // the largest chunk, decoded; at least the fields that a derived
                                  // one is computed from, while it is
  // Samples of a chunk of the file along x, y and z; 1: a box costs its share of the step. 0 along
  // all axes: the field is not read by boxes. A chunk begins at sample box_chunk_first along each
  // axis, which is less than its length: chunks of reversed axes count from the other end.
  std::array<int, 3> box_chunk{0, 0, 0};
  std::array<int, 3> box_chunk_first{0, 0, 0};
  [[nodiscard]] bool is_read_by_boxes() const { return box_chunk[0] > 0; }
};

// A variable of the file that is not shown, with the reason.
struct LeftOut {
  std::string name;
  std::string reason;
};

// A dimension besides space and time, of which one entry is shown: a member of an ensemble, a
// reference time, a spectral band.
struct DimensionChoice {
  std::string name;
  std::size_t length = 0;
  std::vector<std::string> values;  // of the first choice_values_max entries
  std::string chosen;
};
inline constexpr std::size_t choices_max = 32;
inline constexpr std::size_t choice_values_max = 100;

struct TimeStep {
  double value = 0;  // in the unit of the file
  std::string
      text;  // ISO 8601 if the calendar is supported ("2001-01-01T03:00:00Z"), otherwise the value
};

struct StoredLevels;  // model/stored.hpp

// All metadata of a dataset.
struct DatasetInfo {
  std::string id;
  std::string title;
  std::string source;  // "built-in sample", or the file name without folder
  std::string format;  // "sample", "netCDF classic", "netCDF-4", "VTK image data", ...
  std::string digest;  // changes whenever the data may have changed
  Grid grid;
  std::vector<FieldInfo> fields;
  std::vector<LeftOut> left_out;
  std::vector<std::string> notes;  // how the data were converted: "resampled from 4096 cells ..."
  std::vector<DimensionChoice> choices;  // at most choices_max
  std::vector<TimeStep> steps;           // at least one
  std::string time_units;
  std::string time_calendar;       // as in CF; empty means standard
  std::uint64_t stored_bytes = 0;  // total size of the files opened by a loader; 0 for samples
  std::shared_ptr<const StoredLevels> stored;  // null: no coarser levels are stored

  [[nodiscard]] const FieldInfo* find(const std::string& name) const;  // null if there is none
  [[nodiscard]] const FieldInfo* first(FieldKind kind) const;          // null if there is none
};

inline constexpr std::size_t notes_max = 200;          // of a description
inline constexpr std::size_t notes_of_data_max = 150;  // of DatasetInfo

// Leaves at most notes_of_data_max, and counts those left out in the last one: the last of the
// first `notes_of_file`, which the file gives rise to, before the later ones on how it is shown.
void bound_notes(std::size_t notes_of_file, std::vector<std::string>& notes);

// What the file has under a name that is no field of the dataset, for the end of a message, with
// how to show it; empty if it has nothing.
std::string absence_text(const DatasetInfo& info, const std::string& name);

}  // namespace windsplat::data
