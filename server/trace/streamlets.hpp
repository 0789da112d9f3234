// Kernel positions of a field -> curved lines that follow its flow, as segments.
#pragma once

#include <cstdint>
#include <functional>

#include "server/base/cancel.hpp"
#include "server/trace/segments.hpp"

namespace windsplat::trace {

struct Streamlets {
  Flow flow;
  Limits limits;
  int stride = 1;
  std::array<int, 3> drawn{1, 1, 1};  // number of samples along each axis that have lines
  double length = 0;                  // arc length at the full magnitude and above, world units
  double full_magnitude = 0;          // 0: every line has the whole length
  double least_magnitude = 0;         // weaker lines are not drawn
  double magnitude_scale = 1;         // of Segments::magnitudes
  double magnitude_least = 0;         // those of drawn lines are not less, after scaling
  int segments_max = 8;               // of a line
  double jitter_center = 0;
  double jitter_stride = 0;
  std::array<int, 3> first_sample{0, 0, 0};  // index among those of the data, for the jitter
  std::uint32_t seed = 1;
  std::uint32_t epoch = 0;
  // The value that determines the colour at a place of the lattice.
  std::function<double(const glm::dvec3& index, const Motion& motion)> color;
};

Room room_of(const Streamlets& of);

// A line is centred on the jittered position of the kernel (that of the straight line; the position
// of the sample where that is masked or outside), half of its length upstream and half downstream,
// and is shorter where the flow ends. Its length follows from the magnitude of the sample, as that
// of the straight line does. It is divided into 1, 2, 4 ... segments, at most segments_max, until
// none departs from the curve by more than chord_departure of the length. Lines are in the order of
// the kernel positions, x fastest. Computed on several threads; deterministic; incomplete if
// cancelled.
constexpr double chord_departure = 1.0 / 200;
Segments make_segments(const Streamlets& of, const CancelToken& cancel = {});

}  // namespace windsplat::trace
