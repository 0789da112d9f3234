// Seeds, paths and their division into segments.
#include "server/trace/streamlets.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "server/base/pcg3d.hpp"
#include "server/base/thread_pool.hpp"

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

struct Vertex {
  std::array<float, 3> place{};
  std::array<float, 3> tangent{};
  float q = 0;
  float magnitude = Segments::none;
  float phase = 0;
  float color = 0;
  std::uint32_t sample = 0;
};

std::array<float, 3> rounded(const dvec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

float as_float(double value) {
  constexpr double most = std::numeric_limits<float>::max();
  return std::isnan(value) ? std::numeric_limits<float>::quiet_NaN()
                           : static_cast<float>(std::clamp(value, -most, most));
}

// The lines of one row of kernel positions.
struct Row {
  std::vector<Vertex> vertices;
  Tally tally;
};

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

  // s in [-upstream length, downstream length], world units.
  [[nodiscard]] dvec3 index_at(double s) const {
    return s < 0 ? upstream_.at(-s).index : downstream_.at(s).index;
  }
  // The n-th of `count` + 1 vertices, from the tail to the head; n need not be whole.
  [[nodiscard]] double length_at(double n, int count) const {
    return -upstream_.length + (upstream_.length + downstream_.length) * n / count;
  }
  [[nodiscard]] dvec3 place_at(double n, int count) const {
    return of_.flow.place(index_at(length_at(n, count)));
  }

  // Whether no segment departs too far from the curve, at its middle and quarters.
  [[nodiscard]] bool is_close(int count) const {
    const double most = chord_departure * (upstream_.length + downstream_.length);
    dvec3 from = place_at(0, count);
    for (int n = 0; n < count; ++n) {
      const dvec3 to = place_at(n + 1, count);
      for (const double part : {0.25, 0.5, 0.75}) {
        const dvec3 chord = from + part * (to - from);
        if (glm::length(place_at(n + part, count) - chord) > most) return false;
      }
      from = to;
    }
    return true;
  }

  void add_segments(Row& row) {
    int count = 1;
    while (count < of_.segments_max && !is_close(count))
      count = std::min(2 * count, of_.segments_max);
    ++row.tally.lines;
    row.tally.segments += count;
    const std::size_t first = row.vertices.size();
    const double scaled = std::max(magnitude_ * of_.magnitude_scale, of_.magnitude_least);
    for (int n = 0; n <= count; ++n) {
      const double s = length_at(n, count);
      Vertex vertex;
      vertex.place = rounded(of_.flow.place(index_at(s)));
      vertex.q = static_cast<float>(std::clamp(s / length_, -0.5, 0.5));
      vertex.phase = static_cast<float>(phase_);
      if (n < count) {
        vertex.magnitude = as_float(scaled);
        const dvec3 middle = index_at(length_at(n + 0.5, count));
        Motion motion;
        motion_at(of_.flow, middle, motion);
        vertex.color = as_float(of_.color(middle, motion));
        vertex.sample = of_.flow.nearest(middle);
      }
      row.vertices.push_back(vertex);
    }
    for (std::size_t v = first + 1; v + 1 < row.vertices.size(); ++v) {
      row.vertices[v].tangent = bisector(row.vertices[v - 1], row.vertices[v], row.vertices[v + 1]);
    }
  }

  // Zero if the vertices coincide.
  static std::array<float, 3> bisector(const Vertex& before, const Vertex& at,
                                       const Vertex& after) {
    const auto unit = [](const Vertex& from, const Vertex& to) {
      dvec3 way(0);
      for (int c = 0; c < 3; ++c) {
        way[c] = static_cast<double>(to.place[c]) - static_cast<double>(from.place[c]);
      }
      const double length = glm::length(way);
      return length > 0 ? way / length : way;
    };
    return rounded(unit(before, at) + unit(at, after));
  }

  const Streamlets& of_;
  const std::array<std::uint32_t, 3> key_;
  Path upstream_, downstream_;
  double magnitude_ = 0;
  double length_ = 0;
  double phase_ = 0;
};

void copy(const Vertex& from, std::size_t to, Segments& out) {
  out.places[to] = from.place;
  for (std::size_t c = 0; c < 3; ++c) out.tangents[c][to] = from.tangent[c];
  out.q[to] = from.q;
  out.magnitudes[to] = from.magnitude;
  out.phases[to] = from.phase;
  out.colors[to] = from.color;
  out.samples[to] = from.sample;
}

// Sheets of 16 bricks of 8 x 8 vertices.
constexpr int brick_side = 8;
constexpr std::size_t sheet_rows = 128;
constexpr std::size_t sheet = brick_side * sheet_rows;

void resize(std::size_t vertices, Segments& out) {
  const std::size_t sheets = std::max<std::size_t>((vertices + sheet - 1) / sheet, 1);
  out.dims = {brick_side, static_cast<int>(sheet_rows), static_cast<int>(sheets)};
  const std::size_t count = sheets * sheet + 1;
  for (auto& tangent : out.tangents) tangent.assign(count, 0);
  out.q.assign(count, 0);
  out.magnitudes.assign(count, Segments::none);
  out.phases.assign(count, 0);
  out.colors.assign(count, 0);
  out.samples.assign(count, 0);
  out.places.assign(count, {0, 0, 0});
}

}  // namespace

std::int64_t vertices_at_most(const Streamlets& of) {
  std::int64_t lines = 1;
  for (std::size_t a = 0; a < 3; ++a) lines *= positions_along(of, a);
  return lines * (of.segments_max + 1) + static_cast<std::int64_t>(sheet) + 1;
}

Segments make_segments(const Streamlets& of) {
  const int wide = positions_along(of, 0);
  const auto high = static_cast<std::size_t>(positions_along(of, 1));
  std::vector<Row> rows(high * static_cast<std::size_t>(positions_along(of, 2)));
  const auto pool = few_threads(rows.size());
  pool->run(rows.size(), [&](std::size_t n, unsigned) {
    Maker maker(of);
    const Position y = position_at(of, 1, static_cast<int>(n % high));
    const Position z = position_at(of, 2, static_cast<int>(n / high));
    for (int x = 0; x < wide; ++x) maker.add_line({position_at(of, 0, x), y, z}, rows[n]);
  });
  Segments out;
  out.magnitude_scale = of.magnitude_scale;
  std::size_t vertices = 0;
  for (const Row& row : rows) vertices += row.vertices.size();
  resize(vertices, out);
  std::size_t next = 0;
  for (Row& row : rows) {
    for (const Vertex& vertex : row.vertices) copy(vertex, next++, out);
    row.vertices = {};
    out.tally.lines += row.tally.lines;
    out.tally.segments += row.tally.segments;
    out.tally.evaluations += row.tally.evaluations;
    for (std::size_t e = 0; e < row.tally.ends.size(); ++e) out.tally.ends[e] += row.tally.ends[e];
  }
  // Padding lies where the last vertex does, so that it widens no brick.
  const auto last = next > 0 ? out.places[next - 1] : std::array<float, 3>{0, 0, 0};
  std::fill(out.places.begin() + static_cast<std::ptrdiff_t>(next), out.places.end(), last);
  return out;
}

}  // namespace windsplat::trace
