// Division of curves into segments, and their order in memory.
#include "server/trace/chain.hpp"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

#include "server/base/thread_pool.hpp"

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

std::size_t sheets_of(std::size_t vertices) {
  return std::max<std::size_t>((vertices + sheet - 1) / sheet, 1);
}

// Calls use(values, value of a vertex where nothing begins) for the values of vertices, but places
// and turns.
template <class Use>
void each_array(Segments& out, const Use& use) {
  for (auto& tangent : out.tangents) use(tangent, 0.F);
  use(out.q, 0.F);
  use(out.magnitudes, Segments::none);
  use(out.phases, 0.F);
  use(out.colors, 0.F);
  use(out.samples, std::uint32_t{0});
}

void reserve(std::size_t vertices, Segments& out) {
  each_array(out, [&](auto& values, auto) { values.reserve(vertices); });
  out.places.reserve(vertices);
}

// room: vertices at most.
void append(const Row& row, std::size_t room, Segments& out) {
  const std::size_t before = out.places.size();
  for (const Vertex& from : row.vertices) {
    out.places.push_back(from.place);
    for (std::size_t c = 0; c < 3; ++c) out.tangents[c].push_back(from.tangent[c]);
    out.q.push_back(from.q);
    out.magnitudes.push_back(from.magnitude);
    out.phases.push_back(from.phase);
    out.colors.push_back(from.color);
    out.samples.push_back(from.sample);
  }
  const bool turns = std::any_of(row.vertices.begin(), row.vertices.end(),
                                 [](const Vertex& vertex) { return vertex.turn != 0; });
  if (!turns && out.turns.empty()) return;
  out.turns.reserve(room);
  out.turns.resize(before, 0);
  for (const Vertex& from : row.vertices) out.turns.push_back(from.turn);
}

// Padding lies where the last vertex does, so that it widens no brick.
void pad(Segments& out) {
  const std::size_t sheets = sheets_of(out.places.size());
  const std::size_t count = sheets * sheet + 1;
  out.dims = {brick_side, static_cast<int>(sheet_rows), static_cast<int>(sheets)};
  const auto last = out.places.empty() ? std::array<float, 3>{0, 0, 0} : out.places.back();
  out.places.resize(count, last);
  each_array(out, [&](auto& values, auto none) { values.resize(count, none); });
  if (!out.turns.empty()) out.turns.resize(count, 0);
}

void add(const Tally& from, Tally& to) {
  to.lines += from.lines;
  to.segments += from.segments;
  to.evaluations += from.evaluations;
  for (std::size_t e = 0; e < from.ends.size(); ++e) to.ends[e] += from.ends[e];
}

// Rows that are made at a time: at least as many as there are threads.
std::size_t together(const Rows& rows) {
  constexpr std::int64_t vertices_together = std::int64_t{1} << 16U;
  constexpr std::int64_t fewest = 4;
  const std::int64_t most = std::max<std::int64_t>(rows.vertices_most, 1);
  const auto wanted = static_cast<std::size_t>(std::max(vertices_together / most, fewest));
  return std::min(wanted, rows.count);
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

Room Rows::room() const {
  const auto extra = static_cast<std::int64_t>(sheet) + 1;
  Room of;
  of.vertices = static_cast<std::int64_t>(count) * vertices_most + extra;
  const auto made = static_cast<std::uint64_t>(together(*this)) *
                    static_cast<std::uint64_t>(vertices_most) * sizeof(Vertex);
  of.bytes = static_cast<std::uint64_t>(of.vertices) * Segments::vertex_bytes + made;
  return of;
}

Segments gather(const Rows& rows, double magnitude_scale,
                const std::function<void(std::size_t, Row&)>& make) {
  Segments out;
  out.magnitude_scale = magnitude_scale;
  const auto room = static_cast<std::size_t>(rows.room().vertices);
  reserve(room, out);
  std::vector<Row> some(together(rows));
  const auto pool = few_threads(some.size());
  for (std::size_t first = 0; first < rows.count; first += some.size()) {
    const std::size_t now = std::min(some.size(), rows.count - first);
    pool->run(now, [&](std::size_t n, unsigned) {
      some[n].vertices.clear();
      some[n].vertices.reserve(static_cast<std::size_t>(rows.vertices_most));
      some[n].tally = {};
      make(first + n, some[n]);
    });
    for (std::size_t n = 0; n < now; ++n) {
      const std::vector<Vertex>& vertices = some[n].vertices;
      for (std::size_t v = 0; v < vertices.size(); ++v) {
        if (!(vertices[v].magnitude > Segments::not_drawn)) continue;  // another line follows
        out.longest = std::max(out.longest, glm::length(between(vertices[v], vertices[v + 1])));
      }
      append(some[n], room, out);
      add(some[n].tally, out.tally);
    }
  }
  pad(out);
  return out;
}

}  // namespace windsplat::trace
