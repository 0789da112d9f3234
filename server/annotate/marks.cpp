#include "server/annotate/marks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <utility>

#include "server/annotate/labels.hpp"
#include "server/annotate/projector.hpp"
#include "server/annotate/room.hpp"
#include "server/scene/angles.hpp"
#include "server/scene/lattice.hpp"

namespace windsplat::annotate {
namespace {

using data::AxisKind;
using protocol::GeometryMapping;

// The direction of growing latitude in the middle of a grid whose columns have longitudes and
// latitudes, in its plane: where the derivative of the longitude vanishes.
std::optional<glm::dvec3> north_of_columns(const data::Grid& grid, const scene::Lattice& lattice) {
  const auto width = static_cast<std::size_t>(lattice.dims[0]);
  const auto height = static_cast<std::size_t>(lattice.dims[1]);
  if (width < 2 || height < 2) return std::nullopt;
  const std::size_t i = std::min(width / 2, width - 2);
  const std::size_t j = std::min(height / 2, height - 2);
  const data::Columns& columns = *grid.columns;
  const std::size_t at = j * width + i;
  const double dx = lattice.positions[0][i + 1] - lattice.positions[0][i];
  const double dy = lattice.positions[1][j + 1] - lattice.positions[1][j];
  const auto by = [&](std::size_t next) {
    return std::array{std::remainder(columns.longitude[next] - columns.longitude[at], 360.0),
                      columns.latitude[next] - columns.latitude[at]};
  };
  const auto along_x = by(at + 1);
  const auto along_y = by(at + width);
  // Grid coordinates (a, b) of a step north: longitudes cancel.
  double a = -along_y[0];
  double b = along_x[0];
  const double rise = a * along_x[1] + b * along_y[1];
  if (rise == 0 || !std::isfinite(rise)) return std::nullopt;
  if (rise < 0) {
    a = -a;
    b = -b;
  }
  const glm::dvec3 north(a * dx, b * dy, 0);
  const double length = glm::length(north);
  if (!(length > 0)) return std::nullopt;
  return north / length;
}

std::optional<glm::dvec3> north_of(const Subject& subject, const glm::dvec3& at) {
  const scene::Placed& placed = *subject.completed.placed();
  const GeometryMapping mapping = subject.completed.view().geometry.mapping;
  if (mapping == GeometryMapping::sphere) {
    const double radius = glm::length(at);
    if (!(radius > 0)) return std::nullopt;
    const glm::dvec3 up = at / radius;
    const glm::dvec3 north = glm::dvec3(0, 0, 1) - up * up.z;
    const double length = glm::length(north);
    constexpr double pole = 1e-6;
    if (!(length > pole)) return std::nullopt;
    return north / length;
  }
  const auto& axes = placed.grid.axes;
  const bool along_axes = axes[0].kind == AxisKind::longitude && axes[1].kind == AxisKind::latitude;
  if (mapping == GeometryMapping::curvilinear || along_axes) return glm::dvec3(0, 1, 0);
  return placed.grid.columns ? north_of_columns(placed.grid, placed.lattice) : std::nullopt;
}

// Where the centre of the picture meets the ground of a globe, the inner edge of its shell, or the
// point of it nearest to the line of sight; without a globe the centre of the box.
glm::dvec3 middle_of(const Subject& subject) {
  const scene::Lattice& lattice = subject.completed.lattice();
  const scene::Camera& camera = subject.scene.camera;
  if (subject.completed.view().geometry.mapping != GeometryMapping::sphere) {
    return 0.5 * (lattice.box_min + lattice.box_max);
  }
  const double along = -glm::dot(camera.eye, camera.forward);
  const glm::dvec3 nearest = camera.eye + along * camera.forward;
  const double radius = lattice.inner_radius;
  const double inside = radius * radius - glm::dot(nearest, nearest);
  return inside > 0 ? nearest - std::sqrt(inside) * camera.forward
                    : radius * glm::normalize(nearest);
}

// Metres on the ground for each world unit.
std::optional<double> metres_per_unit(const Subject& subject) {
  const scene::Placed& placed = *subject.completed.placed();
  const GeometryMapping mapping = subject.completed.view().geometry.mapping;
  if (mapping == GeometryMapping::sphere) {
    const double radius = subject.completed.lattice().inner_radius;
    return radius > 0 ? std::optional(scene::earth_radius_m / radius) : std::nullopt;
  }
  return scene::metres_per_unit(placed.grid, placed.lattice);
}

// The largest of 1, 2 or 5 times a power of ten that is not above `most`; 0 if there is none.
double round_length(double most) {
  if (!(most > 0) || !std::isfinite(most)) return 0;
  const double power = std::pow(10.0, std::floor(std::log10(most)));
  for (const double digit : {5.0, 2.0, 1.0}) {
    if (digit * power <= most) return digit * power;
  }
  return 0.5 * power;  // where log10 rounded up
}

std::string length_text(double metres) {
  struct Unit {
    double metres;
    const char* name;
  };
  constexpr std::array<Unit, 6> units{
      {{1e3, "km"}, {1, "m"}, {1e-2, "cm"}, {1e-3, "mm"}, {1e-6, "\u00b5m"}, {1e-9, "nm"}}};
  for (const Unit& unit : units) {
    constexpr double rounding = 1e-9;
    if (metres >= unit.metres * (1 - rounding)) {
      return number_text_of(metres / unit.metres, 3) + " " + unit.name;
    }
  }
  return number_text_of(metres, 3) + " m";
}

}  // namespace

void add_north(const Subject& subject, const Style& style, Figure& figure) {
  const glm::dvec3 at = middle_of(subject);
  const auto north = north_of(subject, at);
  if (!north) return;
  const Projector projector(subject.scene.camera);
  const double scale = projector.pixels_per_unit(at);
  Point along = projector.direction(at, *north);
  const double length = std::hypot(along.x, along.y);
  constexpr double least = 0.05;  // of its full length: seen nearly end-on, it tells nothing
  if (!(scale > 0) || !(length > least * scale)) return;
  const double radius = 2.2 * style.text;
  const double shown = radius * std::min(length / scale, 1.0);
  along = {along.x / length, along.y / length};
  const Point across{-along.y, along.x};
  const Point middle{figure.width - 2.2 * radius, 2.2 * radius};
  const auto point = [&](double forward, double aside) {
    return Point{middle.x + forward * along.x + aside * across.x,
                 middle.y + forward * along.y + aside * across.y};
  };
  const double half = 0.55 * shown;
  const double wing = 0.32 * style.text;
  figure.above.emplace_back(
      Area{{point(shown, 0), point(-half, wing), point(-0.6 * half, 0)}, style.color});
  figure.above.emplace_back(
      Area{{point(shown, 0), point(-half, -wing), point(-0.6 * half, 0)}, style.quiet});
  figure.taken.push_back({{middle.x - 1.6 * radius, middle.y - 1.6 * radius},
                          {middle.x + 1.6 * radius, middle.y + 1.6 * radius}});
  const Point letter = point(shown + 0.9 * style.text, 0);
  constexpr double half_cap_height = 0.36;  // em
  figure.above.emplace_back(Text{"N",
                                 {letter.x, letter.y + half_cap_height * style.text},
                                 style.text,
                                 0.5,
                                 style.color,
                                 style.rim});
}

void add_scale_bar(const Subject& subject, const Style& style, Figure& figure) {
  const auto metres = metres_per_unit(subject);
  const double pixels = Projector(subject.scene.camera).pixels_per_unit(middle_of(subject));
  if (!metres || !(*metres > 0) || !(pixels > 0)) return;
  const double round = round_length(0.22 * figure.width / pixels * *metres);
  const double width = round / *metres * pixels;
  if (!(width > 0)) return;
  const double edge = 1.4 * style.text;
  const double right = figure.width - edge;
  const double bottom = figure.height - edge;
  const double tick = 0.4 * style.text;
  figure.above.emplace_back(Line{{{right - width, bottom - tick},
                                  {right - width, bottom},
                                  {right, bottom},
                                  {right, bottom - tick}},
                                 1.5 * style.line,
                                 style.color});
  std::string text = length_text(round);
  if (subject.scene.camera.perspective) text += " at the centre";
  add_if_free(Text{text, {right, bottom - 0.7 * style.text}, style.text, 1, style.color, style.rim},
              figure);
}

namespace {

// Time and number of a step; empty where they tell nothing.
std::string step_text(const data::DatasetInfo& info, std::size_t step) {
  if (step >= info.steps.size()) return "";
  const data::TimeStep& time = info.steps[step];
  // The only step of data without times has the number 0 as its time, which tells nothing.
  const bool untimed = info.steps.size() == 1 && info.time_units.empty() && time.text == "0";
  if (untimed) return "";
  std::string text = time_text(time.text);
  if (info.steps.size() > 1) {
    text += (text.empty() ? "" : "  \u00b7  ") + std::string("step ") + std::to_string(step + 1) +
            " of " + std::to_string(info.steps.size());
  }
  return text;
}

std::string minus_text(const protocol::View& view, const data::DatasetInfo& info,
                       const data::DatasetInfo& subtracted) {
  std::string text = "minus ";
  const bool other = view.difference->dataset.has_value();
  // Members of an ensemble have the same title.
  const bool titled = !subtracted.title.empty() && subtracted.title != info.title;
  if (other) text += titled ? subtracted.title : subtracted.id;
  const int step = view.difference->step.value_or(view.step);
  const std::string when = step_text(subtracted, static_cast<std::size_t>(step));
  return text + (other && !when.empty() ? "  \u00b7  " : "") + when;
}

}  // namespace

void add_heading(const Subject& subject, const Style& title, const Style& time, Figure& figure) {
  const protocol::View& view = subject.completed.view();
  const protocol::AnnotationsView& shown = view.annotations;
  // Of the first line, so that both start at the same place.
  const Style& first = shown.title ? title : time;
  const double edge = 1.4 * first.text;
  double line = edge + first.text;
  if (shown.title) {
    constexpr double larger = 1.25;
    const std::string& own = subject.info.title;
    const std::string name = own.empty() ? subject.info.id : own;
    const double size = larger * title.text;
    // Left of the arrow to the north.
    double room = figure.width - 2 * edge;
    for (const Rectangle& taken : figure.taken) {
      if (taken.low.y < line && taken.low.x > edge) room = std::min(room, taken.low.x - 2 * edge);
    }
    std::string text = fitted(shown.title_text.value_or(name), size, room);
    add_if_free(Text{std::move(text), {edge, line}, size, 0, title.color, title.rim}, figure);
    line += 1.6 * title.text + (time.text - title.text);
  }
  const auto add_line = [&](const std::string& whole) {
    std::string text = fitted(whole, time.text, figure.width - 2 * edge);
    add_if_free(Text{std::move(text), {edge, line}, time.text, 0, time.color, time.rim}, figure);
    line += 1.5 * time.text;
  };
  if (shown.step_time) {
    const std::string text = step_text(subject.info, static_cast<std::size_t>(view.step));
    if (!text.empty()) add_line(text);
  }
  if (view.difference && subject.subtracted != nullptr) {
    add_line(minus_text(view, subject.info, *subject.subtracted));
  }
}

}  // namespace windsplat::annotate
