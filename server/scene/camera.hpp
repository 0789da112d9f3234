// Camera placement: framing a box, orbits, and the resolved camera of a view.
#pragma once

#include <array>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The height of a picture for which a view gives the widths of lines, pixels.
inline constexpr double reference_height = 720;

inline constexpr double default_azimuth = 0;      // degrees: from the south, looking north
inline constexpr double default_elevation = 35;   // degrees above the horizon
inline constexpr double steepest_elevation = 50;  // of default views of flat boxes

// The azimuth of default views: default_azimuth, or facing the region if it is part of a globe.
double front_azimuth(const Lattice& lattice);

// The elevation of default views: the one at which the outline of the box has the shape of the
// picture, from default_elevation, also for a globe, to steepest_elevation; a flat box would
// otherwise be a narrow strip, and from still higher up and down could not be told apart.
double front_elevation(const Lattice& lattice, const protocol::ImageView& image);

// Axes of an orbit camera; forward points at the target. Azimuth 0 looks north, positive azimuth
// moves the eye eastward, elevation is above the horizon; degrees. Within 0.1 degrees of the
// vertical, up is the horizontal forward direction of that azimuth.
struct OrbitFrame {
  glm::dvec3 right, up, forward;
};
OrbitFrame orbit_frame(double azimuth, double elevation);

// The distance and height that show the whole box (for a curved lattice: its samples) with a small
// margin when looking along `frame` at `target`.
struct Framing {
  double distance;  // distance from the eye to the target, world units
  double height;    // height of the picture at the target, world units, orthographic
  glm::dvec2 shift{0,
                   0};  // of the middle of the picture from the target, right and up, world units
};
Framing frame_box(const Lattice& lattice, const OrbitFrame& frame, const glm::dvec3& target,
                  double fov_y, const protocol::ImageView& image);

// An orbit about the volume's centre, degrees; azimuth 0 looks north, positive moves the eye
// eastward; zoom 1 frames the whole box. Sets camera.eye, target and height of a view.
void orbit(protocol::View& view, const Lattice& lattice, double azimuth, double elevation,
           double zoom);

// Fills in what the view does not state of its camera: it looks from front_azimuth() and
// front_elevation() and shows the whole box in the middle of the picture. If the view states
// neither eye nor target and shows a slice or plane, or data of one sample along one axis without a
// height field, it looks along its normal, from the side nearer to that, in parallel projection
// unless the view states another, and shows the part in the box; `up` becomes north if it is
// parallel to the normal.
void complete_camera(protocol::View& view, const Lattice& lattice);

// The camera of a completed view. Errors: invalid with a pointer (eye equal to target; up parallel
// to the view direction or zero).
Result<Camera> resolve_camera(const protocol::View& completed, const Lattice& lattice);

// View depths of the nearest and farthest corner of the box; in perspective at least the near
// plane.
std::array<double, 2> view_depths(const Camera& camera, const Lattice& lattice);

}  // namespace windsplat::scene
