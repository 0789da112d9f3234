// Where the eye stands: framing a box, orbiting it, and the engine's camera from a view's.
#pragma once

#include <array>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

inline constexpr double default_azimuth = 0;     // degrees: from the south, looking north
inline constexpr double default_elevation = 35;  // degrees above the horizon

// The azimuth from which a view begins: default_azimuth, or opposite a part of the globe.
double front_azimuth(const Lattice& lattice);

// Right, up and forward of an orbit's eye; forward points at the target. Azimuth 0 looks north,
// positive azimuth moves the eye eastward, elevation is above the horizon; degrees. Straight up or
// down (within 0.1 degrees), up is where forward points at the same azimuth from the side.
struct OrbitFrame {
  glm::dvec3 right, up, forward;
};
OrbitFrame orbit_frame(double azimuth, double elevation);

// What shows the whole box (of a bent lattice: its samples) with a small margin when looking along
// `frame` at `target`.
struct Framing {
  double distance;  // from eye to target, world units
  double height;    // of the picture at the target, world units, orthographic
};
Framing frame_box(const Lattice& lattice, const OrbitFrame& frame, const glm::dvec3& target,
                  double fov_y, const protocol::ImageView& image);

// An orbit about the volume's centre, degrees; azimuth 0 looks north, positive moves the eye
// eastward; zoom 1 frames the whole box. Sets camera.eye, target and height of a view.
void orbit(protocol::View& view, const Lattice& lattice, double azimuth, double elevation,
           double zoom);

// A completed view's camera. Errors: invalid with a pointer (eye on the target; up parallel to the
// view or without a length).
Result<Camera> resolve_camera(const protocol::View& completed, const Lattice& lattice);

// View distances, along forward, of the box's nearest and farthest corner; the nearest is at least
// the near plane in perspective.
std::array<double, 2> view_depths(const Camera& camera, const Lattice& lattice);

}  // namespace windsplat::scene
