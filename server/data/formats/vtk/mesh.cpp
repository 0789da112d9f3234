// Reads points and cells, and checks every index.
#include "server/data/formats/vtk/mesh.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "server/data/cf/grid/grid.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::vtk {

namespace {

using FilePtr = std::shared_ptr<const InputFile>;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t block_values = std::size_t{1} << 16;

struct CellType {
  Shape shape = Shape::none;
  std::uint64_t corners = 0;
  bool swaps = false;  // pixel and voxel of VTK have their corners row by row
};

CellType cell_type(int type) {
  switch (type) {
    case 5:
      return {Shape::triangle, 3};
    case 8:
      return {Shape::quad, 4, true};
    case 9:
      return {Shape::quad, 4};
    case 10:
      return {Shape::tetra, 4};
    case 11:
      return {Shape::hexahedron, 8, true};
    case 12:
      return {Shape::hexahedron, 8};
    case 13:
      return {Shape::wedge, 6};
    case 14:
      return {Shape::pyramid, 5};
    default:
      return {};
  }
}

// A sequence of non-negative integers.
class Counts {
 public:
  Counts(FilePtr file, const StoredArray& array) : file_(std::move(file)), array_(array) {}

  Result<void> open() {
    auto reader = ArrayReader::open(file_, array_);
    if (!reader) return reader.error();
    reader_.emplace(std::move(*reader));
    left_ = array_.values();
    return {};
  }

  Result<std::uint64_t> next() {
    if (used_ == block_.size()) {
      if (left_ == 0) return file_->fault("is malformed: its cells exceed their array");
      block_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left_, block_values)));
      if (auto done = reader_->read(block_.data(), block_.size()); !done) return done.error();
      left_ -= block_.size();
      used_ = 0;
    }
    const double value = block_[used_++];
    if (!(value >= 0 && value < 9e15)) {
      return file_->fault("is malformed: its cells have a number that is not an index");
    }
    return static_cast<std::uint64_t>(value);
  }

  Result<void> skip(std::uint64_t count) {
    for (; count > 0; --count) {
      if (auto value = next(); !value) return value.error();
    }
    return {};
  }

 private:
  FilePtr file_;
  StoredArray array_;
  std::optional<ArrayReader> reader_;
  std::uint64_t left_ = 0;
  std::vector<double> block_;
  std::size_t used_ = 0;
};

// The points of an image or a rectilinear grid: x y z of each, i fastest.
Result<std::vector<double>> lattice_points(const FilePtr& file, const Piece& piece) {
  const auto counts = piece.extent.points();
  std::array<std::vector<double>, 3> axes;
  for (std::size_t a = 0; a < 3; ++a) {
    if (piece.kind == Kind::rectilinear) {
      auto values = read_all(file, piece.coordinates.at(a));
      if (!values) return values.error();
      axes[a] = std::move(*values);
      continue;
    }
    for (std::int64_t i = 0; i < counts[a]; ++i) {
      axes[a].push_back(piece.place.spacing[a] * static_cast<double>(piece.extent.first[a] + i));
    }
  }
  const bool is_image = piece.kind == Kind::image;
  std::vector<double> points;
  points.reserve(static_cast<std::size_t>(piece.points) * 3);
  for (const double z : axes[2]) {
    for (const double y : axes[1]) {
      for (const double x : axes[0]) {
        if (!is_image) {
          points.insert(points.end(), {x, y, z});
          continue;
        }
        const auto& d = piece.place.direction;
        for (std::size_t w = 0; w < 3; ++w) {
          points.push_back(piece.place.origin[w] + d.at(3 * w) * x + d.at(3 * w + 1) * y +
                           d.at(3 * w + 2) * z);
        }
      }
    }
  }
  return points;
}

// The points of a piece; hidden ones are NaN.
Result<std::vector<double>> read_points(const FilePtr& file, const Piece& piece) {
  const bool listed = piece.kind == Kind::structured || piece.kind == Kind::unstructured;
  auto points = listed ? read_all(file, piece.coordinates.front()) : lattice_points(file, piece);
  if (!points) return points.error();
  const auto ghosts = read_ghosts(file, piece.point_data);
  if (!ghosts) return ghosts.error();
  for (std::size_t p = 0; p < ghosts->size(); ++p) {
    if (has_bit((*ghosts)[p], hidden_point)) std::fill_n(points->begin() + 3 * p, 3, missing);
  }
  return points;
}

