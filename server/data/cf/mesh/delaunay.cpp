// The vertices of the Voronoi diagram (Boost.Polygon) are the polygons.
#include "server/data/cf/mesh/delaunay.hpp"

#include <algorithm>
#include <boost/polygon/voronoi.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "server/data/cf/mesh/directions.hpp"

namespace windsplat::data::cf {

namespace {

using ChartPoint = boost::polygon::point_data<std::int32_t>;
using Diagram = boost::polygon::voronoi_diagram<double>;

constexpr double chart_extent = 1 << 30;
constexpr double same_position = 1e-8;  // radians: 6 cm on the Earth
constexpr double merged_max = 1e-6;     // radians: 6 m; in a chart
constexpr double fullness_min = 0.02;   // triangles of a lattice of 1 to 25
constexpr double near_share = 1e-3;     // of the mean spacing
constexpr double pair_share = 0.05;     // of the way to the next position from either

class Triangulator {
 public:
  Result<Triangulation> make(std::vector<double> longitudes, std::vector<double> latitudes) {
    if (auto fine = take_positions(longitudes, latitudes); !fine) return fine.error();
    const std::size_t given = used_.size();
    merge_repeated();
    if (used_.size() >= centers_min) {
      if (auto done = find_polygons(); !done) return done.error();
    }
    if (given - out_.repeated < centers_min) return too_few(given - out_.repeated);
    for (const bool by_pairs : {false, true}) {
      if (fullness_above(0.25) >= fullness_min) break;
      if (!(by_pairs ? merge_pairs() : merge_near())) continue;
      if (used_.size() < centers_min) return too_few(used_.size());
      if (auto done = find_polygons(); !done) return done.error();
    }
    if (auto fine = leave_out_gaps(); !fine) return fine.error();
    Mesh& mesh = out_.mesh;
    mesh.on_sphere = true;
    mesh.twins = std::move(twins_);
    // Positions that are missing are no corners.
    for (std::size_t i = 0; i < longitudes.size(); ++i) {
      if (std::isfinite(longitudes[i]) && std::isfinite(latitudes[i])) continue;
      longitudes[i] = longitudes[used_.front()];
      latitudes[i] = latitudes[used_.front()];
    }
    mesh.x = std::move(longitudes);
    mesh.y = std::move(latitudes);
    return std::move(out_);
  }

 private:
  Result<void> take_positions(const std::vector<double>& longitudes,
                              const std::vector<double>& latitudes) {
    directions_.resize(longitudes.size());
    for (std::size_t i = 0; i < longitudes.size(); ++i) {
      if (!std::isfinite(longitudes[i]) || !std::isfinite(latitudes[i])) {
        ++out_.missing;
        continue;
      }
      if (!(std::abs(longitudes[i]) <= 1080 && std::abs(latitudes[i]) <= 90 + 1e-6)) {
        return make_error(ErrorKind::bad_data, "entry " + std::to_string(i + 1) +
                                                   " of a list of cells has a position " +
                                                   "that is no longitude and latitude in degrees");
      }
      directions_[i] = direction_of(longitudes[i], latitudes[i]);
      used_.push_back(static_cast<std::uint32_t>(i));
    }
    return {};
  }

  // Leaves the first of equal positions. Those on both sides of a rounding stay, which is harmless.
  void merge_repeated() {
    using Place = std::array<std::int32_t, 3>;
    std::vector<std::pair<Place, std::uint32_t>> places;
    places.reserve(used_.size());
    for (const std::uint32_t i : used_) {
      Place place{};
      for (std::size_t a = 0; a < 3; ++a) {
        place.at(a) = static_cast<std::int32_t>(std::lround(directions_[i].at(a) / same_position));
      }
      places.emplace_back(place, i);
    }
    std::sort(places.begin(), places.end());
    used_.clear();
    for (std::size_t n = 0; n < places.size(); ++n) {
      if (n > 0 && places[n].first == places[n - 1].first) {
        twins_.push_back({used_.back(), places[n].second});
      } else {
        used_.push_back(places[n].second);
      }
    }
    out_.repeated = twins_.size();
    repeated_ = out_.repeated;
    std::sort(used_.begin(), used_.end());
  }

