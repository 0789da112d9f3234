// Contours of meshes -> their lines in the picture -> places where a number fits -> texts.
#include "server/annotate/contour_labels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numeric>
#include <optional>
#include <utility>

#include "server/annotate/labels.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/annotate/projector.hpp"
#include "server/annotate/room.hpp"
#include "server/image/tone_map.hpp"
#include "server/surface/contour_lines.hpp"

namespace windsplat::annotate {
namespace {

constexpr double rounding = 1e-9;     // of an interval
constexpr double text_size = 0.8;     // of other texts
constexpr double spacing = 24;        // between numbers of a line, em
constexpr int places_tried = 9;       // of each such part of a line
constexpr double straight = 0.97;     // chord over arc, at least
constexpr double off_chord = 0.2;     // of the middle of the arc, em, at most
constexpr double facing_least = 0.3;  // cosine: more oblique surfaces squeeze their lines
constexpr double clear_around = 0.4;  // of a text, em
constexpr int lines_most = 60;        // of an interval, that are numbered
// Segments of lines that are looked at for places: of a level, and in a picture. 4 million
// triangles of a smooth field with 60 lines have 1.4 million.
constexpr std::size_t level_segments_most = std::size_t{1} << 19U;
constexpr std::size_t segments_most = std::size_t{1} << 21U;

// A part of a contour in the picture, with the length up to each point.
struct PictureLine {
  double level = 0;
  std::vector<Point> points;
  std::vector<glm::dvec3> places;
  std::vector<double> at;
  std::vector<double> facing;  // |cos| between the normal of the surface and the ray

