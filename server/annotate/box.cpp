#include "server/annotate/box.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/annotate/axes.hpp"
#include "server/annotate/labels.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/annotate/projector.hpp"
#include "server/annotate/room.hpp"

namespace windsplat::annotate {
namespace {

// An edge parallel to `axis`, at the low (false) or high (true) side of the two other axes.
struct Edge {
  std::size_t axis = 0;
  std::array<bool, 2> high{};  // of axes (axis + 1) % 3 and (axis + 2) % 3
};

class Box {
 public:
  explicit Box(const Subject& subject)
      : low_(subject.completed.lattice().box_min),
        high_(subject.completed.lattice().box_max),
        projector_(subject.scene.camera) {}

  [[nodiscard]] glm::dvec3 on(const Edge& edge, double along) const {
    glm::dvec3 at(0);
    at[static_cast<int>(edge.axis)] = along;
    for (std::size_t n = 0; n < 2; ++n) {
      const int other = static_cast<int>((edge.axis + 1 + n) % 3);
      at[other] = edge.high.at(n) ? high_[other] : low_[other];
    }
    return at;
  }
  [[nodiscard]] std::array<double, 2> range(std::size_t axis) const {
    return {low_[static_cast<int>(axis)], high_[static_cast<int>(axis)]};
  }
  // Of the two sides that meet in an edge, how many face the eye.
  [[nodiscard]] int facing(const Edge& edge) const {
    int count = 0;
    for (std::size_t n = 0; n < 2; ++n) {
      glm::dvec3 normal(0);
      normal[static_cast<int>((edge.axis + 1 + n) % 3)] = edge.high.at(n) ? 1 : -1;
      if (projector_.faces(on(edge, low_[static_cast<int>(edge.axis)]), normal)) ++count;
    }
    return count;
  }
  // The lines at a position along an axis on the sides behind the data, two for each.
  [[nodiscard]] std::vector<std::array<Point, 2>> lines_at(std::size_t axis, double along) const {
    std::vector<std::array<Point, 2>> out;
    for (std::size_t n = 0; n < 2; ++n) {
      const int across = static_cast<int>((axis + 1 + n) % 3);
      const int normal_axis = static_cast<int>((axis + 2 - n) % 3);
      for (const bool high : {false, true}) {
        glm::dvec3 from = low_;
        from[static_cast<int>(axis)] = along;
        from[normal_axis] = high ? high_[normal_axis] : low_[normal_axis];
        glm::dvec3 normal(0);
        normal[normal_axis] = high ? 1 : -1;
        if (projector_.faces(from, normal)) continue;
        glm::dvec3 to = from;
        to[across] = high_[across];
        if (const auto ends = projector_.edge(from, to)) out.push_back(*ends);
      }
    }
    return out;
  }
  [[nodiscard]] std::optional<std::array<Point, 2>> pixels(const Edge& edge) const {
    const auto [from, to] = range(edge.axis);
    return projector_.edge(on(edge, from), on(edge, to));
  }
  [[nodiscard]] std::optional<Point> pixel(const Edge& edge, double along) const {
    return projector_.pixel(on(edge, along));
  }
  [[nodiscard]] std::optional<Point> centre() const {
    return projector_.pixel(0.5 * (low_ + high_));
  }