  static Error too_few(std::size_t different) {
    return make_error(ErrorKind::bad_data,
                      "a list of cells without outlines has " + std::to_string(different) +
                          " different positions: at least " + std::to_string(centers_min) +
                          " are needed to draw them");
  }

  // The mean distance of positions if they filled the polygons evenly, as a chord.
  [[nodiscard]] double mean_spacing() const {
    const Mesh& mesh = out_.mesh;
    double all = 0;
    for (std::size_t c = 0; c < mesh.cells(); ++c) all += area_of(c);
    return std::sqrt(all / static_cast<double>(used_.size()));
  }

  // Sites that are listed twice with slightly different positions make slivers of half of the
  // triangles.
  // Leaves the first of positions within near_share of the mean spacing of each other, and no
  // polygons; false if there are none such. A cube of that size holds a bounded number of those
  // left, so that each is compared with few.
  bool merge_near() {
    const double apart = near_share * mean_spacing();
    if (!(apart > 2 * same_position)) return false;
    std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cubes;
    const auto cube_of = [&](const Direction& d, std::size_t a, int step) {
      constexpr double from_zero = 2;  // directions are of unit length
      return static_cast<std::uint64_t>((d.at(a) + from_zero) / apart + step);
    };
    const auto key_at = [&](const Direction& d, int x, int y, int z) {
      constexpr std::uint64_t bits = 21;
      constexpr std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
      return (cube_of(d, 0, x) & mask) << (2 * bits) | (cube_of(d, 1, y) & mask) << bits |
             (cube_of(d, 2, z) & mask);
    };
    // The one left that a position is near to, or itself.
    const auto nearest_left = [&](std::uint32_t i) {
      const Direction& own = directions_[i];
      for (int n = 0; n < 27; ++n) {
        const auto found = cubes.find(key_at(own, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
        if (found == cubes.end()) continue;
        for (const std::uint32_t other : found->second) {
          if (distance(directions_[other], own) <= apart) return other;
        }
      }
      return i;
    };
    std::vector<std::uint32_t> left;
    for (const std::uint32_t i : used_) {
      if (const std::uint32_t other = nearest_left(i); other != i) {
        twins_.push_back({other, i});
        continue;
      }
      cubes[key_at(directions_[i], 0, 0, 0)].push_back(i);
      left.push_back(i);
    }
    return leave(std::move(left), apart);
  }

  // Sites that are listed twice, farther apart than that: positions whose nearest are each other,
  // at less than pair_share of the way from either to any other. Neighbours along an edge of the
  // polygons suffice, since the nearest position of each is one of them. Leaves the first of both.
  bool merge_pairs() {
    struct Near {
      float distance = std::numeric_limits<float>::infinity();
      float second = std::numeric_limits<float>::infinity();  // to another position
      std::uint32_t position = 0;
    };
    const Mesh& mesh = out_.mesh;
    std::vector<Near> near(directions_.size());
    const auto take = [&](std::uint32_t from, std::uint32_t to, float length) {
      Near& own = near[from];
      if (to == own.position && length == own.distance) return;
      if (length < own.distance) {
        own.second = own.distance;
        own.distance = length;
        own.position = to;
      } else {
        own.second = std::min(own.second, length);
      }
    };
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        const std::uint32_t next = i + 1 < mesh.first[c + 1] ? i + 1 : mesh.first[c];
        const float length = edge_length(c, i);
        take(mesh.corners[i], mesh.corners[next], length);
        take(mesh.corners[next], mesh.corners[i], length);
      }
    }
    std::vector<std::uint32_t> left;
    float widest = 0;
    for (const std::uint32_t i : used_) {
      const Near& own = near[i];
      const Near& other = near[own.position];
      const bool is_pair = std::isfinite(own.second) && std::isfinite(other.second) &&
                           other.position == i &&
                           static_cast<double>(own.distance) <=
                               pair_share * static_cast<double>(std::min(own.second, other.second));
      if (!is_pair || i < own.position) {
        left.push_back(i);
        continue;
      }
      twins_.push_back({own.position, i});
      widest = std::max(widest, own.distance);
    }
    return leave(std::move(left), static_cast<double>(widest));
  }

