// Which samples of one line lie between those of another.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace windsplat::data::cf {

// Longer dimensions are not compared by their coordinates.
inline constexpr std::size_t compared_length_max = 100'000;

// near_middle: each center within 0.2 of a cell of the middle of two faces, since a mean of values
// elsewhere would be that of another place: levels of two instruments also interleave.
// between: each center anywhere between two faces, for linear interpolation by upper_weights().
enum class Interleaving { near_middle, between };

// The first face of the first center: center i lies between faces i + first and i + first + 1. A
// center beyond the last face lies within one and a half cells of it. Both ascending, three or
// more.
std::optional<std::ptrdiff_t> interleaved(const std::vector<double>& faces,
                                          const std::vector<double>& centers, Interleaving how);

// Weights of face i + first + 1 in the linear interpolation at center i; NaN where a center has one
// face only.
std::vector<double> upper_weights(const std::vector<double>& faces,
                                  const std::vector<double>& centers, std::ptrdiff_t first);

}  // namespace windsplat::data::cf