  [[nodiscard]] double length() const { return at.back(); }
};

// Of arrays that grow to twice their size.
constexpr std::size_t picture_point_bytes =
    2 * (sizeof(Point) + sizeof(glm::dvec3) + 2 * sizeof(double));

// Where a number may be written.
struct Spot {
  Point middle, left, right;
  glm::dvec3 place{0};
  std::array<glm::dvec3, 2> ends{};
  double badness = 0;
};

glm::dvec3 vec(const surface::Point& p) { return {p[0], p[1], p[2]}; }

double distance(const Point& a, const Point& b) { return std::hypot(b.x - a.x, b.y - a.y); }

double facing_at(const glm::dvec3& place, const glm::dvec3& normal, const scene::Camera& camera) {
  const glm::dvec3 ray = camera.perspective ? place - camera.eye : camera.forward;
  const double lengths = glm::length(ray) * glm::length(normal);
  return lengths > 0 ? std::abs(glm::dot(ray, normal)) / lengths : 1;
}

// The parts beyond the near plane.
void add_lines(const surface::ContourLine& line, const scene::Camera& camera,
               std::vector<PictureLine>& to) {
  const Projector projector(camera);
  PictureLine part;
  const auto finish = [&] {
    if (part.points.size() > 1) to.push_back(std::move(part));
    part = {};
    part.level = line.level;
  };
  finish();
  for (std::size_t n = 0; n < line.places.size(); ++n) {
    const surface::Point& place = line.places[n];
    const auto pixel = projector.pixel(vec(place));
    if (!pixel) {
      finish();
      continue;
    }
    part.at.push_back(part.points.empty() ? 0
                                          : part.at.back() + distance(part.points.back(), *pixel));
    part.points.push_back(*pixel);
    part.places.push_back(vec(place));
    part.facing.push_back(facing_at(vec(place), vec(line.normals[n]), camera));
  }
  finish();
}

struct OnLine {
  Point point;
  glm::dvec3 place{0};
  double facing = 1;
};

OnLine along(const PictureLine& line, double at) {
  const auto next = std::clamp<std::ptrdiff_t>(
      std::upper_bound(line.at.begin(), line.at.end(), at) - line.at.begin(), 1,
      static_cast<std::ptrdiff_t>(line.at.size()) - 1);
  const auto n = static_cast<std::size_t>(next);
  const double step = line.at[n] - line.at[n - 1];
  const double part = step > 0 ? std::clamp((at - line.at[n - 1]) / step, 0.0, 1.0) : 0;
  const Point& from = line.points[n - 1];
  const Point& to = line.points[n];
  return {{from.x + part * (to.x - from.x), from.y + part * (to.y - from.y)},
          line.places[n - 1] + part * (line.places[n] - line.places[n - 1]),
          std::min(line.facing[n - 1], line.facing[n])};
}

bool is_within(const Point& at, const Point& of) {
  return at.x >= 0 && at.y >= 0 && at.x <= of.x && at.y <= of.y;
}

// of: the size of the picture.
std::optional<Spot> spot_at(const PictureLine& line, double at, double width, double size,
                            const Point& of) {
  const OnLine left = along(line, at - 0.5 * width);
  const OnLine right = along(line, at + 0.5 * width);
  const OnLine middle = along(line, at);
  if (std::min({left.facing, middle.facing, right.facing}) < facing_least) return std::nullopt;
  if (!is_within(middle.point, of)) return std::nullopt;
  const double chord = distance(left.point, right.point);
  if (!(chord >= straight * width)) return std::nullopt;
  const double across = std::abs((right.point.x - left.point.x) * (middle.point.y - left.point.y) -
                                 (right.point.y - left.point.y) * (middle.point.x - left.point.x)) /
                        chord;
  if (across > off_chord * size) return std::nullopt;
  // Between the chord and the arc.
  const Point centre{0.25 * (left.point.x + right.point.x) + 0.5 * middle.point.x,
                     0.25 * (left.point.y + right.point.y) + 0.5 * middle.point.y};
  Spot spot{centre,       left.point, right.point, middle.place, {left.place, right.place},
            across / size};
  if (spot.left.x > spot.right.x) std::swap(spot.left, spot.right);
  return spot;
}

// The spots of each part of a line, the best first.
std::vector<std::vector<Spot>> spots_on(const PictureLine& line, double width, double size,
                                        const Point& of) {
  std::vector<std::vector<Spot>> parts;
  const int count = std::max(1, static_cast<int>(std::min(line.length() / (spacing * size), 1e3)));
  const double each = line.length() / count;
  for (int n = 0; n < count; ++n) {
    std::vector<Spot> spots;
    for (int k = 0; k < places_tried; ++k) {
      const double off = (k + 0.5) / places_tried - 0.5;  // of the part, from its middle
      const double at = (n + 0.5 + off) * each;
      if (at < 0.5 * width || at > line.length() - 0.5 * width) continue;
      auto spot = spot_at(line, at, width, size, of);
      if (!spot) continue;
      spot->badness += 0.2 * std::abs(off);
      spots.push_back(*spot);
    }
    std::stable_sort(spots.begin(), spots.end(),
                     [](const Spot& a, const Spot& b) { return a.badness < b.badness; });
    if (!spots.empty()) parts.push_back(std::move(spots));
  }
  return parts;
}

// Squares that cover a text along a line.
std::vector<Rectangle> covered_by(const Spot& spot, double size) {
  const double half = (0.5 + clear_around) * size;
  const double width = distance(spot.left, spot.right);
  const int count = std::max(2, static_cast<int>(std::ceil(width / half)));
  std::vector<Rectangle> squares;
  for (int n = 0; n < count; ++n) {
    const double part = (n + 0.5) / count - 0.5;
    const Point at{spot.middle.x + part * (spot.right.x - spot.left.x),
                   spot.middle.y + part * (spot.right.y - spot.left.y)};
    squares.push_back({{at.x - half, at.y - half}, {at.x + half, at.y + half}});
  }
  return squares;
}

bool is_free(const std::vector<Rectangle>& squares, const Figure& figure,
             const Occupied& occupied) {
  return std::all_of(squares.begin(), squares.end(), [&](const Rectangle& a) {
    return a.low.x >= 0 && a.low.y >= 0 && a.high.x <= figure.width && a.high.y <= figure.height &&
           !occupied.meets(a);
  });
}

Text text_at(const Spot& spot, std::string number, double size, const surface::Color& color) {
  Text text;
  text.text = std::move(number);
  text.size = size;
  text.align = 0.5;
  text.turn = std::atan2(spot.right.y - spot.left.y, spot.right.x - spot.left.x);
  // The middle of digits lies on the line.
  constexpr double middle_of_digits = 0.36;  // em above the baseline
  text.at = {spot.middle.x - middle_of_digits * size * std::sin(text.turn),
             spot.middle.y + middle_of_digits * size * std::cos(text.turn)};
  text.color = {image::srgb_from_linear(color[0]), image::srgb_from_linear(color[1]),
                image::srgb_from_linear(color[2]), 1};
  const double lightness = 0.3 * text.color.red + 0.6 * text.color.green + 0.1 * text.color.blue;
  text.rim = lightness > 0.5 ? Color{0.04, 0.05, 0.07, 0.85} : Color{0.98, 0.98, 0.98, 0.85};
  return text;
}

// The levels with the fewest segments, as many as `most` suffices for, which becomes less by
// theirs. counts: of their segments.
std::vector<double> with_few_segments(const std::vector<double>& levels,
                                      const std::vector<std::size_t>& counts, std::size_t& most) {
  std::vector<std::size_t> order(levels.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return counts[a] < counts[b]; });
  std::vector<double> out;
  for (const std::size_t n : order) {
    if (counts[n] > std::min(most, level_segments_most)) break;
    most -= counts[n];
    out.push_back(levels[n]);
  }
  std::sort(out.begin(), out.end());
  return out;
}

// One line with the places where its numbers may be.
struct Numbered {
  std::string number;
  double length = 0;
  std::vector<std::vector<Spot>> parts;
  const surface::Shown* shown = nullptr;
};

bool is_contoured(const surface::Shown& shown) {
  return !shown.mesh->values.empty() && (shown.contours.step > 0 || !shown.contours.levels.empty());
}

void add_numbered(const surface::Shown& shown, const Subject& subject, double size,
                  std::size_t& segments, std::vector<Numbered>& to) {
  if (!is_contoured(shown)) return;
  const scene::Camera& camera = subject.scene.camera;
  double least = 1e300;
  double most = -1e300;
  for (const float value : shown.mesh->values) {
    if (std::isnan(value)) continue;
    least = std::min(least, static_cast<double>(value));
    most = std::max(most, static_cast<double>(value));
  }
  std::vector<double> levels = numbered_levels(shown.contours, least, most, lines_most);
  levels = with_few_segments(levels, surface::contour_segments(*shown.mesh, levels), segments);
  std::string number;
  double width = 0;
  double level = std::nan("");
  const auto add = [&](const surface::ContourLine& line) {
    std::vector<PictureLine> parts;
    add_lines(line, camera, parts);
    if (line.level != level) {
      level = line.level;
      number = level_text(shown.contours, level);
      width = width_of(number, size);
    }
    for (const PictureLine& part : parts) {
      if (part.length() < 3 * width) continue;
      Numbered one{number, part.length(), {}, &shown};
      one.parts = spots_on(part, width, size,
                           {static_cast<double>(camera.width), static_cast<double>(camera.height)});
      if (!one.parts.empty()) to.push_back(std::move(one));
    }
  };
  surface::each_contour_line(*shown.mesh, levels, add, subject.cancel);
}

// Takes away the spots that are hidden.
void remove_hidden(const Subject& subject, std::vector<Numbered>& lines) {
  if (!subject.hidden) return;
  std::vector<glm::dvec3> places;
  for (const Numbered& line : lines) {
    for (const auto& part : line.parts) {
      for (const Spot& spot : part) {
        places.insert(places.end(), {spot.place, spot.ends[0], spot.ends[1]});
      }
    }
  }
  const std::vector<bool> hidden = subject.hidden(places);
  std::size_t next = 0;
  for (Numbered& line : lines) {
    for (auto& part : line.parts) {
      std::erase_if(part, [&](const Spot&) {
        const bool gone = hidden[next] || hidden[next + 1] || hidden[next + 2];
        next += 3;
        return gone;
      });
    }
  }
}

}  // namespace