  // Leaves these positions and no polygons; false if that are all.
  bool leave(std::vector<std::uint32_t> left, double apart) {
    if (left.size() == used_.size()) return false;
    out_.mesh = Mesh();
    out_.near += used_.size() - left.size();
    out_.near_degrees = std::max(out_.near_degrees, apart / unit_degree);
    out_.repeated = repeated_;
    used_ = std::move(left);
    return true;
  }

  // Positions within 120 degrees of their mean leave room opposite to it. Others surround the
  // globe: then the direction of some hundred that is farthest from them, as is its opposite.
  Direction choose_origin() {
    constexpr double room = -0.5;
    Direction sum{};
    for (const std::uint32_t i : used_) {
      for (std::size_t a = 0; a < 3; ++a) sum.at(a) += directions_[i].at(a);
    }
    const double length = std::sqrt(dot(sum, sum));
    if (length > 1e-3 * static_cast<double>(used_.size())) {
      const Direction middle = unit(sum);
      closed_ = std::any_of(used_.begin(), used_.end(),
                            [&](std::uint32_t i) { return dot(directions_[i], middle) < room; });
      if (!closed_) return opposite(middle);
    }
    constexpr int tried = 128;
    Direction best{};
    double nearest = 2;
    for (int n = 0; n < tried; ++n) {
      // A spiral around the globe, off its axis.
      const Direction one = unit(direction_of(222.49223594996215 * n + 1.234567,
                                              std::asin((n + 0.5) / tried) / unit_degree));
      double near = 0;
      for (const std::uint32_t i : used_) near = std::max(near, std::abs(dot(directions_[i], one)));
      if (near >= nearest) continue;
      nearest = near;
      best = one;
    }
    return best;
  }

  struct Chart {
    std::vector<ChartPoint> points;
    std::vector<std::uint32_t> sources;  // positions
  };

  // The chart of `positions` projected from `origin`. Equal points are one.
  Result<Chart> chart_of(const std::vector<std::uint32_t>& positions, const Direction& origin) {
    const Direction aside = std::abs(origin[2]) < 0.9 ? Direction{0, 0, 1} : Direction{1, 0, 0};
    const Direction first = unit(cross(origin, aside));
    const Direction second = cross(origin, first);
    std::vector<std::array<double, 2>> plane;
    double extent = 1e-9;
    for (const std::uint32_t i : positions) {
      const Direction& own = directions_[i];
      const double apart = distance(own, origin);
      const double below = apart * apart / 2;  // 1 - cos of the angle
      plane.push_back({dot(own, first) / below, dot(own, second) / below});
      extent = std::max({extent, std::abs(plane.back()[0]), std::abs(plane.back()[1])});
    }
    using Placed = std::pair<std::array<std::int32_t, 2>, std::uint32_t>;
    std::vector<Placed> placed;
    placed.reserve(positions.size());
    for (std::size_t n = 0; n < positions.size(); ++n) {
      const auto whole = [&](double value) {
        return static_cast<std::int32_t>(std::lround(value / extent * chart_extent));
      };
      placed.push_back({{whole(plane[n][0]), whole(plane[n][1])}, positions[n]});
    }
    std::sort(placed.begin(), placed.end());
    Chart out;
    for (const auto& [point, i] : placed) {
      const ChartPoint own(point[0], point[1]);
      if (out.points.empty() || !(own == out.points.back())) {
        out.points.push_back(own);
        out.sources.push_back(i);
        continue;
      }
      ++out_.repeated;
      twins_.push_back({out.sources.back(), i});
      if (distance(directions_[i], directions_[out.sources.back()]) <= merged_max) continue;
      return make_error(ErrorKind::bad_data,
                        "entries " + std::to_string(out.sources.back() + 1) + " and " +
                            std::to_string(i + 1) +
                            " of a list of cells cannot be told apart where all are triangulated: "
                            "the positions are too close together for how far they spread");
    }
    return out;
  }

