#include "server/data/formats/vtk/piece_target.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/data/cf/time.hpp"

namespace windsplat::data::vtk {

namespace {

constexpr std::size_t direct_values = std::size_t{1} << 22;  // read at once
constexpr std::size_t copied_values = std::size_t{1} << 18;

bool is_contiguous(const Target& target) {
  return target.along[0] == 1 && target.along[1] == target.counts[0] &&
         target.along[2] == target.counts[0] * target.counts[1];
}

}  // namespace

Target target_of(const Extent& whole, const Extent& piece, bool of_cells,
                 const std::array<std::size_t, 3>& world, const std::array<bool, 3>& turned) {
  const auto all = of_cells ? whole.cells() : whole.points();
  Target out;
  out.counts = of_cells ? piece.cells() : piece.points();
  std::array<std::int64_t, 3> dims{};
  for (std::size_t a = 0; a < 3; ++a) dims.at(world[a]) = all[a];
  const std::array<std::int64_t, 3> stride{1, dims[0], dims[0] * dims[1]};
  for (std::size_t a = 0; a < 3; ++a) {
    // A piece of one layer of points at the end has its cells in the last layer.
    const std::int64_t first = std::min(piece.first[a] - whole.first[a], all[a] - out.counts[a]);
    const std::int64_t step = stride.at(world[a]);
    out.along[a] = turned[a] ? -step : step;
    out.origin += turned[a] ? (all[a] - 1 - first) * step : first * step;
  }
  return out;
}

void SharedSamples::begin_piece(std::size_t block, bool of_integers) {
  names_pieces_ = names_pieces_ && of_integers;
  name_.reset();
  if (block == block_) return;
  block_ = block;
  std::fill(is_stored_.begin(), is_stored_.end(), false);
}

void SharedSamples::add(std::size_t sample, const double* values, std::size_t components,
                        const float* held, std::size_t stride) {
  for (std::size_t c = 0; c < components; ++c) {
    if (!std::isfinite(values[c])) continue;
    names_pieces_ = names_pieces_ && name_.value_or(values[c]) == values[c];
    name_ = values[c];
    largest_ = std::max(largest_, std::abs(values[c]));
    const auto before = static_cast<double>(held[c * stride]);
    if (!is_stored_[sample] || !std::isfinite(before)) continue;
    difference_ = std::max(difference_, std::abs(values[c] - before));
  }
  is_stored_[sample] = true;
}

Result<void> SharedSamples::check(const InputFile& file, const std::string& field) const {
  constexpr double tolerance = 1e-3;  // neighbours may have computed their copies
  if (difference_ <= tolerance * largest_ || names_pieces_) return {};
  return file.fault("has pieces that overlap with different values of " + in_quotes(field) +
                    " (by up to " + cf::number_text(difference_) +
                    "), which no vtkGhostType marks as copies");
}

Result<void> read_plain(const std::shared_ptr<const InputFile>& file, const StoredArray& array,
                        const Target& target, std::size_t samples, float* out,
                        const std::function<void(std::size_t tuples)>& done) {
  auto reader = ArrayReader::open(file, array);
  if (!reader) return reader.error();
  if (array.tuples == 0) return {};
  const auto components = static_cast<std::size_t>(array.components);
  const auto row = static_cast<std::size_t>(target.counts[0]);
  const auto rows = static_cast<std::size_t>(target.counts[1] * target.counts[2]);
  const bool direct = components == 1 && is_contiguous(target);
  const std::size_t most =
      std::max<std::size_t>(1, (direct ? direct_values : copied_values) / (row * components));
  std::vector<float> block(direct ? 0 : std::min(most, rows) * row * components);
  for (std::size_t first = 0; first < rows; first += most) {
    const std::size_t count = std::min(most, rows - first);
    float* into = direct ? out + target.origin + first * row : block.data();
    if (auto read = reader->read(into, count * row * components); !read) return read;
    const float* from = block.data();
    for (std::size_t r = first; !direct && r < first + count; ++r) {
      const auto j = static_cast<std::ptrdiff_t>(r) % target.counts[1];
      const auto k = static_cast<std::ptrdiff_t>(r) / target.counts[1];
      float* to = out + target.origin + j * target.along[1] + k * target.along[2];
      for (std::size_t i = 0; i < row; ++i, to += target.along[0]) {
        for (std::size_t c = 0; c < components; ++c) to[c * samples] = *from++;
      }
    }
    done(count * row);
  }
  return file->check_unchanged();
}

bool is_one_piece(const Snapshot& snapshot, PieceData data) {
  if (snapshot.pieces.size() != 1 || snapshot.blocks.size() > 1) return false;
  const Piece& piece = snapshot.pieces.front();
  const auto& arrays = piece.*data;
  return piece.extent == snapshot.whole && std::none_of(arrays.begin(), arrays.end(), is_ghost);
}

Result<bool> read_in_parts(const std::shared_ptr<const InputFile>& file, const StoredArray& array,
                           const Target& target, PartTaker& taker,
                           const std::function<void(std::size_t tuples)>& done) {
  const auto layer = static_cast<std::size_t>(target.counts[0] * target.counts[1]);
  const auto layers = static_cast<std::size_t>(target.counts[2]);
  const auto components = static_cast<std::size_t>(array.components);
  if (!is_contiguous(target) || array.tuples != layer * layers) return false;
  auto reader = ArrayReader::open(file, array);
  if (!reader) return reader.error();
  // Tuples of several components pass through memory of as many values as a part.
  const std::size_t most = std::max<std::size_t>(1, taker.layers_max() / components);
  std::vector<float> block(components == 1 ? 0 : std::min(most, layers) * layer * components);
  for (std::size_t first = 0; first < layers; first += most) {
    const std::size_t count = std::min(most, layers - first);
    const std::size_t tuples = count * layer;
    float* const into = components == 1 ? taker.room() : block.data();
    if (auto read = reader->read(into, tuples * components); !read) return read.error();
    for (std::size_t c = 0; c < components; ++c) {
      float* const room = components == 1 ? into : taker.room();
      for (std::size_t i = 0; i < tuples && components > 1; ++i) {
        room[i] = block[i * components + c];
      }
      taker.take({c, first, count});
    }
    done(tuples);
  }
  if (auto same = file->check_unchanged(); !same) return same.error();
  return true;
}

void mask_uncovered(const Snapshot& snapshot, PieceData data, std::size_t values, float* out) {
  if (is_one_piece(snapshot, data)) return;
  std::fill_n(out, values, std::numeric_limits<float>::quiet_NaN());
}

}  // namespace windsplat::data::vtk