Result<void> read_structured_piece(Files& files, const Snapshot& snapshot, const Piece& piece,
                                   Mesh& mesh) {
  const auto opened = piece.file.open(files);
  if (!opened) return opened.error();
  const FilePtr& file = *opened;
  const auto points = read_points(file, piece);
  if (!points) return points.error();
  const auto all = snapshot.whole.points();
  auto from = points->begin();
  auto done = for_rows(snapshot.whole, piece.extent, false, [&](const auto& at, std::size_t n) {
    const auto to = static_cast<std::ptrdiff_t>(3 * ((at[2] * all[1] + at[1]) * all[0] + at[0]));
    std::copy_n(from, 3 * n, mesh.points.begin() + to);
    from += static_cast<std::ptrdiff_t>(3 * n);
    return Result<void>();
  });
  if (!done) return done;
  const auto ghosts = read_ghosts(file, piece.cell_data);
  if (!ghosts) return ghosts.error();
  if (ghosts->empty()) return {};
  mesh.hidden.resize(mesh.cell_count());
  const auto cells = snapshot.whole.cells();
  auto ghost = ghosts->begin();
  return for_rows(snapshot.whole, piece.extent, true, [&](const auto& at, std::size_t n) {
    const auto to = static_cast<std::size_t>((at[2] * cells[1] + at[1]) * cells[0] + at[0]);
    for (std::size_t i = 0; i < n; ++i) {
      if (has_bit(*ghost++, hidden_cell | refined_cell)) mesh.hidden[to + i] = true;
    }
    return Result<void>();
  });
}

// The cells of one piece, whose points begin at `base`.
class PieceCells {
 public:
  // masked: the bits of ghosts that hide a cell.
  PieceCells(FilePtr file, const Piece& piece, std::uint64_t base, unsigned masked, Mesh& mesh)
      : file_(std::move(file)),
        piece_(piece),
        base_(base),
        masked_(masked),
        mesh_(mesh),
        connectivity_(*piece.connectivity) {}

  Result<void> read() {
    const auto ghosts = read_ghosts(file_, piece_.cell_data);
    if (!ghosts) return ghosts.error();
    Counts types(file_, *piece_.types);
    if (auto done = types.open(); !done) return done;
    std::optional<Counts> offsets;
    if (piece_.offsets) {
      if (auto done = open_offsets(offsets); !done) return done;
    }
    Counts indices(file_, connectivity_);
    if (auto done = indices.open(); !done) return done;
    std::uint64_t end = 0;
    for (std::uint64_t c = 0; c < piece_.cells; ++c) {
      const auto type = types.next();
      if (!type) return type.error();
      auto size = offsets ? offsets->next() : indices.next();
      if (!size) return size.error();
      if (offsets) {
        if (*size < end) return file_->fault("is malformed: the offsets of its cells decrease");
        *size -= std::exchange(end, *size);
      }
      const bool hidden = c < ghosts->size() && has_bit((*ghosts)[c], masked_);
      if (auto done =
              add(static_cast<int>(std::min<std::uint64_t>(*type, 255)), *size, hidden, indices);
          !done) {
        return done;
      }
    }
    return {};
  }

 private:
  // XML does not state the number of indices: it is the last offset.
  Result<void> open_offsets(std::optional<Counts>& offsets) {
    StoredArray array = *piece_.offsets;
    offsets.emplace(file_, array);
    if (auto done = offsets->open(); !done) return done;
    if (piece_.offsets_from_zero) {
      const auto begin = offsets->next();
      if (!begin) return begin.error();
      if (*begin == 0) return {};
      return file_->fault("is malformed: the offsets of its cells do not begin with 0");
    }
    std::uint64_t last = 0;
    for (std::uint64_t c = 0; c < piece_.cells; ++c) {
      const auto value = offsets->next();
      if (!value) return value.error();
      last = *value;
    }
    if (last > cf::samples_max * 8) return file_->fault("has cells with more than 2^34 corners");
    connectivity_.tuples = last;
    offsets.emplace(file_, array);
    return offsets->open();
  }

