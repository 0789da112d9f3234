// Serial XML files of VTK (.vti .vtr .vts .vtu) -> Snapshot.
#include <algorithm>
#include <array>
#include <utility>

#include "server/data/bytes/text.hpp"
#include "server/data/formats/vtk/xml_document.hpp"

namespace windsplat::data::vtk {

namespace {

using pugi::xml_node;

// Invalid extents yield a wrong number here and are rejected by check_snapshot().
std::uint64_t size_of(const std::array<std::int64_t, 3>& counts) {
  std::uint64_t all = 1;
  for (const std::int64_t count : counts) all *= static_cast<std::uint64_t>(count);
  return all;
}

Result<void> read_axes(const Document& document, const xml_node& group, Snapshot& out,
                       Piece& piece) {
  if (out.kind != Kind::rectilinear) return {};
  if (auto done = document.read_arrays(group, 0, out, piece.coordinates); !done) return done;
  const auto counts = piece.extent.points();
  for (std::size_t a = 0; a < std::min<std::size_t>(3, piece.coordinates.size()); ++a) {
    piece.coordinates[a].tuples = static_cast<std::uint64_t>(counts.at(a));
  }
  return {};
}

Result<void> read_cells(const Document& document, const xml_node& group, Snapshot& out,
                        Piece& piece) {
  if (out.kind != Kind::unstructured) return {};
  std::vector<StoredArray> arrays;
  if (auto done = document.read_arrays(group, piece.cells, out, arrays); !done) return done;
  for (StoredArray& array : arrays) {
    if (array.components != 1)
      return document.file()->fault("has cells whose arrays have several components");
    if (array.name == "connectivity")
      piece.connectivity = std::move(array);
    else if (array.name == "offsets")
      piece.offsets = std::move(array);
    else if (array.name == "types")
      piece.types = std::move(array);
  }
  return {};
}

Result<void> read_piece(const Document& document, const xml_node& node, Snapshot& out) {
  Piece piece;
  piece.extent = out.whole;
  if (out.kind == Kind::unstructured) {
    const auto points = bytes::to_integer(node.attribute("NumberOfPoints").value());
    const auto cells = bytes::to_integer(node.attribute("NumberOfCells").value());
    if (!points || !cells || *points < 0 || *cells < 0) {
      return document.file()->fault("has a piece without valid numbers of points and cells");
    }
    piece.points = static_cast<std::uint64_t>(*points);
    piece.cells = static_cast<std::uint64_t>(*cells);
  } else if (const auto extent = node.attribute("Extent");
             extent && !extent_of(extent.value(), piece.extent)) {
    return document.file()->fault("has a piece whose Extent is not six whole numbers within 2^31");
  }
  const auto points =
      out.kind == Kind::unstructured ? piece.points : size_of(piece.extent.points());
  const auto cells = out.kind == Kind::unstructured ? piece.cells : size_of(piece.extent.cells());
  if (auto done = document.read_arrays(node.child("PointData"), points, out, piece.point_data);
      !done) {
    return done;
  }
  if (auto done = document.read_arrays(node.child("CellData"), cells, out, piece.cell_data);
      !done) {
    return done;
  }
  if (auto done = document.read_arrays(node.child("Points"), points, out, piece.coordinates);
      !done) {
    return done;
  }
  if (auto done = read_axes(document, node.child("Coordinates"), out, piece); !done) return done;
  if (auto done = read_cells(document, node.child("Cells"), out, piece); !done) return done;
  // Parallel writers emit an empty piece for a process without cells.
  if (points > 0) out.pieces.push_back(std::move(piece));
  return {};
}

}  // namespace

std::optional<GridType> grid_type(const std::string& type) {
  struct Known {
    const char* name;
    GridType type;
  };
  static const std::array<Known, 5> known{{
      {"ImageData", {Kind::image, false, "VTK image data"}},
      {"UniformGrid", {Kind::image, false, "VTK image data"}},
      {"RectilinearGrid", {Kind::rectilinear, false, "VTK rectilinear grid"}},
      {"StructuredGrid", {Kind::structured, false, "VTK structured grid"}},
      {"UnstructuredGrid", {Kind::unstructured, false, "VTK unstructured grid"}},
  }};
  const bool parallel = type.starts_with('P');
  for (const Known& one : known) {
    if (type.substr(parallel ? 1 : 0) != one.name) continue;
    GridType out = one.type;
    out.parallel = parallel;
    if (parallel) out.format += ", parallel";
    return out;
  }
  return {};
}

Result<Snapshot> read_serial(const Document& document, const GridType& type, Part part) {
  const auto& file = document.file();
  Snapshot out;
  out.kind = type.kind;
  out.format = type.format;
  const std::string name = document.type();
  const xml_node set = document.root().child(name.c_str());
  if (!set) return file->fault("has no element " + in_quotes(name));
  if (out.kind != Kind::unstructured &&
      !extent_of(set.attribute("WholeExtent").value(), out.whole)) {
    return file->fault("has no WholeExtent of six whole numbers within 2^31");
  }
  if (out.kind == Kind::image) {
    if (auto done = document.read_placement(set, out.place); !done) return done.error();
  }
  for (const xml_node piece : set.children("Piece")) {
    if (auto done = read_piece(document, piece, out); !done) return done.error();
  }
  if (auto done = document.read_time(set.child("FieldData"), out); !done) return done.error();
  if (auto done = check_snapshot(file, out, part); !done) return done.error();
  keep_common_arrays(*file, out);
  return out;
}

}  // namespace windsplat::data::vtk