std::vector<double> numbered_levels(const surface::Contours& contours, double least, double most,
                                    int most_lines) {
  std::vector<double> levels;
  for (const double level : contours.levels) {
    if (level >= least && level <= most) levels.push_back(level);
  }
  if (contours.step > 0 && most >= least) {
    double step = contours.step;
    const double count = (most - least) / step;
    for (double tens = 1; count / tens > most_lines && tens < 1e300; tens *= 10) {
      for (const double times : {2.0, 5.0, 10.0}) {
        step = contours.step * tens * times;
        if ((most - least) / step <= most_lines) break;
      }
    }
    const double first = std::ceil(least / step - rounding);
    for (int n = 0; n <= most_lines && (first + n) * step <= most + rounding * step; ++n) {
      levels.push_back((first + n) * step);
    }
  }
  std::sort(levels.begin(), levels.end());
  const auto same = [&](double a, double b) { return b - a <= rounding * contours.step; };
  levels.erase(std::unique(levels.begin(), levels.end(), same), levels.end());
  return levels;
}

std::string level_text(const surface::Contours& contours, double level) {
  constexpr int digits = 6;
  const bool even = contours.step > 0 &&
                    std::abs(std::remainder(level, contours.step)) <= rounding * contours.step;
  if (!even) return number_text_of(level, digits);
  // The power of ten of the interval's last digit.
  double last = std::pow(10.0, std::floor(std::log10(contours.step) + rounding));
  for (int n = 1; n < digits; ++n) {
    const double multiple = contours.step / last;
    if (std::abs(multiple - std::round(multiple)) <= rounding * multiple) break;
    last /= 10;
  }
  return number_text(level, last);
}

