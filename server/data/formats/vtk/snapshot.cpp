// Validates both kinds of headers: extents within limits, arrays within the file.
#include "server/data/formats/vtk/snapshot.hpp"

#include <algorithm>
#include <utility>

#include "server/base/ascii.hpp"
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

std::string text_of(const Extent& extent) {
  std::string out;
  for (std::size_t a = 0; a < 3; ++a) {
    if (a > 0) out += ' ';
    out += std::to_string(extent.first[a]) + ' ' + std::to_string(extent.last[a]);
  }
  return out;
}

// Memory is allocated for the whole extent, so the pieces must cover it, without excessive overlap.
Result<void> check_cover(const InputFile& file, const Snapshot& snapshot) {
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

Result<void> check_extents(const InputFile& file, Snapshot& snapshot) {
  const auto too_large = [&] {
    return file.fault("has an extent that is empty or beyond the limit of " +
                      std::to_string(cf::samples_max) + " samples");
  };
  if (!product(snapshot.whole.points())) return too_large();
  for (Piece& piece : snapshot.pieces) {
    if (!product(piece.extent.points())) return too_large();
    if (!snapshot.whole.holds(piece.extent)) {
      return file.fault("has a piece that is not within the whole extent");
    }
    piece.points = *product(piece.extent.points());
    piece.cells = *product(piece.extent.cells());
  }
  return check_cover(file, snapshot);
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

Result<void> check_snapshot(const std::shared_ptr<const InputFile>& file, Snapshot& snapshot) {
  if (snapshot.pieces.empty()) return file->fault("has no piece and so no data");
  if (snapshot.kind != Kind::unstructured) {
    if (auto done = check_extents(*file, snapshot); !done) return done;
  }
  for (Piece& piece : snapshot.pieces) {
    if (piece.points > cf::samples_max || piece.cells > cf::samples_max) {
      return file->fault("has more than " + std::to_string(cf::samples_max) + " points or cells");
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

}  // namespace windsplat::data::vtk
