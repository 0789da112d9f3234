// Segments of triangles -> chains, by the edges at which they meet.
#include "server/surface/contour_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace windsplat::surface {

namespace {

using MeshEdge = std::uint64_t;  // both vertices, the lower one first

MeshEdge mesh_edge(std::uint32_t a, std::uint32_t b) {
  return MeshEdge{std::min(a, b)} << 32U | std::max(a, b);
}

struct Segment {
  std::array<MeshEdge, 2> ends{};
};

struct End {
  MeshEdge edge = 0;
  std::uint32_t segment = 0;
};

// Of Chains: two ends, a flag, and a point of a line, whose arrays grow to twice their size.
constexpr std::size_t chain_bytes = 2 * sizeof(End) + 1 + 4 * sizeof(Point);

class Chains {
 public:
  Chains(const Mesh& mesh, double level, const std::vector<Segment>& segments)
      : mesh_(mesh), level_(level), segments_(segments), used_(segments.size(), false) {
    ends_.reserve(2 * segments.size());
    for (std::uint32_t n = 0; n < segments.size(); ++n) {
      for (const MeshEdge edge : segments[n].ends) ends_.push_back({edge, n});
    }
    std::sort(ends_.begin(), ends_.end(), [](const End& a, const End& b) {
      return a.edge != b.edge ? a.edge < b.edge : a.segment < b.segment;
    });
  }

  using Use = std::function<void(const ContourLine&)>;

  void each(const Use& use, const CancelToken& cancel) {
    // Open lines begin at an edge that only one of their segments has; the others are closed.
    for (std::size_t n = 0; n < ends_.size(); ++n) {
      const bool shared = (n > 0 && ends_[n - 1].edge == ends_[n].edge) ||
                          (n + 1 < ends_.size() && ends_[n + 1].edge == ends_[n].edge);
      if (!shared) follow(ends_[n], use, cancel);
    }
    for (const End& end : ends_) follow(end, use, cancel);
  }

 private:
  void follow(End from, const Use& use, const CancelToken& cancel) {
    if (used_[from.segment] || cancel.cancelled()) return;
    ContourLine line;
    line.level = level_;
    add_end(from.edge, line);
    for (;;) {
      used_[from.segment] = true;
      const Segment& segment = segments_[from.segment];
      from.edge = segment.ends[segment.ends[0] == from.edge ? 1 : 0];
      add_end(from.edge, line);
      auto next = std::lower_bound(ends_.begin(), ends_.end(), from.edge,
                                   [](const End& end, MeshEdge edge) { return end.edge < edge; });
      while (next != ends_.end() && next->edge == from.edge && used_[next->segment]) ++next;
      if (next == ends_.end() || next->edge != from.edge) break;
      from.segment = next->segment;
    }
    use(line);
  }

  void add_end(MeshEdge edge, ContourLine& to) const {
    const auto a = static_cast<std::size_t>(edge >> 32U);
    const auto b = static_cast<std::size_t>(edge & 0xFFFFFFFFU);
    const auto low = static_cast<double>(mesh_.values[a]);
    const double part = (level_ - low) / (static_cast<double>(mesh_.values[b]) - low);
    const auto between = [part](const Point& p, const Point& q) {
      Point out{};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto from = static_cast<double>(p.at(c));
        out.at(c) = static_cast<float>(from + part * (static_cast<double>(q.at(c)) - from));
      }
      return out;
    };
    to.places.push_back(between(mesh_.places[a], mesh_.places[b]));
    to.normals.push_back(between(mesh_.normals[a], mesh_.normals[b]));
  }

  const Mesh& mesh_;
  double level_;
  const std::vector<Segment>& segments_;
  std::vector<bool> used_;
  std::vector<End> ends_;
};

// The two edges of a triangle whose corners lie on different sides of the level.
Segment segment_of(const std::array<std::uint32_t, 3>& corners, const std::array<double, 3>& values,
                   double level) {
  std::array<bool, 3> above{};
  for (std::size_t c = 0; c < 3; ++c) above.at(c) = values.at(c) >= level;
  const std::size_t alone = above[1] == above[2] ? 0 : above[0] == above[2] ? 1 : 2;
  const std::uint32_t from = corners.at(alone);
  return {
      {mesh_edge(from, corners.at((alone + 1) % 3)), mesh_edge(from, corners.at((alone + 2) % 3))}};
}

// Calls use(corners, values, first, last) for the levels [first, last) that a triangle crosses.
template <class Use>
void each_crossing(const Mesh& mesh, const std::vector<double>& levels, const Use& use) {
  if (mesh.values.empty() || levels.empty()) return;
  for (const auto& corners : mesh.triangles) {
    std::array<double, 3> values{};
    for (std::size_t c = 0; c < 3; ++c)
      values.at(c) = static_cast<double>(mesh.values[corners.at(c)]);
    if (std::isnan(values[0] + values[1] + values[2])) continue;
    const auto [least, most] = std::minmax({values[0], values[1], values[2]});
    const auto first = std::upper_bound(levels.begin(), levels.end(), least);
    const auto last = std::upper_bound(first, levels.end(), most);
    if (first == last) continue;
    use(corners, values, static_cast<std::size_t>(first - levels.begin()),
        static_cast<std::size_t>(last - levels.begin()));
  }
}

constexpr std::size_t segments_together = std::size_t{1} << 18U;

}  // namespace

std::vector<std::size_t> contour_segments(const Mesh& mesh, const std::vector<double>& levels) {
  std::vector<std::size_t> begin(levels.size() + 1, 0);
  std::vector<std::size_t> end(levels.size() + 1, 0);
  each_crossing(mesh, levels, [&](const auto&, const auto&, std::size_t first, std::size_t last) {
    ++begin[first];
    ++end[last];
  });
  std::vector<std::size_t> counts(levels.size());
  std::size_t crossing = 0;
  for (std::size_t n = 0; n < levels.size(); ++n) {
    crossing += begin[n];
    crossing -= end[n];
    counts[n] = crossing;
  }
  return counts;
}

void each_contour_line(const Mesh& mesh, const std::vector<double>& levels,
                       const std::function<void(const ContourLine&)>& use,
                       const CancelToken& cancel) {
  const std::vector<std::size_t> counts = contour_segments(mesh, levels);
  for (std::size_t from = 0; from < levels.size() && !cancel.cancelled();) {
    std::size_t sum = counts[from];
    std::size_t to = from + 1;
    while (to < levels.size() && sum + counts[to] <= segments_together) sum += counts[to++];
    std::vector<std::vector<Segment>> segments(to - from);
    for (std::size_t n = from; n < to; ++n) segments[n - from].reserve(counts[n]);
    const std::vector<double> some(levels.begin() + static_cast<std::ptrdiff_t>(from),
                                   levels.begin() + static_cast<std::ptrdiff_t>(to));
    each_crossing(
        mesh, some,
        [&](const auto& corners, const auto& values, std::size_t first, std::size_t last) {
          for (std::size_t n = first; n < last; ++n) {
            segments[n].push_back(segment_of(corners, values, some[n]));
          }
        });
    for (std::size_t n = 0; n < some.size(); ++n) {
      Chains(mesh, some[n], segments[n]).each(use, cancel);
      segments[n] = {};
    }
    from = to;
  }
}

std::size_t contour_line_bytes(std::size_t segments) {
  return std::max(segments, segments_together) * sizeof(Segment) + segments * chain_bytes;
}

}  // namespace windsplat::surface
