// The headers of the files of one step as plain data, filled by the readers of XML and legacy
// files, united by step_reader.cpp, and converted to positions by grid.cpp and mesh.cpp.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"
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

// Positions of the points of an image: index 0, the steps along i, j, k, and their directions.
struct Placement {
  std::array<double, 3> origin{0, 0, 0};
  std::array<double, 3> spacing{1, 1, 1};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};  // rows: world axes; columns: i, j, k
};

// The file of a piece. The first files of a step stay open, the others are opened when read.
struct PieceFile {
  std::shared_ptr<const InputFile> kept;
  std::string name;  // for Files::open()
  std::string identity;

  // Errors: bad_data if the file has changed since its header was read.
  [[nodiscard]] Result<std::shared_ptr<const InputFile>> open(Files& files) const;
};

struct Piece {
  PieceFile file;
  std::size_t block = 0;    // in Snapshot::blocks
  Kind kind = Kind::image;  // differs from that of the snapshot in a mesh of several blocks
  Placement place;          // for images
  Extent extent;            // unused for unstructured grids
  bool overlaps = false;    // shares more than a layer of points with another one of its block
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
  std::shared_ptr<const InputFile> file;  // that of the step, for messages
  std::string identity;                   // of all its files
  Kind kind = Kind::image;
  std::string format;  // "VTK image data (XML)"
  std::string title;
  Extent whole;
  Placement place;  // of images
  std::vector<Piece> pieces;
  std::vector<std::string> blocks;  // names of the blocks; empty: the file has none
  std::optional<double> time;
  std::vector<LeftOut> left_out;   // arrays that cannot be read
  std::vector<std::string> notes;  // on blocks that are not shown

  // Records an array as left out, unless it is already.
  void leave_out(const std::string& name, const std::string& reason);
};

// The name of the array that masks points or cells, and of its predecessor (VTK before 7), whose
// values are levels of ghosts.
inline constexpr const char* ghost_name = "vtkGhostType";
inline constexpr const char* ghost_levels_name = "vtkGhostLevels";
// Bits of its values.
inline constexpr unsigned hidden_point = 2;
inline constexpr unsigned hidden_cell = 32;
inline constexpr unsigned refined_cell = 8;
inline constexpr unsigned duplicate = 1;  // a point or cell of another piece

// Whether the first bytes of a file are those of the format.
bool is_xml(std::string_view head);
bool is_legacy(std::string_view head);
inline constexpr std::size_t head_bytes = 4096;

// Limit on the arrays of points and cells of a piece, or that a header declares.
inline constexpr std::size_t piece_arrays_max = 4096;

// Reads a legacy file. Errors: bad_data.
Result<Snapshot> read_legacy(const std::shared_ptr<const InputFile>& file);

enum class Part {
  whole,    // the pieces cover the whole extent
  of_step,  // the file is one of several of a step: it may be empty, or a part of the extent
};

// Sets the numbers of points and cells of each piece from its extent, and checks every array
// against them and against the file. Errors: bad_data.
Result<void> check_snapshot(const std::shared_ptr<const InputFile>& file, Snapshot& snapshot,
                            Part part);

// Checks that the whole extent is within the limits and holds the pieces, which cover it. Errors:
// bad_data.
Result<void> check_cover(const InputFile& file, const Snapshot& snapshot);

// Whether check_overlap() found pieces that overlap.
bool has_overlaps(const Snapshot& snapshot);

// "0 7 0 5 0 3", as in files.
std::string text_of(const Extent& extent);

using PieceData = std::vector<StoredArray> Piece::*;  // point or cell data

// The array of that name in the first piece that has one; null if none has.
const StoredArray* first_of(const Snapshot& snapshot, PieceData data, const std::string& name);

const StoredArray* find_array(const std::vector<StoredArray>& arrays, const std::string& name);
bool is_ghost(const StoredArray& array);

// The arrays of all pieces in the order of the files, without those of ghosts.
std::vector<std::string> array_names(const Snapshot& snapshot, PieceData data);
void erase_array(Snapshot& snapshot, PieceData data, const std::string& name);
// Leaves out the arrays that a piece lacks, or has with another number of components.
void keep_common_arrays(const InputFile& file, Snapshot& snapshot);

}  // namespace windsplat::data::vtk
