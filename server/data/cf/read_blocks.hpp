// Reads one variable at one step into a volume, x fastest: in blocks in the order of the file,
// unpacked and stored with reversed axes.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/cf/array_file.hpp"
#include "server/data/model/box.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::cf {

// The dimensions of a grid in a file, and their orientation and lengths in volumes.
struct Placement {
  std::array<int, 3> space{-1, -1, -1};             // dimension ids of x, y, z; -1: one sample
  int time = -1;                                    // -1: independent of time
  std::array<bool, 3> turned{false, false, false};  // the file has the reverse order
  std::array<std::size_t, 3> length{1, 1, 1};       // samples along x, y, z
  [[nodiscard]] std::size_t layer() const { return length[0] * length[1]; }
};

// A range of levels of a volume, lowest first.
struct Levels {
  std::size_t first = 0;
  std::size_t count = 0;
};

// Unpacked values of those levels of a variable, NaN where masked; `out` has levels.count layers,
// one for a variable without levels. Calls `tell` with the fraction done. Errors: bad_data.
Result<void> read_levels(const ArrayFile& file, const Placement& grid, int variable,
                         std::size_t step, const Levels& levels, float* out, const Progress& tell);
// The same of the samples of a box.
Result<void> read_box(const ArrayFile& file, const Placement& grid, int variable, std::size_t step,
                      const Box& box, float* out, const Progress& tell);

// Tells the file that a box of these variables will be read.
void expect_box(const ArrayFile& file, const Placement& grid, const std::vector<int>& variables,
                std::size_t step, const Box& box);

// Masks columns, x fastest in rows of `width`, in the values of a box of samples. Empty: none.
void mask_columns(const std::vector<bool>& columns, const Box& box, std::size_t width,
                  float* values);

// FieldInfo::box_chunk and box_chunk_first of the components of a field: the longest chunk of any
// component along each axis.
struct BoxChunk {
  std::array<int, 3> length{0, 0, 0};
  std::array<int, 3> first{0, 0, 0};
};
// Lengths of 0 if one of them lacks a dimension of the grid, or is not read by layers.
BoxChunk box_chunk(const ArrayFile& file, const Placement& grid, const std::vector<int>& variables);

// Frees the chunks that the file keeps of a variable, unless they contain other steps, which are
// likely to be read next. For use after all levels of a step have been read.
void forget_step(const ArrayFile& file, const Placement& grid, int variable);
// read_levels(), then forget_step() if the highest level was read: for all levels at once, or from
// the lowest to the highest.
Result<void> read_variable(const ArrayFile& file, const Placement& grid, int variable,
                           std::size_t step, const Levels& levels, float* out,
                           const Progress& tell);

// The parts in which all levels of a variable can be read one after the other, in the order of the
// file, at no greater cost than together: of at most `levels_max` levels, and of whole chunks or of
// chunks that the file keeps between reads, which are few. Empty: there are none.
std::vector<Levels> level_parts(const ArrayFile& file, const Placement& grid, int variable,
                                std::size_t levels_max);

// Converts values to another unit.
void multiply(double factor, std::size_t count, float* values);

// Bytes decoded to read those levels of a variable at one step (see decoded_bytes()), at least the
// size of the volume.
double decoded_step_bytes(const ArrayFile& file, const Placement& grid, int variable,
                          const Levels& levels);

}  // namespace windsplat::data::cf
