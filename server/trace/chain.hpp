// The two halves of a path -> the vertices of a chain of segments.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <vector>

#include "server/trace/segments.hpp"

namespace windsplat::trace {

// The vertex v of Segments, by itself.
struct Vertex {
  std::array<float, 3> place{};
  std::array<float, 3> tangent{};
  float q = 0;
  float magnitude = Segments::none;
  float phase = 0;
  float turn = 0;
  float color = 0;
  std::uint32_t sample = 0;
};

// Lines that one thread makes.
struct Row {
  std::vector<Vertex> vertices;
  Tally tally;
};

std::array<float, 3> rounded(const glm::dvec3& v);
// Clamped to the finite floats; NaN remains.
float as_float(double value);

// A line through the place from which both halves start, s from -(length upstream) to (length
// downstream) along what the paths count by, or a part of it.
class Curve {
 public:
  Curve(const Flow& flow, const Path& upstream, const Path& downstream)
      : flow_(flow),
        upstream_(upstream),
        downstream_(downstream),
        low_(-upstream.length),
        high_(downstream.length) {}

  [[nodiscard]] double length() const { return high_ - low_; }
  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] Place at(double s) const { return s < 0 ? upstream_.at(-s) : downstream_.at(s); }
  // s of the n-th of `count` + 1 vertices, from the tail to the head; n need not be whole.
  [[nodiscard]] double along(double n, int count) const { return low_ + length() * n / count; }
  [[nodiscard]] glm::dvec3 place(double n, int count) const {
    return flow_.place(flow_.within_turn(at(along(n, count)).index, turn_));
  }

  // 1, 2, 4 ... pieces, at most `most`, until none departs from the curve by more than `departure`
  // at its middle and quarters, nor is longer than `longest`. World units.
  [[nodiscard]] int pieces(int most, double departure, double longest = HUGE_VAL) const;

  // The parts of it within one turn of a flat lattice that closes, from the tail to the head.
  [[nodiscard]] std::vector<Curve> by_turns() const;

 private:
  [[nodiscard]] bool is_close(int count, double departure, double longest) const;

  const Flow& flow_;
  const Path& upstream_;
  const Path& downstream_;
  double low_, high_;  // s
  int turn_ = 0;
};

// Sets the tangents of the vertices of a line, which begin at `first` and end with the last.
void set_tangents(std::size_t first, std::vector<Vertex>& vertices);

// Lines that are made in rows, each of at most so many vertices.
struct Rows {
  std::size_t count = 0;
  std::int64_t vertices_most = 0;  // of a row

  [[nodiscard]] Room room() const;
};

// The rows one after the other, made by make(number, row) on several threads, some at a time:
// storage is reserved for all vertices that there may be, and becomes memory as they come.
Segments gather(const Rows& rows, double magnitude_scale,
                const std::function<void(std::size_t, Row&)>& make);

}  // namespace windsplat::trace
