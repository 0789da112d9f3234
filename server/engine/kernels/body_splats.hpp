// Part of the kernel body: splats, from a stop's extinction to its footprint on the screen.
#pragma once

#include "server/engine/kernels/body_stops.hpp"

namespace windsplat::engine::kernels {
namespace {

// One a stop. With p the pixel minus the projected centre and the cell's edges A = diag(cell):
// perspective r^2 = (xx px^2 + xy px py + yy py^2) / sum_a weight_a ray_a^2, the ray unnormalised;
// orthographic the same with the (constant) divisor already divided out.
struct Splats {
  float x[brick_stops], y[brick_stops];  // projected centre, pixels
  float xx[brick_stops], xy[brick_stops], yy[brick_stops];
  float weight[3][brick_stops];
  float strength[brick_stops];     // optical depth at the centre; perspective: times |d|
  float cells_depth[brick_stops];  // orthographic: cells per unit of view distance
  float x0[brick_stops], x1[brick_stops], y0[brick_stops], y1[brick_stops];  // silhouette, pixels
};

inline void cross3(const float a[3], const float b[3], float out[3]) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

inline float dot3(const float a[3], const float b[3]) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Half the silhouette's width along one screen axis and its middle, as coordinates at unit
// distance, from M = v v^T - t^2 A A^T (NaN and infinity when the splat reaches the eye's plane).
// The discriminant M13^2 - M11 M33 is written out so that v's own squares never cancel.
struct Extent {
  float low, high;
};

inline Extent silhouette(float v, float z, float s11, float s13, float s33) {
  const float m33 = z * z - s33;
  const float inner = (z * z * s11 - 2.0F * v * z * s13 + v * v * s33) - (s11 * s33 - s13 * s13);
  const float root = square_root(larger(inner, 0.0F));
  const float middle = v * z - s13;
  const bool bounded = m33 > 1e-6F * z * z;
  const float inverse = 1.0F / (bounded ? m33 : 1.0F);
  const float low = bounded ? (middle - root) * inverse : -1e30F;
  const float high = bounded ? (middle + root) * inverse : 1e30F;
  return {low, high};
}

void perspective_splats(const Camera& camera, const Pass& pass, const Stops& stops, Splats& s) {
  float cell[3][brick_stops];
  float from_eye[3][brick_stops];
  for (int a = 0; a < 3; ++a) {
    for (int l = 0; l < stops.count; ++l) {
      cell[a][l] = pass.axis[a].cell[stops.index[a][l]];
      from_eye[a][l] = pass.axis[a].from_eye[stops.index[a][l]];
    }
  }
  constexpr float t2 = footprint_t * footprint_t;
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    float o[3], right[3], down[3], ox[3], oy[3];
    float s11 = 0, s22 = 0, s33 = 0, s13 = 0, s23 = 0;
    for (int a = 0; a < 3; ++a) {
      const float inverse = 1.0F / cell[a][l];
      o[a] = from_eye[a][l] * inverse;
      right[a] = camera.right[a] * inverse * camera.pixel;
      down[a] = camera.down[a] * inverse * camera.pixel;
      s.weight[a][l] = inverse * inverse;
      const float square = t2 * cell[a][l] * cell[a][l];
      s11 += camera.right[a] * camera.right[a] * square;
      s22 += camera.down[a] * camera.down[a] * square;
      s33 += camera.forward[a] * camera.forward[a] * square;
      s13 += camera.right[a] * camera.forward[a] * square;
      s23 += camera.down[a] * camera.forward[a] * square;
    }
    cross3(o, right, ox);
    cross3(o, down, oy);
    s.xx[l] = dot3(ox, ox);
    s.xy[l] = 2.0F * dot3(ox, oy);
    s.yy[l] = dot3(oy, oy);
    const float scale = camera.inverse_pixel / stops.z[l];
    s.x[l] = camera.half_width_px + stops.x[l] * scale;
    s.y[l] = camera.half_height_px + stops.y[l] * scale;
    const Extent across = silhouette(stops.x[l], stops.z[l], s11, s13, s33);
    const Extent along = silhouette(stops.y[l], stops.z[l], s22, s23, s33);
    s.x0[l] = camera.half_width_px + across.low * camera.inverse_pixel;
    s.x1[l] = camera.half_width_px + across.high * camera.inverse_pixel;
    s.y0[l] = camera.half_height_px + along.low * camera.inverse_pixel;
    s.y1[l] = camera.half_height_px + along.high * camera.inverse_pixel;
  }
}

void orthographic_splats(const Camera& camera, const Pass& pass, const Stops& stops, Splats& s) {
  for (int l = 0; l < stops.count; ++l) {
    float right[3], down[3], forward[3], ox[3], oy[3];
    float s11 = 0, s22 = 0;
    for (int a = 0; a < 3; ++a) {
      const float cell = pass.axis[a].cell[stops.index[a][l]];
      const float inverse = 1.0F / cell;
      right[a] = camera.right[a] * inverse * camera.pixel;
      down[a] = camera.down[a] * inverse * camera.pixel;
      forward[a] = camera.forward[a] * inverse;
      s11 += camera.right[a] * camera.right[a] * cell * cell;
      s22 += camera.down[a] * camera.down[a] * cell * cell;
    }
    const float length2 = dot3(forward, forward);
    const float inverse2 = 1.0F / length2;
    cross3(right, forward, ox);
    cross3(down, forward, oy);
    s.xx[l] = dot3(ox, ox) * inverse2;
    s.xy[l] = 2.0F * dot3(ox, oy) * inverse2;
    s.yy[l] = dot3(oy, oy) * inverse2;
    s.cells_depth[l] = square_root(length2);
    s.x[l] = camera.half_width_px + stops.x[l] * camera.inverse_pixel;
    s.y[l] = camera.half_height_px + stops.y[l] * camera.inverse_pixel;
    const float wide = footprint_t * square_root(s11) * camera.inverse_pixel;
    const float tall = footprint_t * square_root(s22) * camera.inverse_pixel;
    s.x0[l] = s.x[l] - wide;
    s.x1[l] = s.x[l] + wide;
    s.y0[l] = s.y[l] - tall;
    s.y1[l] = s.y[l] + tall;
  }
}

template <bool Perspective>
void prepare_splats(const Camera& camera, const Pass& pass, const Stops& stops,
                    const Densities& densities, Splats& s) {
  constexpr float normalise = 1.0F / footprint_integral;
  if (Perspective) {
    perspective_splats(camera, pass, stops, s);
    for (int l = 0; l < stops.count; ++l) s.strength[l] = densities.rho[l] * normalise;
  } else {
    orthographic_splats(camera, pass, stops, s);
    for (int l = 0; l < stops.count; ++l) {
      s.strength[l] = densities.rho[l] * normalise / s.cells_depth[l];
    }
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
