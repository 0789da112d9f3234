// Blocks -> those of the highest rank -> one image, or one mesh.
#include "server/data/formats/vtk/unite.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "server/data/cf/grid/grid.hpp"
#include "server/data/formats/vtk/mesh.hpp"

namespace windsplat::data::vtk {

namespace {

using FilePtr = std::shared_ptr<const InputFile>;

// Limit on the points of a common lattice, relative to those of its blocks.
constexpr double spread_max = 8;
constexpr double lattice_slack = 1e-4;  // of the spacing

int rank_of(const Extent& extent) {
  const auto counts = extent.points();
  return static_cast<int>(
      std::count_if(counts.begin(), counts.end(), [](std::int64_t n) { return n > 1; }));
}

// The highest rank of the cells of a block; 0 without supported cells.
Result<int> rank_of(Files& files, const Snapshot& block) {
  int rank = 0;
  for (const Piece& piece : block.pieces) {
    if (block.kind != Kind::unstructured) {
      rank = std::max(rank, rank_of(piece.extent));
      continue;
    }
    if (!piece.types || rank == 3) continue;
    const auto file = piece.file.open(files);
    if (!file) return file.error();
    const auto types = read_all(*file, *piece.types);
    if (!types) return types.error();
    for (const double type : *types) {
      if (!(type >= 0 && type < 256)) continue;  // reading the cells reports it
      rank = std::max(rank, dimension_of(shape_of_type(static_cast<int>(type))));
    }
  }
  return rank;
}

std::string names_of(const std::vector<std::string>& names) {
  constexpr std::size_t listed_max = 8;
  std::string out;
  for (std::size_t n = 0; n < std::min(names.size(), listed_max); ++n) {
    out += (n > 0 ? ", " : "") + in_quotes(names[n]);
  }
  if (names.size() > listed_max) {
    out += " and " + std::to_string(names.size() - listed_max) + " more";
  }
  return out;
}

// The shift of each block on the lattice of the first, in indices; nullopt if there is none.
std::optional<std::vector<std::array<std::int64_t, 3>>> shifts_of(
    const std::vector<Block>& blocks) {
  const Placement& first = blocks.front().snapshot->place;
  std::vector<std::array<std::int64_t, 3>> out;
  for (const Block& block : blocks) {
    if (block.snapshot->kind != Kind::image) return {};
    const Placement& place = block.snapshot->place;
    for (std::size_t i = 0; i < 9; ++i) {
      if (std::abs(place.direction.at(i) - first.direction.at(i)) > 1e-6) return {};
    }
    std::array<std::int64_t, 3> shift{};
    for (std::size_t a = 0; a < 3; ++a) {
      const double step = first.spacing[a];
      // The columns of a direction are orthogonal.
      double along = 0;
      for (std::size_t w = 0; w < 3; ++w) {
        along += (place.origin[w] - first.origin[w]) * first.direction.at(3 * w + a);
      }
      const double index = along / step;
      const double points = static_cast<double>(block.snapshot->whole.points()[a]);
      const bool fits = std::abs(index) < 1e9 &&
                        std::abs(index - std::round(index)) < lattice_slack &&
                        std::abs(place.spacing[a] - step) * points < lattice_slack * std::abs(step);
      if (!fits) return {};
      shift[a] = std::llround(index);
    }
    out.push_back(shift);
  }
  return out;
}

Extent moved(Extent extent, const std::array<std::int64_t, 3>& shift) {
  for (std::size_t a = 0; a < 3; ++a) {
    extent.first[a] += shift[a];
    extent.last[a] += shift[a];
  }
  return extent;
}

// Moves the pieces of all blocks to a common whole extent; false if they are not on one lattice.
bool make_lattice(std::vector<Block>& blocks, Snapshot& out) {
  const auto shifts = shifts_of(blocks);
  if (!shifts) return false;
  Extent whole = moved(blocks.front().snapshot->whole, shifts->front());
  double sum = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Extent extent = moved(blocks[b].snapshot->whole, (*shifts)[b]);
    double points = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      whole.first[a] = std::min(whole.first[a], extent.first[a]);
      whole.last[a] = std::max(whole.last[a], extent.last[a]);
      points *= static_cast<double>(extent.points()[a]);
    }
    sum += points;
  }
  double all = 1;
  for (const std::int64_t n : whole.points()) all *= static_cast<double>(n);
  if (all > spread_max * sum || all > static_cast<double>(cf::samples_max)) return false;
  out.kind = Kind::image;
  out.whole = whole;
  out.place = blocks.front().snapshot->place;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (Piece& piece : blocks[b].snapshot->pieces) {
      piece.extent = moved(piece.extent, (*shifts)[b]);
      piece.place = out.place;
    }
  }
  return true;
}

