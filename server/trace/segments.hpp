// Curved lines as chains of straight segments, in the order in which the engine draws them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/trace/path.hpp"

namespace windsplat::trace {

// What the segments were made of, for the report of a frame.
struct Tally {
  std::int64_t lines = 0;  // that are drawn
  std::int64_t segments = 0;
  std::int64_t evaluations = 0;                // of the flow
  std::array<std::int64_t, end_count> ends{};  // of both ends of each line, by End
};

// Vertex v begins a segment to vertex v + 1 if its magnitude is drawn. Vertices fill a lattice of
// dims samples, x fastest, of which 8 x 8 along x and y are drawn together; one more follows it.
struct Segments {
  std::array<int, 3> dims{8, 8, 0};
  std::vector<std::array<float, 3>> places;  // world units
  // Where two segments meet, the bisector of their directions, of any length; zero at the ends of a
  // line, and where nothing begins.
  std::array<std::vector<float>, 3> tangents;
  // Arc length from the middle of the whole line over its length: -1/2 at its tail, 1/2 at its
  // head. Of a line that is not drawn, half of its length over the full length.
  std::vector<float> q;
  // Magnitude of the sample times magnitude_scale; below 0: no segment begins; not_drawn: a line
  // below the least magnitude.
  std::vector<float> magnitudes;
  double magnitude_scale = 1;  // a power of two, as the engine chooses it
  std::vector<float> phases;   // [0, 1), for phase motion
  // Of dashes: phases are the places of the vertices in their dash, and these the numbers of dashes
  // that segments have. Empty: a line has one texture, along q.
  std::vector<float> turns;
  std::vector<float> colors;           // the value that determines the colour; NaN: unknown
  std::vector<std::uint32_t> samples;  // number of the sample nearest to the middle, x fastest
  double longest = 0;                  // chord of a segment, world units
  Tally tally;

  // 2^-e for a full magnitude of the order of 2^e beyond [1e-15, 1e15], where squares and inverses
  // of floats could leave their range; otherwise 1.
  [[nodiscard]] static double scale_of(double full_magnitude) {
    const bool moderate =
        !(full_magnitude > 0) || (full_magnitude >= 1e-15 && full_magnitude <= 1e15);
    return moderate ? 1 : std::exp2(-std::ilogb(full_magnitude));
  }

  static constexpr float none = -1;
  static constexpr float not_drawn = 0x1p-125F;

  [[nodiscard]] std::size_t vertices() const { return magnitudes.size(); }
  // Bytes of each vertex.
  static constexpr std::size_t vertex_bytes = 12 * sizeof(float);
};

// What lines need at most: their vertices, and memory while they are made and after.
struct Room {
  std::int64_t vertices = 0;
  std::uint64_t bytes = 0;
};

}  // namespace windsplat::trace