 private:
  glm::dvec3 low_, high_;
  Projector projector_;
};

std::vector<Edge> edges_along(std::size_t axis) {
  return {
      {axis, {false, false}}, {axis, {true, false}}, {axis, {false, true}}, {axis, {true, true}}};
}

double length_of(const std::array<Point, 2>& edge) {
  return std::hypot(edge[1].x - edge[0].x, edge[1].y - edge[0].y);
}

// The length that a tick with its text takes along an edge: a width along a horizontal one, a
// height along a vertical one.
double room_of_tick(const std::array<Point, 2>& ends, double em) {
  constexpr double width = 4;     // em, roughly
  constexpr double height = 2.2;  // em
  const double across = std::abs(ends[1].x - ends[0].x);
  const double down = std::abs(ends[1].y - ends[0].y);
  return em * (width * across + height * down) / length_of(ends);
}

bool is_on_floor(const Edge& edge) {
  return edge.axis < 2 && !edge.high.at(edge.axis == 0 ? 1 : 0);
}

// Whether labels beside an edge of the floor that the sides above it surround lie over a strip of
// these sides only that is not wider than they are: where the upper edge, which belongs to the
// outline then, is near.
bool is_near_outline(const Box& box, const Edge& edge, double em) {
  if (!is_on_floor(edge) || box.facing(edge) != 0) return false;
  Edge upper = edge;
  upper.high.at(edge.axis == 0 ? 1 : 0) = true;
  const auto ends = box.pixels(edge);
  const auto above = box.pixels(upper);
  if (box.facing(upper) != 1 || !ends || !above || !(length_of(*ends) > 0)) return false;
  const Point across{-((*ends)[1].y - (*ends)[0].y) / length_of(*ends),
                     ((*ends)[1].x - (*ends)[0].x) / length_of(*ends)};
  double widest = 0;
  for (std::size_t n = 0; n < 2; ++n) {
    widest = std::max(widest, std::abs(((*above).at(n).x - (*ends).at(n).x) * across.x +
                                       ((*above).at(n).y - (*ends).at(n).y) * across.y));
  }
  return widest <= room_of_tick({Point{0, 0}, across}, em);
}

// The edge on which an axis is labelled: one of the outline, of x and y also one of the floor near
// it, with room for the ticks of its ends in the picture. Those of the floor come first, where what
// is read are places on the ground.
std::optional<Edge> labelled(const Box& box, std::size_t axis, double em, const Figure& figure) {
  const double least = axis == 2 ? 0.7 : 1;  // ticks
  std::optional<Edge> chosen;
  std::array<double, 2> best{};
  for (const Edge& edge : edges_along(axis)) {
    if (box.facing(edge) != 1 && !is_near_outline(box, edge, em)) continue;
    const auto whole = box.pixels(edge);
    const auto ends = whole ? visible_part(figure, *whole, 0) : std::nullopt;
    if (!ends || !(length_of(*ends) > 0)) continue;
    if (length_of(*ends) < least * room_of_tick(*ends, em)) continue;
    const double x = (*ends)[0].x + (*ends)[1].x;
    const double y = (*ends)[0].y + (*ends)[1].y;
    // Of two of the floor at the same height the right one: the vertical axis is on the left.
    constexpr double share = 0.05;
    const bool floor = is_on_floor(edge);
    const std::array<double, 2> score{floor ? 1.0 : 0.0,
                                      axis == 2 ? -x : y + (floor ? share * x : 0)};
    if (!chosen || score > best) {
      chosen = edge;
      best = score;
    }
  }
  return chosen;
}

// Unit vector across an edge, away from the centre of the box.
Point outward(const std::array<Point, 2>& ends, const Point& centre) {
  const double length = length_of(ends);
  Point out{-(ends[1].y - ends[0].y) / length, (ends[1].x - ends[0].x) / length};
  const double side = out.x * (0.5 * (ends[0].x + ends[1].x) - centre.x) +
                      out.y * (0.5 * (ends[0].y + ends[1].y) - centre.y);
  if (side < 0) out = {-out.x, -out.y};
  return out;
}

// A text beside a point in a direction: its near side, or its corner, lies there.
Text beside(std::string text, const Point& at, const Point& out, double size, const Style& style,
            const Color& color) {
  constexpr double cap_height = 0.73;  // em, of the font
  const double align = 0.5 - 0.5 * std::clamp(1.5 * out.x, -1.0, 1.0);
  const double baseline = at.y + 0.5 * cap_height * size * (1 + std::clamp(1.5 * out.y, -1.0, 1.0));
  return Text{std::move(text), {at.x, baseline}, size, align, color, style.rim};
}

std::vector<Tick> ticks_of(const data::Axis& axis, const AxisMap& map,
                           const std::array<double, 2>& range, int most) {
  const double first = map.value(range[0]);
  const double last = map.value(range[1]);
  const bool degrees =
      axis.kind == data::AxisKind::longitude || axis.kind == data::AxisKind::latitude;
  std::vector<Tick> ticks;
  if (map.single()) {
    const double value = axis.coordinates.front();
    ticks.push_back({value, map.position(value), coordinate_text(axis, value, 0)});
  } else if (map.even()) {
    // Steps of degrees are far apart: a short axis has closer ones than it has room for, so that
    // two ticks tell the scale.
    const int more = degrees ? 2 : 0;
    for (int parts = most; ticks.size() < 2 && parts <= most + more; ++parts) {
      const double step = degrees ? round_degrees(std::abs(last - first), parts)
                                  : round_step(std::abs(last - first), parts);
      if (!(step > 0)) return ticks;
      ticks = ticks_of_step(first, last, step);
      for (Tick& tick : ticks) tick.text = coordinate_text(axis, tick.value, step);
    }
  } else {
    const double gap = (range[1] - range[0]) / (most + 1);
    ticks = uneven_ticks(first, last, gap, [&map](double value) { return map.position(value); });
  }
  if (ticks.size() < 2 &&
      !map.single()) {  // too short for round ones: those of the outermost samples
    const auto [least, greatest] =
        std::minmax_element(axis.coordinates.begin(), axis.coordinates.end());
    constexpr int digits = 3;
    ticks.clear();
    for (const double end : {first, last}) {
      const double value = std::clamp(end, *least, *greatest);
      const double rounded = 0.1 * round_step(std::abs(last - first), 1);
      ticks.push_back(
          {value, 0,
           degrees ? coordinate_text(axis, value, rounded) : number_text_of(value, digits)});
    }
  }
  for (Tick& tick : ticks) tick.at = map.position(tick.value);
  return ticks;
}

// Lines behind the data that continue a tick: they lead from the outline to where the data are.
void add_lines(const std::vector<std::array<Point, 2>>& lines, const Style& style, Figure& figure) {
  Color color = style.quiet;
  constexpr double share = 0.25;  // fainter than the box
  color.alpha *= share;
  for (const auto& whole : lines) {
    const auto ends = visible_part(figure, whole, 4 * style.line);
    if (ends) figure.below.emplace_back(Line{{(*ends)[0], (*ends)[1]}, style.line, color});
  }
}

// An axis along an edge of the box while its ticks are written.
class LabelledAxis {
 public:
  LabelledAxis(const Subject& subject, std::size_t axis, const Box& box, const Edge& edge,
               const Style& style, Figure& figure)
      : axis_(axis),
        box_(box),
        edge_(edge),
        with_lines_(subject.completed.view().annotations.box),
        style_(style),
        figure_(figure),
        out_(outward(*box.pixels(edge), *box.centre())) {}