  void add_polygon(const Diagram::vertex_type& vertex, const Chart& chart) {
    Mesh& mesh = out_.mesh;
    const auto* edge = vertex.incident_edge();
    do {
      mesh.corners.push_back(chart.sources[edge->cell()->source_index()]);
      edge = edge->rot_next();
    } while (edge != vertex.incident_edge());
    mesh.first.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
  }

  Result<void> find_polygons() {
    const Direction origin = choose_origin();
    const auto chart = chart_of(used_, origin);
    if (!chart) return chart.error();
    if (chart->points.size() < centers_min) return {};
    Diagram diagram;
    boost::polygon::construct_voronoi(chart->points.begin(), chart->points.end(), &diagram);
    out_.mesh.first.push_back(0);
    for (const auto& vertex : diagram.vertices()) add_polygon(vertex, *chart);
    if (!closed_) return {};
    std::vector<std::uint32_t> rim;
    for (const auto& edge : diagram.edges()) {
      if (!edge.is_infinite()) continue;
      rim.push_back(chart->sources[edge.cell()->source_index()]);
      rim.push_back(chart->sources[edge.twin()->cell()->source_index()]);
    }
    std::sort(rim.begin(), rim.end());
    rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
    return close(rim, origin);
  }

  // Polygons whose circles contain the origin of the chart: their corners are at its rim.
  Result<void> close(const std::vector<std::uint32_t>& rim, const Direction& origin) {
    const auto chart = chart_of(rim, opposite(origin));
    if (!chart) return chart.error();
    Diagram diagram;
    boost::polygon::construct_voronoi(chart->points.begin(), chart->points.end(), &diagram);
    for (const auto& vertex : diagram.vertices()) {
      const ChartPoint& corner = chart->points[vertex.incident_edge()->cell()->source_index()];
      const double radius = std::hypot(vertex.x() - corner.x(), vertex.y() - corner.y());
      if (std::hypot(vertex.x(), vertex.y()) < radius) add_polygon(vertex, *chart);
    }
    return {};
  }

  [[nodiscard]] float edge_length(std::size_t cell, std::uint32_t corner) const {
    const Mesh& mesh = out_.mesh;
    const std::uint32_t next = corner + 1 < mesh.first[cell + 1] ? corner + 1 : mesh.first[cell];
    return static_cast<float>(
        distance(directions_[mesh.corners[corner]], directions_[mesh.corners[next]]));
  }

  [[nodiscard]] double area_of(std::size_t cell) const {
    const Mesh& mesh = out_.mesh;
    const Direction& apex = directions_[mesh.corners[mesh.first[cell]]];
    Direction area{};
    for (std::uint32_t i = mesh.first[cell]; i + 1 < mesh.first[cell + 1]; ++i) {
      const Direction part = cross(between(apex, directions_[mesh.corners[i]]),
                                   between(apex, directions_[mesh.corners[i + 1]]));
      for (std::size_t a = 0; a < 3; ++a) area.at(a) += part.at(a) / 2;
    }
    return std::sqrt(dot(area, area));
  }

