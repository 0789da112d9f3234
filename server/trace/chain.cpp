// Division of curves into segments, and their order in memory.
#include "server/trace/chain.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

namespace windsplat::trace {

namespace {

using glm::dvec3;

dvec3 between(const Vertex& from, const Vertex& to) {
  dvec3 way(0);
  for (int c = 0; c < 3; ++c) {
    way[c] = static_cast<double>(to.place[c]) - static_cast<double>(from.place[c]);
  }
  return way;
}

// Zero if the vertices coincide.
std::array<float, 3> bisector(const Vertex& before, const Vertex& at, const Vertex& after) {
  const auto unit = [](const dvec3& way) {
    const double length = glm::length(way);
    return length > 0 ? way / length : way;
  };
  return rounded(unit(between(before, at)) + unit(between(at, after)));
}

// Sheets of 16 bricks of 8 x 8 vertices.
constexpr int brick_side = 8;
constexpr std::size_t sheet_rows = 128;
constexpr std::size_t sheet = brick_side * sheet_rows;

void resize(std::size_t vertices, bool turns, Segments& out) {
  const std::size_t sheets = std::max<std::size_t>((vertices + sheet - 1) / sheet, 1);
  out.dims = {brick_side, static_cast<int>(sheet_rows), static_cast<int>(sheets)};
  const std::size_t count = sheets * sheet + 1;
  for (auto& tangent : out.tangents) tangent.assign(count, 0);
  out.q.assign(count, 0);
  out.magnitudes.assign(count, Segments::none);
  out.phases.assign(count, 0);
  if (turns) out.turns.assign(count, 0);
  out.colors.assign(count, 0);
  out.samples.assign(count, 0);
  out.places.assign(count, {0, 0, 0});
}

void copy(const Vertex& from, std::size_t to, Segments& out) {
  out.places[to] = from.place;
  for (std::size_t c = 0; c < 3; ++c) out.tangents[c][to] = from.tangent[c];
  out.q[to] = from.q;
  out.magnitudes[to] = from.magnitude;
  out.phases[to] = from.phase;
  if (!out.turns.empty()) out.turns[to] = from.turn;
  out.colors[to] = from.color;
  out.samples[to] = from.sample;
}

}  // namespace

std::array<float, 3> rounded(const dvec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

float as_float(double value) {
  constexpr double most = std::numeric_limits<float>::max();
  return std::isnan(value) ? std::numeric_limits<float>::quiet_NaN()
                           : static_cast<float>(std::clamp(value, -most, most));
}

bool Curve::is_close(int count, double departure, double longest) const {
  dvec3 from = place(0, count);
  for (int n = 0; n < count; ++n) {
    const dvec3 to = place(n + 1, count);
    if (glm::length(to - from) > longest) return false;
    for (const double part : {0.25, 0.5, 0.75}) {
      const dvec3 chord = from + part * (to - from);
      if (glm::length(place(n + part, count) - chord) > departure) return false;
    }
    from = to;
  }
  return true;
}

int Curve::pieces(int most, double departure, double longest) const {
  int count = 1;
  while (count < most && !is_close(count, departure, longest)) count = std::min(2 * count, most);
  return count;
}

std::vector<Curve> Curve::by_turns() const {
  // Steps are at most a cell long, so that none has more than one end of a turn.
  std::vector<double> ends{low_};
  const auto seek = [&](double from, double to) {
    const int before = flow_.turn(at(from).index);
    if (flow_.turn(at(to).index) == before) return;
    constexpr int halvings = 50;
    for (int n = 0; n < halvings; ++n) {
      const double middle = 0.5 * (from + to);
      (flow_.turn(at(middle).index) == before ? from : to) = middle;
    }
    ends.push_back(to);
  };
  if (flow_.around > 0) {
    for (auto step = upstream_.steps.rbegin(); step != upstream_.steps.rend(); ++step) {
      seek(-std::min(step->start + step->length, upstream_.length), -step->start);
    }
    for (const Step& step : downstream_.steps) {
      seek(step.start, std::min(step.start + step.length, downstream_.length));
    }
  }
  ends.push_back(high_);
  std::vector<Curve> parts;
  for (std::size_t n = 0; n + 1 < ends.size(); ++n) {
    Curve part = *this;
    part.low_ = ends[n];
    part.high_ = ends[n + 1];
    part.turn_ = flow_.turn(at(0.5 * (part.low_ + part.high_)).index);
    if (part.length() > 0) parts.push_back(part);
  }
  return parts;
}

void set_tangents(std::size_t first, std::vector<Vertex>& vertices) {
  for (std::size_t v = first + 1; v + 1 < vertices.size(); ++v) {
    vertices[v].tangent = bisector(vertices[v - 1], vertices[v], vertices[v + 1]);
  }
}

Segments gather(std::vector<Row>& rows, double magnitude_scale) {
  Segments out;
  out.magnitude_scale = magnitude_scale;
  std::size_t vertices = 0;
  bool turns = false;
  for (const Row& row : rows) {
    vertices += row.vertices.size();
    turns = turns || std::any_of(row.vertices.begin(), row.vertices.end(),
                                 [](const Vertex& vertex) { return vertex.turn != 0; });
  }
  resize(vertices, turns, out);
  std::size_t next = 0;
  for (Row& row : rows) {
    for (std::size_t v = 0; v < row.vertices.size(); ++v) {
      copy(row.vertices[v], next++, out);
      if (!(row.vertices[v].magnitude > Segments::not_drawn)) continue;  // another line follows
      const double chord = glm::length(between(row.vertices[v], row.vertices[v + 1]));
      out.longest = std::max(out.longest, chord);
    }
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

std::int64_t padded(std::int64_t vertices) {
  return vertices + static_cast<std::int64_t>(sheet) + 1;
}

}  // namespace windsplat::trace
