#include "server/data/cf/mesh/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace windsplat::data::cf {

namespace {

constexpr double pole_tolerance = 1e-6;  // degrees
constexpr double radians_per_degree = std::numbers::pi / 180;

int turns_between(double from, double to) {
  const double way = to - from;
  return std::abs(way) < 180 ? 0 : static_cast<int>(std::lround(way / 360));
}

// Builds the outline corner by corner.
class OutlineMaker {
 public:
  OutlineMaker(const Mesh& mesh, std::size_t cell, Outline& out)
      : mesh_(mesh),
        nodes_(mesh.corners.data() + mesh.first[cell]),
        count_(mesh.first[cell + 1] - mesh.first[cell]),
        out_(out) {}

  bool make() {
    std::size_t start = 0;
    while (start < count_ && mesh_.is_pole(nodes_[start])) ++start;
    if (start == count_) return false;
    const std::uint32_t head = nodes_[start];
    const double head_x = mesh_.x[head];
    std::uint32_t last = head;
    double x = head_x;
    double sum_y = 0;
    bool over_pole = false;
    double pole = 0;
    out_.points.push_back({x, mesh_.y[head]});
    for (std::size_t n = 1; n <= count_; ++n) {
      const std::uint32_t node = nodes_[(start + n) % count_];
      if (mesh_.is_pole(node)) {
        over_pole = true;
        pole = mesh_.y[node] > 0 ? 90 : -90;
        continue;
      }
      const double next_x = x + mesh_.way(last, node);
      if (over_pole) {
        pass_pole(last, x, node, next_x, pole);
        out_.polar = true;
      } else {
        add_edge(last, node, x, next_x);
      }
      over_pole = false;
      last = node;
      x = next_x;
      sum_y += mesh_.y[node];
      if (n < count_) out_.points.push_back({x, mesh_.y[node]});
    }
    const int turns = turns_between(head_x, x);
    if (turns == 0 || !mesh_.on_sphere) return true;
    if (std::abs(turns) != 1 || out_.polar) return false;
    out_.polar = true;
    out_.points.push_back({x, mesh_.y[head]});
    pass_pole(head, x, head, head_x, sum_y > 0 ? 90 : -90);
    return true;
  }

 private:
  void add_edge(std::uint32_t from, std::uint32_t to, double x, double next_x) {
    const bool forward = from < to;
    const std::uint32_t a = forward ? from : to;
    const double ax = mesh_.x[a];
    const double bx = ax + mesh_.way(a, forward ? to : from);
    const int turns = mesh_.on_sphere ? turns_between(ax, forward ? x : next_x) : 0;
    out_.edges.push_back({{ax, mesh_.y[a]}, {bx, mesh_.y[forward ? to : from]}, turns});
  }

  void pass_pole(std::uint32_t from, double x, std::uint32_t to, double next_x, double pole) {
    for (const auto& [node, at] : {std::pair(from, x), std::pair(to, next_x)}) {
      const double own = mesh_.x[node];
      out_.edges.push_back({{own, mesh_.y[node]}, {own, pole}, turns_between(own, at)});
      out_.points.push_back({at, pole});
    }
  }

  const Mesh& mesh_;
  const std::uint32_t* nodes_;
  std::size_t count_;
  Outline& out_;
};

}  // namespace

double Mesh::way(std::uint32_t a, std::uint32_t b) const {
  const double forward = a < b ? x[b] - x[a] : x[a] - x[b];
  const bool is_short = !on_sphere || std::abs(forward) <= 180;
  const double shorter = is_short ? forward : std::remainder(forward, 360.0);
  return a < b ? shorter : -shorter;
}

bool Mesh::is_pole(std::uint32_t node) const {
  return on_sphere && std::abs(y[node]) >= 90 - pole_tolerance;
}

bool outline_of(const Mesh& mesh, std::size_t cell, Outline& out) {
  out.points.clear();
  out.edges.clear();
  out.polar = false;
  return OutlineMaker(mesh, cell, out).make();
}

double doubled_area(const std::vector<PlanePoint>& points) {
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const PlanePoint& a = points[i];
    const PlanePoint& b = points[(i + 1) % points.size()];
    sum += (a[0] - points[0][0]) * (b[1] - points[0][1]) -
           (b[0] - points[0][0]) * (a[1] - points[0][1]);
  }
  return sum;
}

PlanePoint ChartCell::in_chart(double x, double y) const {
  if (polar) {
    const double from_pole = std::abs(pole - y);
    return {from_pole * std::cos(x * radians_per_degree),
            from_pole * std::sin(x * radians_per_degree)};
  }
  const double turns = on_sphere ? std::round((points.front()[0] - x) / 360) : 0;
  return {x + 360 * turns, y};
}

PlanePoint ChartCell::in_plane(const PlanePoint& point) const {
  if (!polar) return point;
  const double from_pole = std::hypot(point[0], point[1]);
  return {std::atan2(point[1], point[0]) / radians_per_degree,
          pole > 0 ? 90 - from_pole : from_pole - 90};
}

PlanePoint ChartCell::mean() const {
  PlanePoint sum{0, 0};
  for (const PlanePoint& point : points) {
    sum[0] += point[0];
    sum[1] += point[1];
  }
  const auto count = static_cast<double>(points.size());
  return {sum[0] / count, sum[1] / count};
}

PlanePoint ChartCell::centroid() const {
  const PlanePoint origin = points.front();
  double area = 0;
  PlanePoint sum{0, 0};
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const PlanePoint a{points[i][0] - origin[0], points[i][1] - origin[1]};
    const PlanePoint b{points[i + 1][0] - origin[0], points[i + 1][1] - origin[1]};
    const double part = a[0] * b[1] - a[1] * b[0];
    area += part;
    sum[0] += part * (a[0] + b[0]) / 3;
    sum[1] += part * (a[1] + b[1]) / 3;
  }
  if (area == 0) return mean();
  return {origin[0] + sum[0] / area, origin[1] + sum[1] / area};
}

void chart_of(const Mesh& mesh, std::size_t cell, bool polar, ChartCell& out) {
  out.points.clear();
  out.nodes.assign(mesh.corners.begin() + mesh.first[cell],
                   mesh.corners.begin() + mesh.first[cell + 1]);
  out.polar = polar;
  out.on_sphere = mesh.on_sphere;
  if (polar) {
    double sum_y = 0;
    for (const std::uint32_t node : out.nodes) sum_y += mesh.y[node];
    out.pole = sum_y > 0 ? 90 : -90;
    for (const std::uint32_t node : out.nodes) {
      out.points.push_back(out.in_chart(mesh.x[node], mesh.y[node]));
    }
    return;
  }
  double x = mesh.x[out.nodes.front()];
  for (std::size_t i = 0; i < out.nodes.size(); ++i) {
    if (i > 0) x += mesh.way(out.nodes[i - 1], out.nodes[i]);
    out.points.push_back({x, mesh.y[out.nodes[i]]});
  }
}

}  // namespace windsplat::data::cf