std::uint64_t contour_label_bytes(const scene::Scene& scene) {
  std::size_t triangles = 0;
  for (const surface::Shown& shown : scene.surfaces) {
    if (is_contoured(shown)) triangles = std::max(triangles, shown.mesh->triangles.size());
  }
  if (triangles == 0) return 0;
  const std::size_t segments = std::min(triangles, level_segments_most);
  return surface::contour_line_bytes(segments) + segments * picture_point_bytes;
}

void add_contour_labels(const Subject& subject, const Style& style, Figure& figure) {
  const double size = text_size * style.text;
  std::vector<Numbered> lines;
  std::size_t segments = segments_most;
  for (const surface::Shown& shown : subject.scene.surfaces) {
    add_numbered(shown, subject, size, segments, lines);
  }
  remove_hidden(subject, lines);
  std::stable_sort(lines.begin(), lines.end(),
                   [](const Numbered& a, const Numbered& b) { return a.length > b.length; });
  if (lines.empty()) return;
  constexpr double cell = 4;  // em
  Occupied occupied(figure, cell * size);
  for (const Numbered& line : lines) {
    if (subject.cancel.cancelled()) return;
    for (const auto& part : line.parts) {
      for (const Spot& spot : part) {
        const std::vector<Rectangle> squares = covered_by(spot, size);
        if (!is_free(squares, figure, occupied)) continue;
        for (const Rectangle& square : squares) occupied.add(square);
        figure.taken.insert(figure.taken.end(), squares.begin(), squares.end());
        figure.above.emplace_back(text_at(spot, line.number, size, line.shown->contours.color));
        break;
      }
    }
  }
}

}  // namespace windsplat::annotate
