// Validates both kinds of headers: extents within limits, arrays within the file.
#include "server/data/formats/vtk/snapshot.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/byte_store.hpp"
#include "server/data/cf/grid/grid.hpp"

namespace windsplat::data::vtk {

namespace {

constexpr auto count_max = static_cast<std::int64_t>(cf::samples_max);
// Pieces of one cell share each point with seven others, and may have ghost layers.
constexpr std::uint64_t overlap_max = 64;

// The product, or nullopt beyond the supported size.
std::optional<std::uint64_t> product(const std::array<std::int64_t, 3>& counts) {
  std::uint64_t all = 1;
  for (const std::int64_t count : counts) {
    if (count < 1 || count > count_max) return {};
    all *= static_cast<std::uint64_t>(count);
    if (all > cf::samples_max) return {};
  }
  return all;
}

Error too_large(const InputFile& file) {
  return file.fault("has an extent that is empty or beyond the limit of " +
                    std::to_string(cf::samples_max) + " samples");
}

// Memory is allocated for the whole extent, so the pieces must cover it, without excessive overlap.
Result<void> check_amount(const InputFile& file, const Snapshot& snapshot) {
  const std::uint64_t whole = *product(snapshot.whole.points());
  std::uint64_t sum = 0;
  for (const Piece& piece : snapshot.pieces) {
    sum += piece.points;
    if (sum > overlap_max * whole) {
      return file.fault("has pieces that overlap more than " + std::to_string(overlap_max) +
                        " times");
    }
  }
  if (sum >= whole) return {};
  std::string what = "has the whole extent " + text_of(snapshot.whole) + " of ";
  what += std::to_string(whole) + " points, but ";
  what += std::to_string(snapshot.pieces.size()) + " piece(s) with " + std::to_string(sum);
  what += " points, the first with the extent " + text_of(snapshot.pieces.front().extent);
  return file.fault(what);
}

Result<void> check_extents(const InputFile& file, Snapshot& snapshot, Part part) {
  if (!product(snapshot.whole.points())) return too_large(file);
  for (Piece& piece : snapshot.pieces) {
    if (!product(piece.extent.points())) return too_large(file);
    piece.points = *product(piece.extent.points());
    piece.cells = *product(piece.extent.cells());
  }
  return part == Part::whole ? check_cover(file, snapshot) : Result<void>();
}

// Keeps the valid arrays and omits the others with a reason. Errors: truncated files.
Result<void> check_data(const std::shared_ptr<const InputFile>& file, Snapshot& snapshot,
                        std::vector<StoredArray>& arrays, std::uint64_t tuples) {
  std::vector<StoredArray> kept;
  for (StoredArray& array : arrays) {
    const bool twice = std::any_of(kept.begin(), kept.end(),
                                   [&](const StoredArray& a) { return a.name == array.name; });
    if (twice) {
      snapshot.left_out.push_back({array.name, "a second array of this name"});
    } else if (array.tuples != tuples) {
      snapshot.left_out.push_back({array.name, "has " + std::to_string(array.tuples) +
                                                   " tuples instead of " + std::to_string(tuples)});
    } else {
      if (auto reader = ArrayReader::open(file, array); !reader) return reader.error();
      kept.push_back(std::move(array));
    }
  }
  arrays = std::move(kept);
  return {};
}

// Checks the coordinates and cells required by the kind of grid.
Result<void> check_geometry(const std::shared_ptr<const InputFile>& file, const Snapshot& snapshot,
                            const Piece& piece) {
  const auto counts = piece.extent.points();
  const bool by_axis = snapshot.kind == Kind::rectilinear;
  if (snapshot.kind == Kind::image) return {};
  if (piece.coordinates.size() != (by_axis ? 3U : 1U)) {
    return file->fault("has a piece without its coordinates");
  }
  for (std::size_t a = 0; a < piece.coordinates.size(); ++a) {
    const StoredArray& array = piece.coordinates[a];
    const std::uint64_t wanted = by_axis ? static_cast<std::uint64_t>(counts.at(a)) : piece.points;
    if (array.tuples != wanted || array.components != (by_axis ? 1 : 3)) {
      return file->fault("has coordinates whose size differs from its grid");
    }
    if (auto reader = ArrayReader::open(file, array); !reader) return reader.error();
  }
  if (snapshot.kind != Kind::unstructured || piece.cells == 0) return {};
  if (!piece.connectivity || !piece.types || (!piece.offsets && !piece.counts_inside)) {
    return file->fault("has a piece without its cells");
  }
  if (piece.types->tuples != piece.cells) return file->fault("has fewer cell types than cells");
  for (const auto* array : {&piece.types, &piece.offsets}) {
    if (!*array) continue;
    if (auto reader = ArrayReader::open(file, **array); !reader) return reader.error();
  }
  return {};
}

}  // namespace

std::array<std::int64_t, 3> Extent::points() const {
  std::array<std::int64_t, 3> out{};
  for (std::size_t a = 0; a < 3; ++a) out[a] = last[a] - first[a] + 1;
  return out;
}

std::array<std::int64_t, 3> Extent::cells() const {
  std::array<std::int64_t, 3> out = points();
  for (std::int64_t& count : out) count = std::max<std::int64_t>(1, count - 1);
  return out;
}

bool Extent::holds(const Extent& other) const {
  for (std::size_t a = 0; a < 3; ++a) {
    if (other.first[a] < first[a] || other.last[a] > last[a]) return false;
  }
  return true;
}

std::string text_of(const Extent& extent) {
  std::string out;
  for (std::size_t a = 0; a < 3; ++a) {
    if (a > 0) out += ' ';
    out += std::to_string(extent.first[a]) + ' ' + std::to_string(extent.last[a]);
  }
  return out;
}

Result<std::shared_ptr<const InputFile>> PieceFile::open(Files& files) const {
  if (kept) return kept;
  return bytes::open_again(files, name, identity);
}

void Snapshot::leave_out(const std::string& name, const std::string& reason) {
  const bool known = std::any_of(left_out.begin(), left_out.end(),
                                 [&](const LeftOut& left) { return left.name == name; });
  if (!known) left_out.push_back({name, reason});
}

Result<void> check_cover(const InputFile& file, const Snapshot& snapshot) {
  if (!product(snapshot.whole.points())) return too_large(file);
  for (const Piece& piece : snapshot.pieces) {
    if (!snapshot.whole.holds(piece.extent)) {
      return file.fault("has a piece with the extent " + text_of(piece.extent) +
                        ", which is not within the whole extent " + text_of(snapshot.whole));
    }
  }
  return check_amount(file, snapshot);
}

Result<void> check_snapshot(const std::shared_ptr<const InputFile>& file, Snapshot& snapshot,
                            Part part) {
  if (snapshot.pieces.empty()) {
    return part == Part::of_step ? Result<void>()
                                 : Result<void>(file->fault("has no piece and so no data"));
  }
  if (snapshot.kind != Kind::unstructured) {
    if (auto done = check_extents(*file, snapshot, part); !done) return done;
  }
  for (Piece& piece : snapshot.pieces) {
    if (piece.points > cf::samples_max || piece.cells > cf::samples_max) {
      return file->fault("has more than " + std::to_string(cf::samples_max) + " points or cells");
    }
    if (piece.point_data.size() + piece.cell_data.size() > piece_arrays_max) {
      return file->fault("has more than " + std::to_string(piece_arrays_max) +
                         " arrays of points and cells");
    }
    if (auto done = check_geometry(file, snapshot, piece); !done) return done;
    if (auto done = check_data(file, snapshot, piece.point_data, piece.points); !done) return done;
    if (auto done = check_data(file, snapshot, piece.cell_data, piece.cells); !done) return done;
    // Without arrays there is no evidence that the extents match the file.
    if (piece.point_data.empty() && piece.cell_data.empty()) {
      return file->fault("has a piece with no array whose tuples match its points or cells");
    }
  }
  return {};
}

bool has_overlaps(const Snapshot& snapshot) {
  return std::any_of(snapshot.pieces.begin(), snapshot.pieces.end(),
                     [](const Piece& piece) { return piece.overlaps; });
}

const StoredArray* find_array(const std::vector<StoredArray>& arrays, const std::string& name) {
  const auto at = std::find_if(arrays.begin(), arrays.end(),
                               [&](const StoredArray& array) { return array.name == name; });
  return at == arrays.end() ? nullptr : &*at;
}

const StoredArray* first_of(const Snapshot& snapshot, PieceData data, const std::string& name) {
  for (const Piece& piece : snapshot.pieces) {
    if (const StoredArray* array = find_array(piece.*data, name)) return array;
  }
  return nullptr;
}

bool is_ghost(const StoredArray& array) {
  return array.name == ghost_name || array.name == ghost_levels_name;
}

void erase_array(Snapshot& snapshot, PieceData data, const std::string& name) {
  for (Piece& piece : snapshot.pieces) {
    std::erase_if(piece.*data, [&](const StoredArray& array) { return array.name == name; });
  }
}

std::vector<std::string> array_names(const Snapshot& snapshot, PieceData data) {
  std::set<std::string> known;
  std::vector<std::string> out;
  for (const Piece& piece : snapshot.pieces) {
    for (const StoredArray& array : piece.*data) {
      if (!is_ghost(array) && known.insert(array.name).second) out.push_back(array.name);
    }
  }
  return out;
}

void keep_common_arrays(const InputFile& file, Snapshot& snapshot) {
  if (snapshot.pieces.size() < 2) return;
  for (const PieceData data : {&Piece::point_data, &Piece::cell_data}) {
    for (const std::string& name : array_names(snapshot, data)) {
      const StoredArray* first = find_array(snapshot.pieces.front().*data, name);
      const bool common =
          std::all_of(snapshot.pieces.begin(), snapshot.pieces.end(), [&](const Piece& piece) {
            const StoredArray* array = find_array(piece.*data, name);
            return first != nullptr && array != nullptr && array->components == first->components;
          });
      if (common) continue;
      snapshot.leave_out(
          name, "is missing, or has a different type, in a piece of " + in_quotes(file.name()));
      erase_array(snapshot, data, name);
    }
  }
}

}  // namespace windsplat::data::vtk
