// View -> Camera; angles -> an eye position that frames the box.
#include "server/scene/camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "protocol/limits.hpp"
#include "server/scene/angles.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/place.hpp"

namespace windsplat::scene {

namespace {

constexpr double margin = 1.04;         // size of the picture relative to the box
constexpr double distance_max = 5e5;    // world units, well within the limits of a view
constexpr double parallel_sine = 1e-6;  // sine of the least angle between up and view direction
constexpr double near_min = 1e-4;
constexpr double near_max = 1e-2;
constexpr std::size_t outline_samples = 8192;  // samples of each end of a curved lattice
constexpr double aside_min = 0.05;             // world units; nearer boxes count as centred

glm::dvec3 to_glm(const protocol::Vec3& v) { return {v[0], v[1], v[2]}; }
protocol::Vec3 from_glm(const glm::dvec3& v) { return {v.x, v.y, v.z}; }

std::array<glm::dvec3, 8> corners(const Lattice& lattice) {
  std::array<glm::dvec3, 8> points;
  for (std::size_t n = 0; n < 8; ++n) {
    points[n] = {(n & 1U) != 0 ? lattice.box_max.x : lattice.box_min.x,
                 (n & 2U) != 0 ? lattice.box_max.y : lattice.box_min.y,
                 (n & 4U) != 0 ? lattice.box_max.z : lattice.box_min.z};
  }
  return points;
}

// Calls visit(point) with the points to frame: the corners of the box, or samples of a curved
// lattice.
template <class Visit>
void each_outline_point(const Lattice& lattice, const Visit& visit) {
  if (!lattice.places) {
    for (const glm::dvec3& corner : corners(lattice)) visit(corner);
    return;
  }
  const auto& places = *lattice.places;
  const std::size_t layer =
      static_cast<std::size_t>(lattice.dims[0]) * static_cast<std::size_t>(lattice.dims[1]);
  // Only the bottom and top level are used; those between are rarely farther out.
  for (const std::size_t first : {std::size_t{0}, places.size() - layer}) {
    const std::size_t step = std::max<std::size_t>(1, layer / outline_samples);
    for (std::size_t n = 0; n < layer; n += step) {
      const std::array<float, 3>& p = places[first + n];
      visit(glm::dvec3(p[0], p[1], p[2]));
    }
  }
}

bool is_perspective(const protocol::CameraView& camera) {
  return camera.projection.value_or(protocol::Projection::perspective) ==
         protocol::Projection::perspective;
}

// The distance, height and shift that show the points, which may reach that much farther, with a
// margin.
class Frame {
 public:
  Frame(const OrbitFrame& frame, const glm::dvec3& target, double fov_y,
        const protocol::ImageView& image, double nearest)
      : frame_(frame),
        target_(target),
        aspect_(static_cast<double>(image.width) / image.height),
        slope_y_(std::tan(0.5 * fov_y * radians_per_degree) / margin),
        nearest_(nearest) {}

  void add(const glm::dvec3& point, double reach) {
    const glm::dvec3 p = point - target_;
    const double x = std::abs(glm::dot(p, frame_.right)) + reach;
    const double y = std::abs(glm::dot(p, frame_.up)) + reach;
    const double depth = glm::dot(p, frame_.forward);
    // The point lies at view depth distance + depth and must be within both slopes.
    const double needed = std::max({x / (slope_y_ * aspect_), y / slope_y_, nearest_}) - depth;
    framing_.distance = std::max(framing_.distance, needed);
    framing_.height = std::max({framing_.height, 2.0 * margin * y, 2.0 * margin * x / aspect_});
    points_.emplace_back(glm::dot(p, frame_.right), glm::dot(p, frame_.up), depth);
    reach_ = reach;
  }

  [[nodiscard]] Framing framing() const {
    return {std::min(framing_.distance, distance_max), std::min(framing_.height, distance_max)};
  }

  // The closest framing with equal free room on opposite edges of the picture.
  [[nodiscard]] Framing centred(bool perspective) const {
    const std::array<double, 2> slope = {slope_y_ * aspect_, slope_y_};
    Framing framing{0, 0, {0, 0}};
    for (const glm::dvec3& p : points_) {
      framing.distance = std::max(framing.distance, nearest_ - p.z);
    }
    for (int a = 0; a < 2; ++a) {
      const auto [above, below] = extents(a, slope[static_cast<std::size_t>(a)]);
      framing.distance =
          std::max(framing.distance, 0.5 * (above + below) / slope[static_cast<std::size_t>(a)]);
      const auto [most, least] = extents(a, 0);
      framing.height = std::max(framing.height, margin * (most + least) / (a == 0 ? aspect_ : 1));
    }
    framing.distance = std::min(framing.distance, distance_max);
    framing.height = std::min(framing.height, distance_max);
    for (int a = 0; a < 2; ++a) {
      const double touching =
          perspective ? touching_slope(a, framing.distance, slope[static_cast<std::size_t>(a)]) : 0;
      const auto [above, below] = extents(a, touching);
      framing.shift[a] = 0.5 * (above - below);
    }
    return framing;
  }