  // The area in squares of their longest edge that this share of the polygons is below.
  [[nodiscard]] double fullness_above(double share) const {
    const Mesh& mesh = out_.mesh;
    std::vector<double> all;
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      float longest = 0;
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        longest = std::max(longest, edge_length(c, i));
      }
      const auto side = static_cast<double>(longest);
      all.push_back(area_of(c) / (side * side));
    }
    if (all.empty()) return 0;
    const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(all.size()));
    std::nth_element(all.begin(), all.begin() + rank, all.end());
    return all[static_cast<std::size_t>(rank)];
  }

  // The median length of the edges at every position.
  [[nodiscard]] std::vector<float> median_edges() const {
    const Mesh& mesh = out_.mesh;
    std::vector<std::uint32_t> begin(directions_.size() + 1, 0);
    for (const std::uint32_t node : mesh.corners) begin[node + 1] += 2;
    for (std::size_t n = 0; n < directions_.size(); ++n) begin[n + 1] += begin[n];
    std::vector<float> lengths(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      float before = edge_length(c, mesh.first[c + 1] - 1);
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        const float after = edge_length(c, i);
        lengths[next[mesh.corners[i]]++] = before;
        lengths[next[mesh.corners[i]]++] = after;
        before = after;
      }
    }
    std::vector<float> out(directions_.size(), 0);
    for (std::size_t n = 0; n < out.size(); ++n) {
      const auto from = lengths.begin() + static_cast<std::ptrdiff_t>(begin[n]);
      const auto to = lengths.begin() + static_cast<std::ptrdiff_t>(begin[n + 1]);
      if (from == to) continue;
      const auto middle = from + (to - from) / 2;
      std::nth_element(from, middle, to);
      out[n] = *middle;
    }
    return out;
  }

  // usual: the length of edges at each position.
  void leave_out_beyond(const std::vector<float>& usual) {
    Mesh& mesh = out_.mesh;
    Mesh kept;
    kept.first.push_back(0);
    std::vector<float> allowed;
    for (std::size_t c = 0; c < mesh.cells(); ++c) {
      float longest = 0;
      allowed.clear();
      for (std::uint32_t i = mesh.first[c]; i < mesh.first[c + 1]; ++i) {
        longest = std::max(longest, edge_length(c, i));
        allowed.push_back(usual[mesh.corners[i]]);
      }
      const auto middle = allowed.begin() + static_cast<std::ptrdiff_t>(allowed.size() / 2);
      std::nth_element(allowed.begin(), middle, allowed.end());
      if (static_cast<double>(longest) > gap_edges * static_cast<double>(*middle)) {
        ++out_.gaps;
        continue;
      }
      kept.corners.insert(kept.corners.end(), mesh.corners.begin() + mesh.first[c],
                          mesh.corners.begin() + mesh.first[c + 1]);
      kept.first.push_back(static_cast<std::uint32_t>(kept.corners.size()));
    }
    mesh = std::move(kept);
  }

  Result<void> leave_out_gaps() {
    if (!(fullness_above(0.5) >= fullness_min)) {
      return make_error(ErrorKind::bad_data,
                        "the positions of cells without outlines lie along lines, such as tracks: "
                        "there is nothing to draw between them");
    }
    // Positions at the rim of a gap have edges across it, which count until they are left out.
    constexpr int rounds_max = 8;
    for (int round = 0; round < rounds_max; ++round) {
      const std::size_t before = out_.gaps;
      leave_out_beyond(median_edges());
      if (out_.gaps == before) break;
    }
    if (out_.mesh.cells() > 0) return {};
    return make_error(ErrorKind::bad_data,
                      "the positions of cells without outlines have no neighbours");
  }

  Triangulation out_;
  std::vector<Direction> directions_;                // unit vectors
  std::vector<std::uint32_t> used_;                  // given positions that differ
  std::vector<std::array<std::uint32_t, 2>> twins_;  // as Mesh::twins
  std::size_t repeated_ = 0;                         // equal ones
  bool closed_ = true;                               // the positions surround the globe
};

}  // namespace

Result<Triangulation> triangulate(std::vector<double> longitudes, std::vector<double> latitudes) {
  return Triangulator().make(std::move(longitudes), std::move(latitudes));
}

}  // namespace windsplat::data::cf
