// Seeds in a field -> the lines through them, as segments: streamlines, or the paths of particles
// in a field that changes.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/trace/segments.hpp"

namespace windsplat::trace {

struct Streamlines {
  Flow flow;
  Limits limits;                  // duration_max: of streamlines, to each side
  std::vector<glm::dvec3> seeds;  // index coordinates; those outside of the flow have no line
  double length = 0;              // arc length to each side at most, world units
  // Paths in a field with frames: the time of the seeds, and how long each is followed back in time
  // and ahead. Empty frames: streamlines.
  double time = 0, back = 0, ahead = 0;
  int pieces_max = 500;  // segments of a line
  double departure = 0;  // of a segment from the curve, world units
  double longest = 0;    // segment, world units
  double full_magnitude = 0;
  double magnitude_scale = 1;  // of Segments::magnitudes
  double magnitude_least = 0;  // those of drawn segments are not less, after scaling
  double dash = 0;             // length of a dash at the full magnitude, world units; 0: none
  std::uint32_t seed = 1, epoch = 0;
  // The value that determines the colour at a place of the lattice.
  std::function<double(const glm::dvec3& index, const Motion& motion)> color;
};

// That of so many lines. `of`: the seeds are not read.
Room room_of(const Streamlines& of, std::int64_t lines);

// Lines in the order of the seeds. A line has 1, 2, 4 ... segments of equal arc length (of paths:
// equal times), at most pieces_max, until they keep to `departure` and `longest`. q runs from -1/2
// at its tail to 1/2 at its head; magnitudes and colours are those in the middle of segments.
//
// Dashes divide a line by the time of the flow: each has the time in which the flow moves by
// dash |V| / full_magnitude where the seed is, so that it is longer where the flow is faster.
// A segment has at most dashes_most of them. Deterministic for any number of threads; incomplete
// if cancelled.
constexpr double dashes_most = 64;
Segments make_streamlines(const Streamlines& of, const CancelToken& cancel = {});

// Places that fill the lattice evenly by world volume, as many as asked for unless most of it is
// masked: those of a sequence of low discrepancy (M. Roberts, The Unreasonable Effectiveness of
// Quasirandom Sequences, 2018; the generalised golden ratio in four dimensions) at which a fourth
// coordinate is below the volume of the cell over the largest. Along axes of one sample index 0.
// Fewer if cancelled.
std::vector<glm::dvec3> evenly(const Flow& flow, int count, const CancelToken& cancel = {});

}  // namespace windsplat::trace
