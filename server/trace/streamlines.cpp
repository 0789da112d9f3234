// Lines through seeds: both halves of each, its segments and its dashes.
#include "server/trace/streamlines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "server/base/pcg3d.hpp"
#include "server/trace/chain.hpp"

namespace windsplat::trace {

namespace {

using glm::dvec3;

constexpr std::size_t row_seeds = 16;
// Parts of a line that passes the seam of a flat map, at most. Passing it, a line has two vertices
// more.
constexpr int parts_most = 64;

// A line of more parts ends on both sides so that the part with the seed is in the middle of what
// remains, as far as there are parts on both sides.
void shorten(std::vector<Curve>& parts) {
  const auto most = static_cast<std::ptrdiff_t>(parts_most);
  const auto count = static_cast<std::ptrdiff_t>(parts.size());
  if (count <= most) return;
  const auto seed = std::find_if(parts.begin(), parts.end(),
                                 [](const Curve& part) { return part.low() + part.length() >= 0; });
  const auto first = std::clamp<std::ptrdiff_t>(seed - parts.begin() - most / 2, 0, count - most);
  parts = std::vector<Curve>(parts.begin() + first, parts.begin() + first + most);
}

class SeedLines {
 public:
  explicit SeedLines(const Streamlines& of) : of_(of) {}

  void add_line(std::size_t n, Row& row) {
    const dvec3& seed = of_.seeds[n];
    const bool paths = !of_.flow.frames.empty();
    Motion motion;
    if (!of_.flow.holds(seed, of_.time) || !motion_at(of_.flow, seed, motion, of_.time)) return;
    if (paths) {
      follow_through_time(of_.flow, seed, of_.time, of_.back, true, of_.limits, upstream_);
      follow_through_time(of_.flow, seed, of_.time, of_.ahead, false, of_.limits, downstream_);
    } else {
      follow(of_.flow, seed, of_.length, true, of_.limits, upstream_);
      follow(of_.flow, seed, of_.length, false, of_.limits, downstream_);
    }
    row.tally.evaluations += 1 + upstream_.evaluations + downstream_.evaluations;
    ++row.tally.ends[static_cast<std::size_t>(upstream_.end)];
    ++row.tally.ends[static_cast<std::size_t>(downstream_.end)];
    if (upstream_.length + downstream_.length > 0) add_segments(n, paths, dash_time(motion), row);
  }

 private:
  // The time of a dash; 0: none.
  [[nodiscard]] double dash_time(const Motion& motion) const {
    if (!(of_.dash > 0) || !(motion.speed > 0)) return 0;
    const double part = of_.full_magnitude > 0 ? motion.magnitude / of_.full_magnitude : 1;
    return of_.dash * part / motion.speed;
  }

  void add_segments(std::size_t n, bool paths, double dash, Row& row) {
    const Curve curve(of_.flow, upstream_, downstream_);
    const auto number = static_cast<std::uint32_t>(n);
    turns_ = static_cast<double>(pcg3d({number, of_.seed, of_.epoch})[0] >> 8U) / 16777216.0;
    std::vector<Curve> parts = curve.by_turns();
    if (parts.empty()) return;
    shorten(parts);
    low_ = parts.front().low();
    length_ = parts.back().low() + parts.back().length() - low_;
    ++row.tally.lines;
    for (const Curve& part : parts) {
      // Of a line that passes the seam often, each part has its share.
      const auto share = static_cast<double>(of_.pieces_max) * part.length() / length_;
      const int most = std::max(1, static_cast<int>(share));
      add_part(part, curve, part.pieces(most, of_.departure, of_.longest), paths, dash, row);
    }
  }

