// Seeds, paths and their division into segments.
#include "server/trace/streamlets.hpp"

#include <algorithm>
#include <cmath>

#include "server/base/pcg3d.hpp"
#include "server/trace/chain.hpp"

namespace windsplat::trace {

namespace {

using glm::dvec3;

double unit_interval(std::uint32_t bits) { return static_cast<double>(bits >> 8U) / 16777216.0; }

// A kernel position along an axis: it represents `count` samples about `sample`.
struct Position {
  int sample = 0;
  int count = 1;
};

int positions_along(const Streamlets& of, std::size_t axis) {
  return (of.drawn[axis] + of.stride - 1) / of.stride;
}

Position position_at(const Streamlets& of, std::size_t axis, int n) {
  const int first = n * of.stride;
  const int count = std::min(of.stride, of.drawn[axis] - first);
  return {first + (count - 1) / 2, count};
}

// Makes the lines of one thread.
class Maker {
 public:
  explicit Maker(const Streamlets& of) : of_(of), key_(pcg3d({of.seed, of.epoch, 0x9e3779b9U})) {}

  void add_line(const std::array<Position, 3>& at, Row& row) {
    std::array<std::uint32_t, 3> sample{};
    for (std::size_t a = 0; a < 3; ++a) {
      sample.at(a) = static_cast<std::uint32_t>(of_.first_sample.at(a) + at.at(a).sample);
    }
    const dvec3 centre(at[0].sample, at[1].sample, at[2].sample);
    if (!of_.flow.holds(centre)) return;
    Motion motion;
    if (!motion_at(of_.flow, centre, motion) || !(motion.speed > 0)) return;
    magnitude_ = motion.magnitude;
    const double full = of_.full_magnitude;
    const double part = full > 0 ? std::min(magnitude_ / full, 1.0) : 1.0;
    length_ = of_.length * part;
    const bool drawn = magnitude_ >= of_.least_magnitude;
    if (!drawn || !(length_ > 0)) {
      if (!drawn) add_weak(centre, part, row);
      return;
    }
    const auto first = pcg3d({sample[0] + key_[0], sample[1] + key_[1], sample[2] + key_[2]});
    const auto second = pcg3d(first);
    phase_ = unit_interval(pcg3d(second)[0]);
    dvec3 moved = centre;
    for (int a = 0; a < 3; ++a) {
      const double jitter = of_.jitter_center * (unit_interval(second[a]) - 0.5) +
                            of_.jitter_stride * (unit_interval(first[a]) - 0.5);
      moved[a] += jitter * at[a].count;
    }
    const dvec3 start = of_.flow.holds(moved) ? moved : centre;
    follow(of_.flow, start, 0.5 * length_, true, of_.limits, upstream_);
    follow(of_.flow, start, 0.5 * length_, false, of_.limits, downstream_);
    row.tally.evaluations += 1 + upstream_.evaluations + downstream_.evaluations;
    ++row.tally.ends[static_cast<std::size_t>(upstream_.end)];
    ++row.tally.ends[static_cast<std::size_t>(downstream_.end)];
    if (upstream_.length + downstream_.length > 0) add_segments(row);
  }

 private:
  void add_weak(const dvec3& centre, double part, Row& row) const {
    Vertex vertex;
    vertex.place = rounded(of_.flow.place(centre));
    vertex.q = static_cast<float>(0.5 * part);
    vertex.magnitude = Segments::not_drawn;
    row.vertices.push_back(vertex);
  }

  void add_segments(Row& row) {
    const Curve curve(of_.flow, upstream_, downstream_);
    const int count = curve.pieces(of_.segments_max, chord_departure * curve.length());
    ++row.tally.lines;
    row.tally.segments += count;
    const std::size_t first = row.vertices.size();
    const double scaled = std::max(magnitude_ * of_.magnitude_scale, of_.magnitude_least);
    for (int n = 0; n <= count; ++n) {
      const double s = curve.along(n, count);
      Vertex vertex;
      vertex.place = rounded(of_.flow.place(curve.at(s).index));
      vertex.q = static_cast<float>(std::clamp(s / length_, -0.5, 0.5));
      vertex.phase = static_cast<float>(phase_);
      if (n < count) {
        vertex.magnitude = as_float(scaled);
        const dvec3 middle = curve.at(curve.along(n + 0.5, count)).index;
        Motion motion;
        motion_at(of_.flow, middle, motion);
        vertex.color = as_float(of_.color(middle, motion));
        vertex.sample = of_.flow.nearest(middle);
      }
      row.vertices.push_back(vertex);
    }
    set_tangents(first, row.vertices);
  }

  const Streamlets& of_;
  const std::array<std::uint32_t, 3> key_;
  Path upstream_, downstream_;
  double magnitude_ = 0;
  double length_ = 0;
  double phase_ = 0;
};

// One for each line along x.
Rows rows_of(const Streamlets& of) {
  return {static_cast<std::size_t>(positions_along(of, 1)) *
              static_cast<std::size_t>(positions_along(of, 2)),
          std::int64_t{positions_along(of, 0)} * (of.segments_max + 1)};
}

}  // namespace

Room room_of(const Streamlets& of) { return rows_of(of).room(); }

Segments make_segments(const Streamlets& of, const CancelToken& cancel) {
  const int wide = positions_along(of, 0);
  const auto high = static_cast<std::size_t>(positions_along(of, 1));
  return gather(rows_of(of), of.magnitude_scale, [&](std::size_t n, Row& row) {
    if (cancel.cancelled()) return;
    Maker maker(of);
    const Position y = position_at(of, 1, static_cast<int>(n % high));
    const Position z = position_at(of, 2, static_cast<int>(n / high));
    for (int x = 0; x < wide; ++x) maker.add_line({position_at(of, 0, x), y, z}, row);
  });
}

}  // namespace windsplat::trace