  Result<void> add(int type, std::uint64_t size, bool hidden, Counts& indices) {
    const CellType known = cell_type(type);
    const bool fits = known.shape != Shape::none && known.corners == size;
    mesh_.first.push_back(static_cast<std::uint32_t>(mesh_.corners.size()));
    mesh_.shapes.push_back(fits && !hidden ? known.shape : Shape::none);
    if (!fits) {
      ++mesh_.unread[type];
      return indices.skip(size);
    }
    std::array<std::uint32_t, 8> corners{};
    for (std::uint64_t i = 0; i < size; ++i) {
      const auto index = indices.next();
      if (!index) return index.error();
      if (*index >= piece_.points) {
        return file_->fault("is malformed: a cell refers to point " + std::to_string(*index) +
                            ", but there are " + std::to_string(piece_.points) + " points");
      }
      corners.at(i) = static_cast<std::uint32_t>(base_ + *index);
    }
    if (known.swaps) {
      std::swap(corners[2], corners[3]);
      std::swap(corners[6], corners[7]);
    }
    if (hidden) return {};
    if (mesh_.corners.size() + size > std::numeric_limits<std::uint32_t>::max()) {
      return file_->fault("has cells with more than 2^32 corners");
    }
    mesh_.corners.insert(mesh_.corners.end(), corners.begin(),
                         corners.begin() + static_cast<std::ptrdiff_t>(size));
    return {};
  }

  FilePtr file_;
  const Piece& piece_;
  std::uint64_t base_;
  unsigned masked_;
  Mesh& mesh_;
  StoredArray connectivity_;
};

// Appends the cells of a structured piece, whose points begin at `base`.
Result<void> add_structured_cells(const FilePtr& file, const Piece& piece, std::uint64_t base,
                                  unsigned masked, Mesh& mesh) {
  const auto ghosts = read_ghosts(file, piece.cell_data);
  if (!ghosts) return ghosts.error();
  Mesh own;
  own.counts = piece.extent.points();
  std::array<std::uint32_t, 8> corners{};
  for (std::uint64_t c = 0; c < piece.cells; ++c) {
    const bool hidden = c < ghosts->size() && has_bit((*ghosts)[c], masked);
    const Shape shape = hidden ? Shape::none : own.cell(c, corners);
    const auto size = static_cast<std::size_t>(corners_of(shape));
    mesh.first.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
    mesh.shapes.push_back(shape);
    if (mesh.corners.size() + size > std::numeric_limits<std::uint32_t>::max()) {
      return file->fault("has cells with more than 2^32 corners");
    }
    for (std::size_t i = 0; i < size; ++i) {
      mesh.corners.push_back(static_cast<std::uint32_t>(base + corners.at(i)));
    }
  }
  return {};
}

}  // namespace

Shape shape_of_type(int type) { return cell_type(type).shape; }

Result<std::vector<double>> read_ghosts(const FilePtr& file,
                                        const std::vector<StoredArray>& arrays) {
  const StoredArray* array = find_array(arrays, ghost_name);
  const bool levels = array == nullptr;
  if (levels) array = find_array(arrays, ghost_levels_name);
  if (array == nullptr || array->components != 1) return std::vector<double>();
  auto values = read_all(file, *array);
  if (!values || !levels) return values;
  for (double& value : *values) value = value > 0 ? duplicate : 0;
  return values;
}

bool has_bit(double ghost, unsigned bits) {
  return ghost >= 0 && ghost < 256 && (static_cast<unsigned>(ghost) & bits) != 0;
}

std::uint64_t Mesh::cell_count() const {
  if (counts[0] == 0) return shapes.size();
  std::uint64_t all = 1;
  for (const std::int64_t n : counts) {
    all *= static_cast<std::uint64_t>(std::max<std::int64_t>(1, n - 1));
  }
  return all;
}