  void add_part(const Curve& part, const Curve& whole, int count, bool paths, double dash,
                Row& row) {
    row.tally.segments += count;
    const std::size_t first = row.vertices.size();
    const auto time_at = [&](double s) { return paths ? s : whole.at(s).time; };
    for (int v = 0; v <= count; ++v) {
      const double s = part.along(v, count);
      Vertex vertex;
      vertex.place = rounded(part.place(v, count));
      const double q = (s - low_) / length_ - 0.5;
      vertex.q = static_cast<float>(std::clamp(q, -0.5, 0.5));
      if (v < count) {
        set_segment(whole, part.along(v + 0.5, count), paths, vertex);
        const double took = time_at(part.along(v + 1, count)) - time_at(s);
        const double own = dash > 0 ? std::clamp(took / dash, 0.0, dashes_most) : 0;
        vertex.phase = static_cast<float>(turns_ - std::floor(turns_));
        vertex.turn = static_cast<float>(own);
        turns_ += own;
      }
      row.vertices.push_back(vertex);
    }
    set_tangents(first, row.vertices);
  }

  // s: in the middle of the segment.
  void set_segment(const Curve& curve, double s, bool paths, Vertex& vertex) const {
    const dvec3 middle = curve.at(s).index;
    Motion motion;
    motion_at(of_.flow, middle, motion, paths ? of_.time + s : 0);
    vertex.magnitude =
        as_float(std::max(motion.magnitude * of_.magnitude_scale, of_.magnitude_least));
    vertex.color = as_float(of_.color(middle, motion));
    vertex.sample = of_.flow.nearest(middle);
  }

  const Streamlines& of_;
  Path upstream_, downstream_;
  double low_ = 0, length_ = 0;  // of the line drawn
  double turns_ = 0;             // dashes so far
};

Rows rows_of(const Streamlines& of, std::size_t lines) {
  const std::int64_t more = of.flow.around > 0 ? parts_most : 0;
  const std::size_t each = std::min(lines, row_seeds);
  return {(lines + row_seeds - 1) / row_seeds,
          static_cast<std::int64_t>(each) * (of.pieces_max + 1 + 2 * more)};
}

}  // namespace

Room room_of(const Streamlines& of, std::int64_t lines) {
  return rows_of(of, static_cast<std::size_t>(lines)).room();
}

Segments make_streamlines(const Streamlines& of, const CancelToken& cancel) {
  return gather(rows_of(of, of.seeds.size()), of.magnitude_scale, [&](std::size_t n, Row& row) {
    SeedLines lines(of);
    const std::size_t end = std::min(of.seeds.size(), (n + 1) * row_seeds);
    for (std::size_t s = n * row_seeds; s < end && !cancel.cancelled(); ++s) {
      lines.add_line(s, row);
    }
  });
}

std::vector<dvec3> evenly(const Flow& flow, int count, const CancelToken& cancel) {
  constexpr int trials_each = 256;
  constexpr int first_trials = 4096;
  // The root of g^5 = g + 1.
  constexpr double golden = 1.1673039782614187;
  const auto candidate = [&](int n, double& fourth) {
    dvec3 index(0);
    double step = 1;
    for (int a = 0; a < 3; ++a) {
      step /= golden;
      const double turned = 0.5 + step * (n + 1);
      const double part = turned - std::floor(turned);
      const int samples = flow.dims[static_cast<std::size_t>(a)];
      const int wide = a == 0 && flow.around > 0 ? flow.around : samples;
      if (wide > 1) index[a] = part * wide - 0.5;
    }
    const double turned = 0.5 + step / golden * (n + 1);
    fourth = turned - std::floor(turned);
    return index;
  };
  double largest = 0;
  double fourth = 0;
  for (int n = 0; n < first_trials && !cancel.cancelled(); ++n) {
    largest = std::max(largest, flow.cell_volume(candidate(n, fourth)));
  }
  std::vector<dvec3> out;
  for (int n = 0; n < trials_each * count && static_cast<int>(out.size()) < count; ++n) {
    if (cancel.cancelled()) break;
    const dvec3 index = candidate(n, fourth);
    if (fourth * largest < flow.cell_volume(index) && flow.holds(index)) out.push_back(index);
  }
  return out;
}

}  // namespace windsplat::trace
