// Maps the tuples of a piece to sample indices of the whole grid.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/formats/vtk/snapshot.hpp"
#include "server/data/formats/vtk/stored_array.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::vtk {

// Sample indices of the tuples of a piece: offsets from the first sample, in the order of the
// piece. along[a]: distance between neighbours along index axis a.
struct Target {
  std::ptrdiff_t origin = 0;
  std::array<std::ptrdiff_t, 3> along{};
  std::array<std::int64_t, 3> counts{};
};

// The sample indices of the tuples one after the other.
class TargetWalk {
 public:
  explicit TargetWalk(const Target& target) : target_(target), at_(target.origin) {}

  std::size_t next() {
    const std::ptrdiff_t at = at_;
    at_ += target_.along[0];
    if (++index_[0] == target_.counts[0]) {
      index_[0] = 0;
      if (++index_[1] == target_.counts[1]) {
        index_[1] = 0;
        ++index_[2];
      }
      at_ = target_.origin + index_[1] * target_.along[1] + index_[2] * target_.along[2];
    }
    return static_cast<std::size_t>(at);
  }

 private:
  Target target_;
  std::ptrdiff_t at_;
  std::array<std::int64_t, 3> index_{};
};

// Compares what the pieces of a block store for the same samples and do not mark as copies.
class SharedSamples {
 public:
  explicit SharedSamples(std::size_t samples) : is_stored_(samples) {}

  // Begins a piece. The samples of a block may differ from those of the blocks before.
  void begin_piece(std::size_t block, bool of_integers);
  // The components that a piece stores for a sample. held: those before, from any piece, of which
  // each is `stride` after the one before.
  void add(std::size_t sample, const double* values, std::size_t components, const float* held,
           std::size_t stride);
  // Errors: bad_data if two pieces differ by more than a thousandth of the largest value,
  // unless the values name the pieces, as those of vtkProcessId do: one integer in each.
  [[nodiscard]] Result<void> check(const InputFile& file, const std::string& field) const;

 private:
  std::vector<bool> is_stored_;
  std::size_t block_ = 0;
  double largest_ = 0;
  double difference_ = 0;
  bool names_pieces_ = true;
  std::optional<double> name_;  // the first value of a piece
};

// The target of a piece of `whole`. world: for each index axis the axis of the volume; turned:
// whether it is reversed.
Target target_of(const Extent& whole, const Extent& piece, bool of_cells,
                 const std::array<std::size_t, 3>& world, const std::array<bool, 3>& turned);

// Reads an array of a piece without hidden samples and overlaps: component c of a tuple goes to
// out[c * samples + its sample], in whole rows; where samples follow one another like the tuples,
// without a copy. done: called with the number of tuples after each part. Errors: bad_data.
Result<void> read_plain(const std::shared_ptr<const InputFile>& file, const StoredArray& array,
                        const Target& target, std::size_t samples, float* out,
                        const std::function<void(std::size_t tuples)>& done);

// Whether a single piece without ghosts gives all values of a grid.
bool is_one_piece(const Snapshot& snapshot, PieceData data);

// read_plain() of such a piece, in parts. False: samples do not follow one another like the tuples;
// nothing was taken.
Result<bool> read_in_parts(const std::shared_ptr<const InputFile>& file, const StoredArray& array,
                           const Target& target, PartTaker& taker,
                           const std::function<void(std::size_t tuples)>& done);

// Calls take(number of the tuple, its components as doubles) for the tuples of an array, and
// done(number of tuples) after each part. Errors: bad_data.
template <class Take, class Done>
Result<void> read_tuples(const std::shared_ptr<const InputFile>& file, const StoredArray& array,
                         const Take& take, const Done& done) {
  constexpr std::uint64_t tuples_at_once = std::uint64_t{1} << 15;
  auto reader = ArrayReader::open(file, array);
  if (!reader) return reader.error();
  const auto components = static_cast<std::size_t>(array.components);
  std::vector<double> block(std::min(array.tuples, tuples_at_once) * components);
  for (std::uint64_t first = 0; first < array.tuples;) {
    const auto count = static_cast<std::size_t>(std::min(array.tuples - first, tuples_at_once));
    if (auto read = reader->read(block.data(), count * components); !read) return read;
    for (std::size_t i = 0; i < count; ++i) take(first + i, block.data() + i * components);
    first += count;
    done(count);
  }
  return file->check_unchanged();
}

// Masks `values` numbers of a grid before its pieces are read, unless a single piece without ghosts
// gives all of them.
void mask_uncovered(const Snapshot& snapshot, PieceData data, std::size_t values, float* out);

}  // namespace windsplat::data::vtk