// Removes the blocks that are empty or of a lower rank; notes name them.
Result<void> keep_highest(Files& files, std::vector<Block>& blocks, Snapshot& out) {
  std::vector<int> ranks;
  for (const Block& block : blocks) {
    if (!block.snapshot) {
      ranks.push_back(0);
      continue;
    }
    const auto rank = rank_of(files, *block.snapshot);
    if (!rank) return rank.error();
    ranks.push_back(*rank);
  }
  const int highest = ranks.empty() ? 0 : *std::max_element(ranks.begin(), ranks.end());
  std::vector<std::string> flat;
  std::vector<Block> kept;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const bool is_empty = blocks[b].snapshot && blocks[b].snapshot->pieces.empty();
    if (ranks[b] == highest && highest > 1) {
      kept.push_back(std::move(blocks[b]));
    } else if (!is_empty) {
      const std::string& type = blocks[b].other_type;
      flat.push_back(blocks[b].name + (type.empty() ? "" : " (" + type + ")"));
    }
  }
  if (!flat.empty()) {
    out.notes.push_back(std::to_string(flat.size()) +
                        (flat.size() == 1 ? " block is" : " blocks are") +
                        " left out (surfaces, lines or unsupported data): " + names_of(flat));
  }
  blocks = std::move(kept);
  return {};
}

}  // namespace

Result<Snapshot> unite(Files& files, const FilePtr& file, std::vector<Block> blocks) {
  Snapshot out;
  if (auto done = keep_highest(files, blocks, out); !done) return done.error();
  if (blocks.empty()) {
    return file->fault("has no block with a grid that can be shown" +
                       (out.notes.empty() ? "" : "; " + out.notes.front()));
  }
  for (Block& block : blocks) {
    for (Piece& piece : block.snapshot->pieces) {
      piece.kind = block.snapshot->kind;
      piece.place = block.snapshot->place;
      piece.block = out.blocks.size();
    }
    out.blocks.push_back(block.name);
  }
  const Snapshot& first = *blocks.front().snapshot;
  if (blocks.size() == 1) {
    out.kind = first.kind;
    out.whole = first.whole;
    out.place = first.place;
  } else if (!make_lattice(blocks, out)) {
    out.kind = Kind::unstructured;
  }
  out.format = blocks.size() == 1 ? first.format + ", a block" : "VTK blocks";
  std::uint64_t points = 0;
  for (Block& block : blocks) {
    Snapshot& part = *block.snapshot;
    if (!out.time) out.time = part.time;
    for (const LeftOut& left : part.left_out) out.leave_out(left.name, left.reason);
    for (Piece& piece : part.pieces) {
      points += piece.points;
      out.pieces.push_back(std::move(piece));
    }
  }
  if (points > cf::samples_max) {
    return file->fault("has blocks with more than " + std::to_string(cf::samples_max) + " points");
  }
  if (blocks.size() > 1) {
    out.notes.push_back(std::to_string(blocks.size()) + " blocks are shown as one " +
                        (out.kind == Kind::image ? "image: " : "mesh: ") + names_of(out.blocks));
  }
  return out;
}

Result<void> check_overlap(const InputFile& file, Snapshot& snapshot, std::int64_t ghost_level) {
  const auto counts = snapshot.whole.points();
  const auto longest =
      static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  std::vector<Piece*> sorted;
  for (Piece& piece : snapshot.pieces) sorted.push_back(&piece);
  std::sort(sorted.begin(), sorted.end(), [longest](const Piece* a, const Piece* b) {
    return a->extent.first.at(longest) < b->extent.first.at(longest);
  });
  for (std::size_t n = 0; n < sorted.size(); ++n) {
    const Extent& one = sorted[n]->extent;
    for (std::size_t m = n + 1; m < sorted.size(); ++m) {
      const Extent& other = sorted[m]->extent;
      if (other.first.at(longest) >= one.last.at(longest) && counts.at(longest) > 1) break;
      std::int64_t least = counts.at(longest);
      for (std::size_t a = 0; a < 3; ++a) {
        if (counts[a] < 2) continue;  // one layer of points, which all pieces share
        least = std::min(
            least, std::min(one.last[a], other.last[a]) - std::max(one.first[a], other.first[a]));
      }
      if (least > 0) sorted[n]->overlaps = sorted[m]->overlaps = true;
      if (least <= 2 * ghost_level) continue;
      return file.fault("has the pieces " + in_quotes(sorted[n]->file.name) + " and " +
                        in_quotes(sorted[m]->file.name) + " that overlap by " +
                        std::to_string(least) + " cells, more than its GhostLevel of " +
                        std::to_string(ghost_level) + " explains");
    }
  }
  return {};
}

}  // namespace windsplat::data::vtk
