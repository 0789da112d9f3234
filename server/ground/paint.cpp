// World point -> degrees -> distance to lines in pixels.
#include "server/ground/paint.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <utility>

namespace windsplat::ground {

namespace {

// Widths in pixels at a height of 720, and opacities.
struct Stroke {
  double width, opacity;
};
constexpr Stroke coast_stroke{1.2, 0.85};
constexpr Stroke border_stroke{1.0, 0.5};
constexpr Stroke graticule_stroke{0.9, 0.28};

// Rays are taken to meet the surface at least at this cosine where they determine what a pixel
// shows.
constexpr double least_cosine = 0.02;

double clamped(double value) { return std::clamp(value, 0.0, 1.0); }

// The part of a pixel that a line covers whose middle is that far away, in pixels. A line thinner
// than a pixel has the width of one and less opacity.
double cover(const Stroke& stroke, double distance, double scale) {
  const double width = stroke.width * scale;
  const double reach = 0.5 * std::max(width, 1.0) + 0.5;
  return stroke.opacity * std::min(width, 1.0) * clamped(reach - distance);
}

// Of a degree of longitude.
double length_of_longitude(double latitude) {
  return std::max(std::cos(std::min(std::abs(latitude), 90.0) * std::numbers::pi / 180), 1e-9);
}

// Whether the bounds of a segment meet a rectangle of that many degrees to each side of a place.
bool meets(const Ends& ends, const Place& place, double longitudes, double latitudes) {
  return std::max(ends.ay, ends.by) >= place.latitude - latitudes &&
         std::min(ends.ay, ends.by) <= place.latitude + latitudes &&
         std::max(ends.ax, ends.bx) >= place.longitude - longitudes &&
         std::min(ends.ax, ends.bx) <= place.longitude + longitudes;
}

double fading(double cosine) {
  constexpr double gone = 0.03;
  constexpr double whole = 0.15;
  return clamped((cosine - gone) / (whole - gone));
}

// Ways to the east and the north in degrees of a great circle <-> pixels to the right and down.
class Pixels {
 public:
  Pixels(const Located& at, const Seen& seen)
      : at_(at.place),
        shrink_(std::max(std::cos(at.place.latitude * std::numbers::pi / 180), 1e-9)),
        east_right_(glm::dot(at.east, seen.right)),
        east_down_(glm::dot(at.east, seen.down)),
        north_right_(glm::dot(at.north, seen.right)),
        north_down_(glm::dot(at.north, seen.down)) {
    determinant_ = east_right_ * north_down_ - east_down_ * north_right_;
    if (is_regular()) inverse_ = 1 / determinant_;
  }

  [[nodiscard]] bool is_regular() const { return std::abs(determinant_) > 1e-30; }
  [[nodiscard]] double degrees() const { return std::sqrt(std::abs(determinant_)); }
  // From one pixel to the next, along the steepest direction.
  [[nodiscard]] double longitudes() const { return std::hypot(east_right_, east_down_) / shrink_; }
  [[nodiscard]] double latitudes() const { return std::hypot(north_right_, north_down_); }

  [[nodiscard]] Level::Cells around(const Level& level, double pixels) const {
    const double east = std::min(pixels * longitudes(), 180.0);
    const double north = pixels * latitudes();
    return level.cells(at_.longitude - east, at_.longitude + east, at_.latitude - north,
                       at_.latitude + north);
  }

  // The square of the distance of a segment from the middle of the pixel. Its longitudes are those
  // near that of the place.
  [[nodiscard]] double distance2(const Ends& ends) const {
    const auto a = pixels(ends.ax - at_.longitude, ends.ay - at_.latitude);
    const auto b = pixels(ends.bx - at_.longitude, ends.by - at_.latitude);
    const double dx = b[0] - a[0];
    const double dy = b[1] - a[1];
    const double length2 = dx * dx + dy * dy;
    const double part = length2 > 0 ? clamped(-(a[0] * dx + a[1] * dy) / length2) : 0;
    const double x = a[0] + part * dx;
    const double y = a[1] + part * dy;
    return x * x + y * y;
  }

 private:
  [[nodiscard]] std::array<double, 2> pixels(double longitude, double north) const {
    const double east = longitude * shrink_;
    return {(north_down_ * east - east_down_ * north) * inverse_,
            (east_right_ * north - north_right_ * east) * inverse_};
  }

