#include "server/data/formats/vtk/piece_target.hpp"

#include <algorithm>
#include <cmath>

#include "server/data/cf/time.hpp"

namespace windsplat::data::vtk {

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

}  // namespace windsplat::data::vtk