  // crowded: also where there is no room for the text; the tick stands alone then.
  void add(const Tick& tick, bool crowded) {
    const auto at = box_.pixel(edge_, tick.at);
    if (!at) return;
    const Point end{at->x + mark() * out_.x, at->y + mark() * out_.y};
    if (!visible_part(figure_, {*at, end}, 0)) return;
    const Text text = beside(tick.text, {end.x + gap() * out_.x, end.y + gap() * out_.y}, out_,
                             style_.text, style_, style_.color);
    if (!crowded && !is_free(text, figure_)) return;
    if (with_lines_) add_lines(box_.lines_at(axis_, tick.at), style_, figure_);
    if (is_taken(figure_, *at) || is_taken(figure_, end)) return;
    figure_.above.emplace_back(Line{{*at, end}, style_.line, style_.color});
    if (add_if_free(text, figure_)) ++labels_;
    widest_ = std::max(widest_, width_of(text.text, text.size));
  }
  [[nodiscard]] int labels() const { return labels_; }

  // ends: of the edge in the picture.
  void add_title(const std::string& title, const std::array<Point, 2>& ends) {
    if (title.empty()) return;
    const double away =
        mark() + 3 * gap() + style_.text * std::abs(out_.y) + widest_ * std::abs(out_.x);
    // Best in the middle; on short axes it may have room beyond an end only.
    for (const double part : {0.5, 0.35, 0.65, 0.2, 0.8, 0.0, 1.0, -0.2, 1.2}) {
      const Point at{ends[0].x + part * (ends[1].x - ends[0].x) + away * out_.x,
                     ends[0].y + part * (ends[1].y - ends[0].y) + away * out_.y};
      Text text = beside(title, at, out_, style_.text, style_, style_.quiet);
      if (move_inside(figure_, text) && add_if_free(text, figure_)) return;
    }
  }