  Place at_;
  double shrink_;
  double east_right_, east_down_, north_right_, north_down_;
  double determinant_ = 0;
  double inverse_ = 0;
};

void lay_over(const Color& line, double opacity, Color& to) {
  for (std::size_t c = 0; c < to.size(); ++c) to[c] += opacity * (line[c] - to[c]);
}

// The distance of a graticule's line from a pixel that lies `degrees` from a multiple of the step.
double graticule_cover(double degrees, double step, double per_pixel, double scale) {
  if (!(per_pixel > 0)) return 0;
  constexpr double crowded = 4;  // pixels between lines
  constexpr double apart = 12;
  const double spacing = step / per_pixel / scale;
  const double distance = std::abs(std::remainder(degrees, step)) / per_pixel;
  return cover(graticule_stroke, distance, scale) *
         clamped((spacing - crowded) / (apart - crowded));
}

}  // namespace

Paint::Paint(std::shared_ptr<const Map> map, const Style& style)
    : map_(std::move(map)), style_(style) {}

void Paint::identify(Identity& to) const {
  for (const Color* color : {&style_.land, &style_.sea, &style_.line}) {
    to.numbers.insert(to.numbers.end(), color->begin(), color->end());
  }
  to.numbers.insert(to.numbers.end(), {style_.coastlines ? 1.0 : 0.0, style_.borders ? 1.0 : 0.0,
                                       style_.graticule, style_.scale});
  map_->identify(to);
}

// The point moves along the surface: with the ray's direction w, of forward component 1, and the
// normal n, by s (r - w (r n) / (w n)) for a step r, where s is the size of a pixel there.
Seen Paint::seen(const terrain::View& view, double x, double y, double depth,
                 const glm::dvec3& normal) const {
  const glm::dvec3 aside = view.pixel * (x * view.right + y * view.down);
  const glm::dvec3 along = view.perspective ? view.forward + aside : view.forward;
  Seen at;
  at.point = view.eye + depth * along;
  if (!view.perspective) at.point += aside;
  const glm::dvec3 up = glm::dot(normal, normal) > 0 ? normal : map_->up(at.point);
  const double length = glm::length(along);
  const double fall = glm::dot(along, up);
  at.cosine = std::min(std::abs(fall) / length, 1.0);
  // At a limb the sign of `fall` is that of a rounding error.
  const double least = least_cosine * length;
  const double steep = std::abs(fall) < least ? -least : fall;
  const double size = view.perspective ? view.pixel * depth : view.pixel;
  at.right = size * (view.right - along * (glm::dot(view.right, up) / steep));
  at.down = size * (view.down - along * (glm::dot(view.down, up) / steep));
  return at;
}

double Paint::graticule_at(const Located& at, const Seen& seen) const {
  const Pixels pixels(at, seen);
  const double meridian =
      graticule_cover(at.place.longitude, style_.graticule, pixels.longitudes(), style_.scale);
  constexpr double last = 89.9;
  if (std::abs(at.place.latitude) > last) return meridian;
  return std::max(meridian, graticule_cover(at.place.latitude, style_.graticule, pixels.latitudes(),
                                            style_.scale));
}

// In pixels; infinite: none is near.
struct Paint::Distances {
  double coast = std::numeric_limits<double>::infinity();
  double border = std::numeric_limits<double>::infinity();
  bool is_land = false;
  void see(bool is_coast, double distance2) {
    double& nearest = is_coast ? coast : border;
    nearest = std::min(nearest, std::sqrt(distance2));
  }
};

double Paint::reach() const { return 0.5 * std::max(coast_stroke.width * style_.scale, 1.0) + 0.5; }

Color Paint::blend(const Located& at, const Seen& seen, const Distances& distances) const {
  const double coast = distances.coast;
  Color color = style_.sea;
  lay_over(style_.land, clamped(0.5 + (distances.is_land ? coast : -coast)), color);
  const double fade = fading(seen.cosine);
  if (style_.graticule > 0) lay_over(style_.line, fade * graticule_at(at, seen), color);
  if (style_.borders) {
    lay_over(style_.line, fade * cover(border_stroke, distances.border, style_.scale), color);
  }
  if (style_.coastlines) {
    lay_over(style_.line, fade * cover(coast_stroke, coast, style_.scale), color);
  }
  return color;
}

Color Paint::color(const Seen& seen) const {
  const Located at = map_->locate(seen.point);
  const Pixels pixels(at, seen);
  if (!pixels.is_regular()) {
    return atlas(0).is_land(at.place) ? style_.land : style_.sea;
  }
  const Level& level = level_for(pixels.degrees());
  Distances distances;
  distances.is_land = level.is_land(at.place);
  const double east = reach() * pixels.longitudes();
  const double north = reach() * pixels.latitudes();
  level.each(pixels.around(level, reach()), style_.borders, [&](const Segment& s, bool is_coast) {
    const Ends ends = ends_near(s, at.place.longitude);
    if (meets(ends, at.place, east, north)) distances.see(is_coast, pixels.distance2(ends));
  });
  return blend(at, seen, distances);
}

bool Paint::find_near(const Seen& middle, double pixels, Near& near) const {
  constexpr double grazing = 0.2;
  constexpr double polar = 84;
  constexpr double wide = 15;
  // The map from pixels to degrees changes from pixel to pixel.
  constexpr double change = 1.25;
  if (middle.cosine < grazing) return false;
  const Located at = map_->locate(middle.point);
  const Pixels to(at, middle);
  if (!to.is_regular()) return false;
  near.count = 0;
  near.level_number = level_number(to.degrees());
  near.level = &atlas(near.level_number);
  near.middle = at.place;
  // Along x and y both, and a quarter of that again for the bend.
  const double extent = 1.25 * std::sqrt(2.0) * pixels;
  near.longitudes = extent * to.longitudes();
  near.latitudes = extent * to.latitudes();
  const double east = near.longitudes + change * reach() * to.longitudes();
  const double north = near.latitudes + change * reach() * to.latitudes();
  const double farthest = map_->has_parallel_meridians() ? 90 : polar;
  if (east > wide || std::abs(at.place.latitude) + north > farthest) return false;
  bool fits = true;
  const auto cells = near.level->cells(at.place.longitude - east, at.place.longitude + east,
                                       at.place.latitude - north, at.place.latitude + north);
  near.level->each(cells, style_.borders, [&](const Segment& s, bool is_coast) {
    const Ends ends = ends_near(s, at.place.longitude);
    if (!meets(ends, at.place, east, north)) return;
    // A segment of several cells comes several times; others may have the same ends.
    for (std::size_t n = 0; n < near.count; ++n) {
      if (near.lines[n].segment == &s) return;
    }
    fits = fits && near.count < Near::most;
    const bool divides = is_coast && meets(ends, at.place, near.longitudes, near.latitudes);
    if (!fits) return;
    near.lines[near.count++] = {&s, ends, crossing_of(ends, at.place.latitude), is_coast, divides};
  });
  if (!fits) return false;
  near.is_land = near.level->is_land(at.place);
  // Of a pixel of the square, at most: parallels shrink towards the poles.
  const double other_size =
      1.06 * std::sqrt(length_of_longitude(at.place.latitude) /
                       length_of_longitude(std::abs(at.place.latitude) + near.latitudes));
  const bool same_level = near.level_number == level_number(to.degrees() * other_size) &&
                          near.level_number == level_number(to.degrees() / other_size);
  near.is_even = near.count == 0 && same_level && !is_near_graticule(at.place, east, north);
  return true;
}

bool Paint::is_near_graticule(const Place& place, double east, double north) const {
  if (!(style_.graticule > 0)) return false;
  const auto is_crossed = [this](double at, double reach) {
    return std::floor((at - reach) / style_.graticule) !=
           std::floor((at + reach) / style_.graticule);
  };
  return is_crossed(place.longitude, east) || is_crossed(place.latitude, north);
}

Color Paint::color(const Seen& seen, const Near& near) const {
  Located at = map_->locate(seen.point);
  double east = at.place.longitude - near.middle.longitude;
  if (std::abs(east) > 180) east = std::remainder(east, 360.0);
  at.place.longitude = near.middle.longitude + east;
  const Pixels pixels(at, seen);
  const bool holds = std::abs(east) <= near.longitudes && pixels.is_regular() &&
                     std::abs(at.place.latitude - near.middle.latitude) <= near.latitudes &&
                     near.level_number == level_number(pixels.degrees());
  if (!holds) return color(seen);
  Distances distances;
  distances.is_land = near.is_land;
  // A line that is farther away than any reaches changes nothing.
  const double east_reach = reach() * pixels.longitudes();
  const double north_reach = reach() * pixels.latitudes();
  for (std::size_t n = 0; n < near.count; ++n) {
    const Near::Line& line = near.lines[n];
    if (meets(line.ends, at.place, east_reach, north_reach)) {
      distances.see(line.is_coast, pixels.distance2(line.ends));
    }
    if (line.divides && separates(line.ends, line.crossing, near.middle, at.place)) {
      distances.is_land = !distances.is_land;
    }
  }
  return blend(at, seen, distances);
}

}  // namespace windsplat::ground
