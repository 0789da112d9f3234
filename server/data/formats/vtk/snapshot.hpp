// The header of one VTK file as plain data, filled by xml.cpp and legacy.cpp, and converted to
// positions by grid.cpp and mesh.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/vtk/stored_array.hpp"
#include "server/data/model/dataset_info.hpp"

namespace windsplat::data::vtk {

enum class Kind { image, rectilinear, structured, unstructured };

// First and last index of points along i, j, k, inclusive.
struct Extent {
  std::array<std::int64_t, 3> first{0, 0, 0};
  std::array<std::int64_t, 3> last{0, 0, 0};

  [[nodiscard]] std::array<std::int64_t, 3> points() const;  // along each, at least 1
  // Cells along each axis; one layer of cells if there is one point.
  [[nodiscard]] std::array<std::int64_t, 3> cells() const;
  [[nodiscard]] bool holds(const Extent& other) const;
  bool operator==(const Extent&) const = default;
};

struct Piece {
  Extent extent;  // unused for unstructured grids
  std::uint64_t points = 0;
  std::uint64_t cells = 0;
  // For a rectilinear grid x, y and z with one component each; otherwise one array of 3 components.
  std::vector<StoredArray> coordinates;
  std::optional<StoredArray> connectivity;  // unstructured: indices of points
  std::optional<StoredArray> offsets;       // ends of the indices of cells; see offsets_from_zero
  std::optional<StoredArray> types;         // VTK cell types
  bool offsets_from_zero = false;           // one more offset than cells; the first is 0
  bool counts_inside = false;               // no offsets: indices of a cell follow their count
  std::vector<StoredArray> point_data;
  std::vector<StoredArray> cell_data;
};

struct Snapshot {
  Kind kind = Kind::image;
  std::string format;  // "VTK image data (XML)"
  std::string title;
  Extent whole;
  std::array<double, 3> origin{0, 0, 0};
  std::array<double, 3> spacing{1, 1, 1};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};  // rows: world axes; columns: i, j, k
  std::vector<Piece> pieces;
  std::optional<double> time;
  std::vector<LeftOut> left_out;  // arrays that cannot be read
};

// The name of the array that masks points or cells.
inline constexpr const char* ghost_name = "vtkGhostType";
// Bits of its values.
inline constexpr unsigned hidden_point = 2;
inline constexpr unsigned hidden_cell = 32;
inline constexpr unsigned refined_cell = 8;
inline constexpr unsigned duplicate_cell = 1;

// Whether the first bytes of a file are those of the format.
bool is_xml(std::string_view head);
bool is_legacy(std::string_view head);
inline constexpr std::size_t head_bytes = 4096;

// Errors: bad_data.
Result<Snapshot> read_xml(const std::shared_ptr<const InputFile>& file);
Result<Snapshot> read_legacy(const std::shared_ptr<const InputFile>& file);

// The data sets of a .pvd file in the order of their times.
struct Collection {
  struct Member {
    double time = 0;
    std::string file;
  };
  std::vector<Member> members;
};
// nullopt if the file is not a collection. Errors: bad_data.
Result<std::optional<Collection>> read_collection(const std::shared_ptr<const InputFile>& file);

// Sets the numbers of points and cells of each piece from its extent, and checks every array
// against them and against the file. Errors: bad_data.
Result<void> check_snapshot(const std::shared_ptr<const InputFile>& file, Snapshot& snapshot);

}  // namespace windsplat::data::vtk