 private:
  [[nodiscard]] double mark() const { return 0.45 * style_.text; }
  [[nodiscard]] double gap() const { return 0.35 * style_.text; }

  std::size_t axis_;
  const Box& box_;
  const Edge& edge_;
  bool with_lines_;
  const Style& style_;
  Figure& figure_;
  Point out_;
  int labels_ = 0;
  double widest_ = 0;
};

void add_axis(const Subject& subject, std::size_t axis, const Box& box, const Style& style,
              Figure& figure) {
  const auto edge = labelled(box, axis, style.text, figure);
  const auto map = axis_map(subject, axis);
  if (!edge || !map || !box.centre()) return;
  const auto whole = *box.pixels(*edge);
  const auto ends = *visible_part(figure, whole, 0);
  const data::Axis drawn = drawn_axis(subject, axis);
  // As many in the picture as have room there, up to 10.
  constexpr double ticks_most = 90;
  const double shown = std::clamp(length_of(ends) / room_of_tick(ends, style.text), 1.0, 10.0);
  const auto most = static_cast<int>(
      std::clamp(std::floor(shown) * length_of(whole) / length_of(ends), 1.0, ticks_most));
  LabelledAxis labels(subject, axis, box, *edge, style, figure);
  for (const Tick& tick : ticks_of(drawn, *map, box.range(axis), most)) labels.add(tick, true);
  // One value tells no scale: where others had no room, closer ones are written between them.
  constexpr double long_enough = 3;  // em
  constexpr int closer_most = 6;
  const bool is_long = length_of(ends) >= long_enough * style.text && !map->single();
  for (int more = 1; is_long && labels.labels() < 2 && more <= closer_most; ++more) {
    for (const Tick& tick : ticks_of(drawn, *map, box.range(axis), most + more)) {
      if (labels.labels() < 2) labels.add(tick, false);
    }
  }
  labels.add_title(axis_title(drawn), ends);
}

}  // namespace

void add_box(const Subject& subject, const Style& style, Figure& figure) {
  if (subject.completed.view().geometry.mapping == protocol::GeometryMapping::sphere) return;
  const Box box(subject);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const Edge& edge : edges_along(axis)) {
      // Far outside, coordinates exceed those of Cairo (24 bits before the point).
      const auto whole = box.pixels(edge);
      const auto ends = whole ? visible_part(figure, *whole, 4 * style.line) : std::nullopt;
      if (!ends) continue;
      const bool front = box.facing(edge) == 2;
      Color color = style.quiet;
      constexpr double front_share = 0.6;  // over the data, edges are fainter
      if (front) color.alpha *= front_share;
      (front ? figure.above : figure.below)
          .emplace_back(Line{{(*ends)[0], (*ends)[1]}, style.line, color});
    }
  }
}

void add_axes(const Subject& subject, const Style& style, Figure& figure) {
  if (subject.completed.view().geometry.mapping == protocol::GeometryMapping::sphere) return;
  const Box box(subject);
  // Where two share a corner, the ends of the vertical one are written first.
  for (const std::size_t axis : {0, 2, 1}) add_axis(subject, axis, box, style, figure);
}

}  // namespace windsplat::annotate
