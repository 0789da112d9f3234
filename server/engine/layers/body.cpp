// The body relative to the camera.
#include "server/engine/layers/body.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/geometric.hpp>

#include "server/engine/layers/kept_ground.hpp"
#include "server/ground/paint.hpp"
#include "server/light/ground_light.hpp"
#include "server/terrain/terrain_pixel.hpp"

namespace windsplat::engine {

kernels::Body make_body(const scene::Scene& scene) {
  kernels::Body to{};
  if (!scene.body) return to;
  const scene::Body& from = *scene.body;
  const glm::dvec3& eye = scene.camera.eye;
  switch (from.shape) {
    case scene::BodyShape::sphere:
      to.shape = kernels::body_sphere;
      break;
    case scene::BodyShape::ground:
      to.shape = kernels::body_ground;
      break;
    case scene::BodyShape::terrain:
      to.shape = kernels::body_terrain;
      break;
  }
  to.terrain = from.terrain.get();
  to.light = from.light.get();
  to.paint = from.paint.get();
  to.centre[0] = -glm::dot(eye, scene.camera.right);
  to.centre[1] = glm::dot(eye, scene.camera.up);
  to.centre[2] = -glm::dot(eye, scene.camera.forward);
  to.radius = from.radius;
  const glm::dvec3 low = glm::dvec3(from.low, from.height) - eye;
  const glm::dvec3 high = glm::dvec3(from.high, from.height) - eye;
  for (int a = 0; a < 3; ++a) {
    to.low[a] = low[a];
    to.high[a] = high[a];
  }
  to.pixel = 2.0 * scene.camera.half_height / scene.camera.height;
  std::copy(from.color.begin(), from.color.end(), to.rgb);
  to.ambient = static_cast<float>(scene::body_ambient);
  return to;
}

namespace kernels {

namespace {

glm::dvec3 vector_of(const double from[3]) { return {from[0], from[1], from[2]}; }

terrain::View view_of(const Camera& camera, const Body& body) {
  return {vector_of(camera.eye),
          vector_of(camera.world_right),
          vector_of(camera.world_down),
          vector_of(camera.world_forward),
          body.pixel,
          static_cast<double>(camera.near),
          camera.perspective != 0};
}

}  // namespace

void add_terrain(const Camera& camera, const Body& body, BodyPixels& pixels) {
  if (body.kept != nullptr && body.kept->find_surface(body.paint != nullptr, pixels)) return;
  std::array<terrain::PixelSurface, block_pixels> seen;
  static_assert(block_side <= terrain::side_max);
  terrain::look(*body.terrain, view_of(camera, body),
                pixels.left - static_cast<double>(camera.half_width_px),
                pixels.top - static_cast<double>(camera.half_height_px), block_side, seen.data());
  for (std::size_t l = 0; l < seen.size(); ++l) {
    const auto one =
        terrain::combined(seen[l], {pixels.depth[l], pixels.coverage[l], pixels.cosine[l]});
    pixels.depth[l] = one.depth;
    pixels.coverage[l] = one.coverage;
    pixels.cosine[l] = one.cosine;
    pixels.relief[l] = one.relief;
    for (int a = 0; a < 3; ++a) pixels.normal[l][a] = one.normal[a];
  }
  if (body.kept != nullptr) body.kept->keep_surface(pixels);
}

namespace {

void paint_pixels(const Camera& camera, const Body& body, const BodyPixels& pixels,
                  float rgb[3][block_pixels]) {
  const terrain::View view = view_of(camera, body);
  const auto seen_at = [&](int l) {
    const double x = pixels.left + l % block_side + 0.5 - static_cast<double>(camera.half_width_px);
    const int row = l / block_side;
    const double y = pixels.top + row + 0.5 - static_cast<double>(camera.half_height_px);
    return body.paint->seen(view, x, y, pixels.depth[l], vector_of(pixels.normal[l]));
  };
  const auto put = [&](int l, const ground::Color& color) {
    for (int c = 0; c < 3; ++c)
      rgb[c][l] = static_cast<float>(color.at(static_cast<std::size_t>(c)));
  };
  const double* const coverage = pixels.coverage;
  const auto is_seen = [](double c) { return c > 0; };
  if (std::none_of(coverage, coverage + block_pixels, is_seen)) return;
  const bool whole =
      std::all_of(coverage, coverage + block_pixels, [](double c) { return c >= 1; });
  ground::Near near;
  bool known = false;
  constexpr int middle = block_side / 2;
  constexpr int centre = middle * block_side + middle;
  // All pixels of a plane that see it see about the same of it.
  const bool plane = body.shape == body_ground && body.terrain == nullptr;
  if (whole || (plane && is_seen(coverage[centre]))) {
    known = body.paint->find_near(seen_at(centre), middle, near);
  }
  const bool even = known && near.is_even && body.terrain == nullptr;
  for (int l = 0; l < block_pixels; ++l) {
    if (!is_seen(coverage[l])) continue;
    if (even) {
      put(l, body.paint->even_color(near));
    } else if (known) {
      put(l, body.paint->color(seen_at(l), near));
    } else {
      put(l, body.paint->color(seen_at(l)));
    }
  }
}

}  // namespace

void paint_body(const Camera& camera, const Body& body, const BodyPixels& pixels,
                float rgb[3][block_pixels]) {
  if (body.kept != nullptr && body.kept->find_colors(pixels, rgb)) return;
  paint_pixels(camera, body, pixels, rgb);
  if (body.kept != nullptr) body.kept->keep_colors(pixels, rgb);
}

void light_body(const Camera& camera, const Body& body, double left, double top,
                const double depth[block_pixels], const double coverage[block_pixels],
                float bright[block_pixels]) {
  const auto vector = [](const double from[3]) { return glm::dvec3(from[0], from[1], from[2]); };
  const glm::dvec3 eye = vector(camera.eye);
  const glm::dvec3 right = body.pixel * vector(camera.world_right);
  const glm::dvec3 down = body.pixel * vector(camera.world_down);
  for (int l = 0; l < block_pixels; ++l) {
    if (!(coverage[l] > 0)) continue;
    const double x = left + l % block_side + 0.5 - static_cast<double>(camera.half_width_px);
    const double row = l / block_side;  // NOLINT(bugprone-integer-division): a row of pixels
    const double y = top + row + 0.5 - static_cast<double>(camera.half_height_px);
    const double scale = camera.perspective != 0 ? depth[l] : 1;
    const glm::dvec3 place =
        eye + depth[l] * vector(camera.world_forward) + scale * (x * right + y * down);
    bright[l] = static_cast<float>(body.light->factor(place));
  }
}

}  // namespace kernels

}  // namespace windsplat::engine