Shape Mesh::cell(std::uint64_t index, std::array<std::uint32_t, 8>& out) const {
  if (counts[0] == 0) {
    const Shape shape = shapes[index];
    std::copy_n(corners.begin() + first[index], corners_of(shape), out.begin());
    return shape;
  }
  if (!hidden.empty() && hidden[index]) return Shape::none;
  std::array<std::uint64_t, 3> step{};
  std::uint64_t at = 0;
  std::uint64_t stride = 1;
  std::size_t spanned = 0;
  for (const std::int64_t n : counts) {
    const auto points = static_cast<std::uint64_t>(n);
    const std::uint64_t cells = std::max<std::uint64_t>(1, points - 1);
    at += index % cells * stride;
    index /= cells;
    if (points > 1) step.at(spanned++) = stride;
    stride *= points;
  }
  if (spanned < 2) return Shape::none;
  const std::array<std::uint64_t, 4> face{at, at + step[0], at + step[0] + step[1], at + step[1]};
  for (std::size_t i = 0; i < 4; ++i) {
    out.at(i) = static_cast<std::uint32_t>(face.at(i));
    out.at(i + 4) = static_cast<std::uint32_t>(face.at(i) + step[2]);
  }
  return spanned == 2 ? Shape::quad : Shape::hexahedron;
}

void Mesh::forget_points() {
  points.clear();
  points.shrink_to_fit();
}

Result<Mesh> read_mesh(Files& files, const Snapshot& snapshot) {
  Mesh mesh;
  if (snapshot.kind == Kind::structured) {
    mesh.counts = snapshot.whole.points();
    mesh.points_read = 1;
    for (const std::int64_t n : mesh.counts) mesh.points_read *= static_cast<std::uint64_t>(n);
    mesh.points.assign(static_cast<std::size_t>(mesh.points_read) * 3, missing);
    for (const Piece& piece : snapshot.pieces) {
      if (auto done = read_structured_piece(files, snapshot, piece, mesh); !done) {
        return done.error();
      }
    }
    return mesh;
  }
  // A file of one piece shows the cells that it repeats from others, which are not here.
  const unsigned masked =
      hidden_cell | refined_cell | (snapshot.pieces.size() > 1 ? duplicate : 0U);
  for (const Piece& piece : snapshot.pieces) {
    const auto file = piece.file.open(files);
    if (!file) return file.error();
    const std::uint64_t base = mesh.points_read;
    const auto points = read_points(*file, piece);
    if (!points) return points.error();
    mesh.points.insert(mesh.points.end(), points->begin(), points->end());
    mesh.points_read += piece.points;
    if (mesh.points_read > cf::samples_max) {
      return (*file)->fault("has more than " + std::to_string(cf::samples_max) + " points");
    }
    if (piece.cells == 0) continue;
    auto done = piece.kind == Kind::unstructured
                    ? PieceCells(*file, piece, base, masked, mesh).read()
                    : add_structured_cells(*file, piece, base, masked, mesh);
    if (!done) return done.error();
  }
  return mesh;
}

std::uint64_t uncovered(const Snapshot& snapshot, bool of_cells) {
  if (snapshot.pieces.size() == 1 && snapshot.pieces.front().extent == snapshot.whole) return 0;
  const auto all = of_cells ? snapshot.whole.cells() : snapshot.whole.points();
  std::vector<bool> covered(static_cast<std::size_t>(all[0] * all[1] * all[2]));
  for (const Piece& piece : snapshot.pieces) {
    auto done =
        for_rows(snapshot.whole, piece.extent, of_cells, [&](const auto& at, std::size_t n) {
          std::fill_n(covered.begin() + ((at[2] * all[1] + at[1]) * all[0] + at[0]), n, true);
          return Result<void>();
        });
    static_cast<void>(done);
  }
  return static_cast<std::uint64_t>(std::count(covered.begin(), covered.end(), false));
}

std::string digest_of_mesh(const Mesh& mesh) {
  const auto bytes = [](const auto& values) {
    return std::string_view(reinterpret_cast<const char*>(values.data()),
                            values.size() * sizeof(values[0]));
  };
  return digest_of(bytes(mesh.points)) + digest_of(bytes(mesh.corners)) +
         digest_of(bytes(mesh.shapes)) + std::to_string(mesh.counts[0]) + 'x' +
         std::to_string(mesh.counts[1]);
}

}  // namespace windsplat::data::vtk
