// View -> scene signature and viewpoint.
#include "server/quality/view_traits.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "protocol/codec.hpp"

namespace windsplat::quality {
namespace {

constexpr double radians_per_degree = 0.017453292519943295;
// Differences that correspond to a distance of 1.
constexpr double height_scale = 0.5;     // change of the logarithm of heights
constexpr double pixels_scale = 1;       // change of the logarithm of pixels
constexpr double direction_scale = 1.2;  // radians
// Of another view at a distance of 0: moved sideways, of another step, or of another width.
constexpr double unknown_share_least = 0.1;

std::uint64_t identity_of(const protocol::View& view) {
  protocol::View shown;
  shown.camera = view.camera;
  shown.step = view.step;
  shown.image.width = view.image.width;
  shown.image.height = view.image.height;
  shown.vector.motion_time = view.vector.motion_time;
  return std::max<std::uint64_t>(std::hash<std::string>{}(protocol::encode_view(shown)), 1);
}

}  // namespace

Viewpoint viewpoint_of(const protocol::View& view, const Viewpoint& otherwise) {
  Viewpoint viewpoint = otherwise;
  viewpoint.width = view.image.width;
  viewpoint.pixels_high = view.image.height;
  viewpoint.identity = identity_of(view);
  if (!is_same_view(viewpoint, otherwise)) viewpoint.content.reset();
  viewpoint.detail *= static_cast<double>(viewpoint.pixels_high) / otherwise.pixels_high;
  if (!view.camera.eye || !view.camera.target) return viewpoint;
  protocol::Vec3 way{};
  double length = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    way[a] = (*view.camera.target)[a] - (*view.camera.eye)[a];
    length = std::hypot(length, way[a]);
  }
  if (!(length > 0)) return viewpoint;
  for (std::size_t a = 0; a < 3; ++a) viewpoint.direction[a] = way[a] / length;
  viewpoint.height =
      view.camera.projection == protocol::Projection::orthographic && view.camera.height
          ? *view.camera.height
          : 2 * length * std::tan(0.5 * radians_per_degree * view.camera.fov_y);
  viewpoint.detail *= otherwise.height / viewpoint.height;
  return viewpoint;
}

namespace {

// Errors of the compositing methods, measured on the samples at stride 1.
double error_of_rule(protocol::Compositing compositing) {
  switch (compositing) {
    case protocol::Compositing::analytic:
      return 0;
    case protocol::Compositing::cd:
      return 1e-4;
    case protocol::Compositing::cd_naive:
      return 5e-4;
    case protocol::Compositing::simple:
      return 3e-3;
    case protocol::Compositing::cd_euler:
      return 5e-3;
  }
  return 0;
}

// Rays that end at transmittance T miss up to T times the light behind. The factor is that of the
// default views of the samples, of which few pixels are opaque.
double error_of_stop(double transmittance) {
  constexpr double shine = 0.04;
  return shine * std::max(0.0, transmittance - stop_of_the_truth);
}

}  // namespace

SceneSignature signature_of(const protocol::View& completed) {
  SceneSignature signature;
  signature.kind.lines = completed.vector.field.kind != protocol::FieldChoice::Kind::none;
  signature.kind.medium = !completed.scalars || !completed.scalars->empty();
  signature.kind.radius = completed.vector.r2 + completed.vector.mark.halo;
  signature.kind.lines_stride = completed.vector.stride.value_or(1);
  signature.kind.thickness = completed.method.slab_thickness;
  if (signature.kind.medium) {
    signature.kind.rule = error_of_rule(completed.method.compositing);
    signature.kind.stop = error_of_stop(completed.method.stop_transmittance);
  }
  protocol::View view = completed;
  view.step = 0;
  view.camera = {};
  view.image = {};
  view.quality = {};
  view.vector.motion_time = 0;
  view.method.name = protocol::MethodName::slab;
  signature.key = protocol::encode_view(view);
  signature.dataset = completed.dataset;
  return signature;
}

double unknown_share(const Viewpoint& a, const Viewpoint& b) {
  if (is_same_view(a, b)) return 0;
  return 1 - (1 - unknown_share_least) * std::exp(-distance(a, b));
}

double distance(const Viewpoint& a, const Viewpoint& b) {
  const double height = std::log(a.height / b.height) / height_scale;
  const double pixels = std::log(static_cast<double>(a.pixels_high) / b.pixels_high) / pixels_scale;
  double along = 0;
  for (std::size_t i = 0; i < 3; ++i) along += a.direction[i] * b.direction[i];
  const double turn = std::acos(std::clamp(along, -1.0, 1.0)) / direction_scale;
  return std::hypot(height, pixels, turn);
}

}  // namespace windsplat::quality