 private:
  // Along one axis of the picture the largest of p - slope * depth and of -p - slope * depth.
  // Planes of that slope through an eye at (x, -d) touch the points if x - slope d is the one and
  // -x - slope d the other.
  [[nodiscard]] std::array<double, 2> extents(int axis, double slope) const {
    std::array<double, 2> most{std::numeric_limits<double>::lowest(),
                               std::numeric_limits<double>::lowest()};
    for (const glm::dvec3& p : points_) {
      most[0] = std::max(most[0], reach_ + p[axis] - slope * p.z);
      most[1] = std::max(most[1], reach_ - p[axis] - slope * p.z);
    }
    return most;
  }

  // The slope, at most `steepest`, at which both planes touch the points from that distance.
  [[nodiscard]] double touching_slope(int axis, double distance, double steepest) const {
    double low = 0;
    double high = steepest;
    for (int n = 0; n < 40; ++n) {
      const double middle = 0.5 * (low + high);
      const auto [above, below] = extents(axis, middle);
      (0.5 * (above + below) > middle * distance ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }

  const OrbitFrame& frame_;
  const glm::dvec3 target_;
  const double aspect_;
  const double slope_y_;
  const double nearest_;
  Framing framing_{0, 0, {0, 0}};
  std::vector<glm::dvec3> points_;  // right, up and forward of the target
  double reach_ = 0;
};

double nearest_to(const Lattice& lattice) {
  return 0.01 * glm::length(lattice.box_max - lattice.box_min);
}

// Half a cell: the extent of a curved lattice beyond its samples.
double outline_reach(const Lattice& lattice) {
  double reach = 0;
  for (std::size_t a = 0; lattice.places && a < 3; ++a) {
    reach = std::max(reach, 0.5 * cell_size(lattice, a));
  }
  return reach;
}

// Near plane at half a cell: lines nearer than that would fill the picture.
double near_plane(const Lattice& lattice) {
  double cell = near_max;
  for (int a = 0; a < 3; ++a) {
    cell = std::min(cell, 0.5 * cell_size(lattice, static_cast<std::size_t>(a)));
  }
  return std::max(cell, near_min);
}

Frame framed_box(const Lattice& lattice, const OrbitFrame& frame, const glm::dvec3& target,
                 double fov_y, const protocol::ImageView& image) {
  Frame framed(frame, target, fov_y, image, nearest_to(lattice));
  const double reach = outline_reach(lattice);
  each_outline_point(lattice, [&](const glm::dvec3& point) { framed.add(point, reach); });
  return framed;
}

// With ticks along its outline, the box leaves room for their texts.
Framing with_room(const Framing& framing, const protocol::View& view) {
  constexpr double room = 1.15;
  if (!view.annotations.axes) return framing;
  return {room * framing.distance, room * framing.height, framing.shift};
}

// An em of texts, as a fraction of the height of the picture: 14 pixels in one of 1280 x 720, times
// the size of all annotations and of one part.
double em_of(const protocol::View& view, double size) {
  const double narrow = view.image.width / 960.0 / view.image.height;
  return 14 * std::min(view.annotations.size * size, protocol::limits::annotation_size_max) *
         std::min(1 / 720.0, narrow);
}

bool has_room_for_texts(const protocol::View& view) {
  return view.annotations.axes && view.geometry.mapping != protocol::GeometryMapping::sphere;
}

// The lower part of the picture that a row of a legend's cards takes below ticks, as a fraction of
// the height.
double share_of_legend(const protocol::View& view) {
  const protocol::AnnotationsView& shown = view.annotations;
  if (!has_room_for_texts(view) || !shown.legend) return 0;
  constexpr double card = 10;  // em, with its distance from the edge
  constexpr double share_most = 0.4;
  return std::min(card * em_of(view, shown.legend_style.size), share_most);
}

// The upper part that title and time take.
double share_of_title(const protocol::View& view) {
  const protocol::AnnotationsView& shown = view.annotations;
  if (!has_room_for_texts(view)) return 0;
  constexpr double line = 1.8;  // em
  constexpr double share_most = 0.2;
  const double lines = (shown.title ? line * em_of(view, shown.title_style.size) : 0) +
                       (shown.step_time ? line * em_of(view, shown.step_time_style.size) : 0);
  return std::min(lines, share_most);
}

// The part of the picture between title and legend, to which the data are fitted.
struct FreePart {
  double below = 0;  // of the height of the picture
  double above = 0;
  double fov_y = 0;
  protocol::ImageView image;
  [[nodiscard]] double share() const { return 1 - below - above; }
};
FreePart free_part(const protocol::View& view, double above) {
  FreePart part;
  part.below = share_of_legend(view);
  part.above = above;
  const double slope = std::tan(0.5 * view.camera.fov_y * radians_per_degree);
  part.fov_y = 2 * std::atan(part.share() * slope) / radians_per_degree;
  part.image = view.image;
  part.image.height = std::max(1, static_cast<int>(std::lround(part.share() * view.image.height)));
  return part;
}

// The target of the whole picture that shows in its free part what `framing`, which becomes that of
// the whole picture, shows about `target`.
glm::dvec3 moved(const glm::dvec3& target, const FreePart& part, const glm::dvec3& up,
                 const protocol::View& view, Framing& framing) {
  framing.height /= part.share();
  const bool perspective = is_perspective(view.camera);
  const double slope = std::tan(0.5 * view.camera.fov_y * radians_per_degree);
  const double height = perspective ? 2 * slope * framing.distance : framing.height;
  return target - 0.5 * (part.below - part.above) * height * up;
}

// The whole box with the room that annotations need: above a legend, if it has ticks. `centred`:
// with equal room on opposite sides; otherwise with the middle of the box in the middle.
struct Whole {
  Framing framing;
  glm::dvec3 target;
};
Whole place_box(const Lattice& lattice, const OrbitFrame& frame, const protocol::View& view,
                double zoom, bool centred) {
  const FreePart part = free_part(view, 0);
  glm::dvec3 target = 0.5 * (lattice.box_min + lattice.box_max);
  const bool perspective = is_perspective(view.camera);
  const Frame framed = framed_box(lattice, frame, target, part.fov_y, part.image);
  Framing framing = with_room(centred ? framed.centred(perspective) : framed.framing(), view);
  framing.distance = std::min(framing.distance / zoom, distance_max);
  framing.height /= zoom;
  target += framing.shift.x * frame.right + framing.shift.y * frame.up;
  target = moved(target, part, frame.up, view, framing);
  return {framing, target};
}

}  // namespace

OrbitFrame orbit_frame(double azimuth, double elevation) {
  const double a = azimuth * radians_per_degree;
  const double e = std::clamp(elevation, -90.0, 90.0) * radians_per_degree;
  OrbitFrame frame{};
  const glm::dvec3 north(-std::sin(a), std::cos(a), 0);  // horizontal part of forward
  frame.right = {std::cos(a), std::sin(a), 0};
  frame.forward = north * std::cos(e) - glm::dvec3(0, 0, std::sin(e));
  frame.up = glm::cross(frame.right, frame.forward);
  return frame;
}

Framing frame_box(const Lattice& lattice, const OrbitFrame& frame, const glm::dvec3& target,
                  double fov_y, const protocol::ImageView& image) {
  return framed_box(lattice, frame, target, fov_y, image).framing();
}

double front_elevation(const Lattice& lattice, const protocol::ImageView& image) {
  if (lattice.inner_radius > 0) return default_elevation;
  const glm::dvec3 edge = lattice.box_max - lattice.box_min;
  // Seen from elevation e the box is edge.x wide and y sin e + z cos e = r sin(e + a) high.
  const double r = std::hypot(edge.y, edge.z);
  const double rise = edge.x * image.height / image.width / r;
  const double e =
      (std::asin(std::min(rise, 1.0)) - std::atan2(edge.z, edge.y)) / radians_per_degree;
  return std::clamp(e, default_elevation, steepest_elevation);
}

double front_azimuth(const Lattice& lattice) {
  if (!(lattice.inner_radius > 0)) return default_azimuth;
  const glm::dvec3 centre = 0.5 * (lattice.box_min + lattice.box_max);
  if (std::hypot(centre.x, centre.y) < aside_min) return default_azimuth;
  return std::atan2(centre.x, -centre.y) / radians_per_degree;
}

void orbit(protocol::View& view, const Lattice& lattice, double azimuth, double elevation,
           double zoom) {
  const OrbitFrame frame = orbit_frame(azimuth, elevation);
  const auto [framing, target] = place_box(lattice, frame, view, zoom, false);
  view.camera.target = from_glm(target);
  view.camera.eye = from_glm(target - frame.forward * framing.distance);
  view.camera.height = std::clamp(framing.height, 1e-6, distance_max);
  const bool upright = std::abs(elevation) < 89.9;
  view.camera.up = upright ? protocol::Vec3{0, 0, 1} : from_glm(frame.up);
}

namespace {

// The plane of a slice, or of data that are one sample thick along one axis. None on a curved one,
// which has no normal: on the sphere, over a height field, and across the horizontal axes of a
// curvilinear map.
struct Face {
  glm::dvec3 point, normal;
};

// The only sample along the only axis of one sample.
std::optional<protocol::SliceView> sheet_of(const Lattice& lattice) {
  const auto thin = std::count(lattice.dims.begin(), lattice.dims.end(), 1);
  const auto at = std::find(lattice.dims.begin(), lattice.dims.end(), 1) - lattice.dims.begin();
  if (thin != 1) return std::nullopt;
  protocol::SliceView sheet;
  sheet.axis = static_cast<protocol::GridAxis>(at);
  sheet.index = lattice.first.at(static_cast<std::size_t>(at));  // slices count in the whole grid
  return sheet;
}

std::optional<Face> face_of(const protocol::GeometryView& geometry, const Lattice& lattice) {
  if (const auto& plane = geometry.plane) {
    return Face{to_glm(plane->point), glm::normalize(to_glm(plane->normal))};
  }
  std::optional<protocol::SliceView> slice = geometry.slice;
  if (!slice && !geometry.height_field) slice = sheet_of(lattice);
  const bool flat = geometry.mapping == protocol::GeometryMapping::flat;
  const bool level = slice && slice->axis == protocol::GridAxis::z &&
                     geometry.mapping != protocol::GeometryMapping::sphere;
  if (!slice || !(flat || level)) return std::nullopt;
  const auto axis = static_cast<int>(slice->axis);
  const std::vector<double>& positions = lattice.positions[axis];
  const double last = static_cast<double>(positions.size()) - 1;
  const double index = std::clamp(slice_index(*slice, lattice), 0.0, last);
  const auto below = static_cast<std::size_t>(index);
  const std::size_t above = std::min(below + 1, positions.size() - 1);
  Face face{0.5 * (lattice.box_min + lattice.box_max), glm::dvec3(0)};
  face.normal[axis] = 1;
  face.point[axis] = std::lerp(positions[below], positions[above], index - below);
  return face;
}

// The direction along the normal that is nearer to that of the whole box; if both are as near,
// westward, which shows the axes y and z as a plot does.
glm::dvec3 facing(const glm::dvec3& normal, const glm::dvec3& usual) {
  constexpr double rounding = 1e-9;
  const double nearer = glm::dot(normal, usual);
  const double sign = std::abs(nearer) > rounding     ? nearer
                      : std::abs(normal.x) > rounding ? -normal.x
                                                      : -normal.z;
  return sign < 0 ? -normal : normal;
}

// Looks at the part of a plane in the box.
void face(const Face& plane, const Lattice& lattice, protocol::View& view) {
  constexpr double upright_sine = 1.7e-3;  // of 0.1 degrees, as in orbits
  protocol::CameraView& camera = view.camera;
  OrbitFrame frame = orbit_frame(front_azimuth(lattice), default_elevation);
  frame.forward = facing(plane.normal, frame.forward);
  const glm::dvec3 up = to_glm(camera.up);
  const double length = glm::length(up);
  const bool parallel = !(glm::length(glm::cross(frame.forward, up)) > upright_sine * length);
  const bool level = std::abs(frame.forward.z) > 0.5;
  if (parallel) camera.up = level ? protocol::Vec3{0, 1, 0} : protocol::Vec3{0, 0, 1};
  frame.right = glm::normalize(glm::cross(frame.forward, to_glm(camera.up)));
  frame.up = glm::cross(frame.right, frame.forward);
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  glm::dvec3 high = -low;
  std::vector<glm::dvec3> points;
  if (lattice.places) {
    each_outline_point(lattice, [&](const glm::dvec3& point) { points.push_back(point); });
  } else {
    points = points_in_box(lattice, plane.point, plane.normal);
  }
  for (const glm::dvec3& point : points) {
    const glm::dvec3 p(glm::dot(point, frame.right), glm::dot(point, frame.up),
                       glm::dot(point, frame.forward));
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  const glm::dvec3 middle = 0.5 * (low + high);
  glm::dvec3 target = middle.x * frame.right + middle.y * frame.up + middle.z * frame.forward;
  const FreePart part = free_part(view, share_of_title(view));
  Frame framed(frame, target, part.fov_y, part.image, nearest_to(lattice));
  for (const glm::dvec3& point : points) framed.add(point, outline_reach(lattice));
  Framing framing = with_room(framed.framing(), view);
  target = moved(target, part, frame.up, view, framing);
  camera.target = from_glm(target);
  camera.eye = from_glm(target - frame.forward * framing.distance);
  if (!camera.height) camera.height = std::max(framing.height, 1e-6);
}

}  // namespace

void complete_camera(protocol::View& view, const Lattice& lattice) {
  protocol::CameraView& camera = view.camera;
  const bool placed = camera.eye || camera.target;
  const auto plane = placed ? std::nullopt : face_of(view.geometry, lattice);
  if (!camera.projection) {
    // Ground and ticks lie before or behind a slice, so that perspective would displace them.
    camera.projection =
        plane ? protocol::Projection::orthographic : protocol::Projection::perspective;
  }
  if (plane) return face(*plane, lattice, view);
  if (camera.eye && camera.target && camera.height) return;
  const OrbitFrame frame =
      orbit_frame(front_azimuth(lattice), front_elevation(lattice, view.image));
  if (!camera.eye && !camera.target) {
    const auto [framing, target] = place_box(lattice, frame, view, 1, lattice.inner_radius == 0);
    camera.target = from_glm(target);
    camera.eye = from_glm(target - frame.forward * framing.distance);
    if (!camera.height) camera.height = std::max(framing.height, 1e-6);
    return;
  }
  if (!camera.target) camera.target = from_glm(0.5 * (lattice.box_min + lattice.box_max));
  const glm::dvec3 target = to_glm(*camera.target);
  const Framing framing =
      with_room(frame_box(lattice, frame, target, camera.fov_y, view.image), view);
  if (!camera.eye) camera.eye = from_glm(target - frame.forward * framing.distance);
  if (!camera.height) camera.height = std::max(framing.height, 1e-6);
}

Result<Camera> resolve_camera(const protocol::View& completed, const Lattice& lattice) {
  const protocol::CameraView& from = completed.camera;
  Camera camera;
  camera.perspective = is_perspective(from);
  camera.eye = to_glm(from.eye.value());
  const glm::dvec3 view_line = to_glm(from.target.value()) - camera.eye;
  const double distance = glm::length(view_line);
  if (!(distance > 1e-9)) {
    return make_error_at(ErrorKind::invalid, "/camera/eye", "equals the target");
  }
  camera.forward = view_line / distance;
  const glm::dvec3 up = to_glm(from.up);
  const double up_length = glm::length(up);
  if (!(up_length > 1e-9)) {
    return make_error_at(ErrorKind::invalid, "/camera/up", "is zero");
  }
  const glm::dvec3 right = glm::cross(camera.forward, up / up_length);
  const double sine = glm::length(right);
  if (!(sine > parallel_sine)) {
    return make_error_at(ErrorKind::invalid, "/camera/up", "is parallel to the view direction");
  }
  camera.right = right / sine;
  camera.up = glm::cross(camera.right, camera.forward);
  camera.half_height = camera.perspective ? std::tan(0.5 * from.fov_y * radians_per_degree)
                                          : 0.5 * from.height.value();
  camera.near = near_plane(lattice);
  camera.width = completed.image.width;
  camera.height = completed.image.height;
  return camera;
}

std::array<double, 2> view_depths(const Camera& camera, const Lattice& lattice) {
  double nearest = 0;
  double farthest = 0;
  bool first = true;
  const double reach = outline_reach(lattice);
  each_outline_point(lattice, [&](const glm::dvec3& corner) {
    const double depth = glm::dot(corner - camera.eye, camera.forward);
    nearest = first ? depth - reach : std::min(nearest, depth - reach);
    farthest = first ? depth + reach : std::max(farthest, depth + reach);
    first = false;
  });
  if (camera.perspective) nearest = std::max(nearest, camera.near);
  return {nearest, std::max(farthest, nearest + 1e-6)};
}

}  // namespace windsplat::scene
