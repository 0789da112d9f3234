// Part of the kernel body: splats, from a stop's extinction to its footprint on the screen.
#pragma once

#include "server/engine/kernels/body_cells.hpp"

namespace windsplat::engine::kernels {
namespace {

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

// What of the cell a view direction meets: its squares along the camera's axes times t^2, and the
// screen's axes in cells a pixel.
struct Facing {
  float s11, s22, s33, s13, s23;
  float right[3], down[3], forward[3];  // cells per pixel; forward per world unit
  float edges2;                         // squared lengths of the three edges together
};

template <bool Curved>
inline Facing face(const Camera& camera, const Cells& cells, int l) {
  constexpr float t2 = footprint_t * footprint_t;
  Facing f = {};
  for (int a = 0; a < 3; ++a) {
    float edge[3] = {0, 0, 0};
    for (int c = 0; c < 3; ++c) {
      if (Curved || c == a) edge[c] = cells.edge[a][c][l];
    }
    const float r = Curved ? dot3(camera.right, edge) : camera.right[a] * edge[a];
    const float d = Curved ? dot3(camera.down, edge) : camera.down[a] * edge[a];
    const float w = Curved ? dot3(camera.forward, edge) : camera.forward[a] * edge[a];
    f.s11 += t2 * r * r;
    f.s22 += t2 * d * d;
    f.s33 += t2 * w * w;
    f.s13 += t2 * r * w;
    f.s23 += t2 * d * w;
    f.edges2 += Curved ? dot3(edge, edge) : edge[a] * edge[a];
  }
  to_grid<Curved>(cells, l, camera.right, f.right);
  to_grid<Curved>(cells, l, camera.down, f.down);
  to_grid<Curved>(cells, l, camera.forward, f.forward);
  for (int a = 0; a < 3; ++a) {
    f.right[a] *= camera.pixel;
    f.down[a] *= camera.pixel;
  }
  return f;
}

template <bool Curved>
void perspective_splats(const Camera& camera, const Stops& stops, const Cells& cells, Splats& s) {
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const Facing f = face<Curved>(camera, cells, l);
    const float from_eye[3] = {cells.from_eye[0][l], cells.from_eye[1][l], cells.from_eye[2][l]};
    float o[3], ox[3], oy[3];
    to_grid<Curved>(cells, l, from_eye, o);
    cross3(o, f.right, ox);
    cross3(o, f.down, oy);
    s.xx[l] = dot3(ox, ox);
    s.xy[l] = 2.0F * dot3(ox, oy);
    s.yy[l] = dot3(oy, oy);
    const float scale = camera.inverse_pixel / stops.z[l];
    s.x[l] = camera.half_width_px + stops.x[l] * scale;
    s.y[l] = camera.half_height_px + stops.y[l] * scale;
    // The nearest point of the picture; its ray, forward component 1, in cells.
    s.ex[l] = clamped(s.x[l], 0.0F, 2.0F * camera.half_width_px);
    s.ey[l] = clamped(s.y[l], 0.0F, 2.0F * camera.half_height_px);
    const bool inside = s.ex[l] == s.x[l] && s.ey[l] == s.y[l];
    float d[3];
    for (int a = 0; a < 3; ++a) {
      const float there = f.forward[a] + (s.ex[l] - camera.half_width_px) * f.right[a] +
                          (s.ey[l] - camera.half_height_px) * f.down[a];
      d[a] = inside ? o[a] / stops.z[l] : there;
    }
    s.d0[l] = dot3(d, d);
    s.dx[l] = 2.0F * dot3(d, f.right);
    s.dy[l] = 2.0F * dot3(d, f.down);
    s.dxx[l] = dot3(f.right, f.right);
    s.dxy[l] = 2.0F * dot3(f.right, f.down);
    s.dyy[l] = dot3(f.down, f.down);
    s.b0[l] = inside ? 0.0F : dot3(o, d) - stops.z[l] * s.d0[l];
    s.bx[l] = dot3(o, f.right) - stops.z[l] * s.dx[l];
    s.by[l] = dot3(o, f.down) - stops.z[l] * s.dy[l];
    s.d2_least[l] = 1.0F / f.edges2;
    s.z[l] = stops.z[l];
    s.half_depth[l] = square_root(f.s33);
    const Extent across = silhouette(stops.x[l], stops.z[l], f.s11, f.s13, f.s33);
    const Extent along = silhouette(stops.y[l], stops.z[l], f.s22, f.s23, f.s33);
    s.x0[l] = camera.half_width_px + across.low * camera.inverse_pixel;
    s.x1[l] = camera.half_width_px + across.high * camera.inverse_pixel;
    s.y0[l] = camera.half_height_px + along.low * camera.inverse_pixel;
    s.y1[l] = camera.half_height_px + along.high * camera.inverse_pixel;
  }
}

template <bool Curved>
void orthographic_splats(const Camera& camera, const Stops& stops, const Cells& cells, Splats& s) {
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const Facing f = face<Curved>(camera, cells, l);
    float ox[3], oy[3];
    const float length2 = dot3(f.forward, f.forward);
    const float inverse2 = 1.0F / length2;
    cross3(f.right, f.forward, ox);
    cross3(f.down, f.forward, oy);
    s.xx[l] = dot3(ox, ox) * inverse2;
    s.xy[l] = 2.0F * dot3(ox, oy) * inverse2;
    s.yy[l] = dot3(oy, oy) * inverse2;
    s.d0[l] = length2;
    s.bx[l] = -dot3(f.right, f.forward) * inverse2;
    s.by[l] = -dot3(f.down, f.forward) * inverse2;
    s.half_depth[l] = square_root(f.s33);
    s.x[l] = camera.half_width_px + stops.x[l] * camera.inverse_pixel;
    s.y[l] = camera.half_height_px + stops.y[l] * camera.inverse_pixel;
    const float wide = square_root(f.s11) * camera.inverse_pixel;
    const float tall = square_root(f.s22) * camera.inverse_pixel;
    s.x0[l] = s.x[l] - wide;
    s.x1[l] = s.x[l] + wide;
    s.y0[l] = s.y[l] - tall;
    s.y1[l] = s.y[l] + tall;
  }
}

template <bool Perspective, bool Curved>
void prepare_splats(const Camera& camera, const Stops& stops, const Cells& cells,
                    const Densities& densities, Splats& s) {
  constexpr float normalise = 1.0F / footprint_integral;
  if (Perspective) {
    perspective_splats<Curved>(camera, stops, cells, s);
    for (int l = 0; l < stops.count; ++l) s.strength[l] = densities.rho[l] * normalise;
  } else {
    orthographic_splats<Curved>(camera, stops, cells, s);
    for (int l = 0; l < stops.count; ++l) {
      s.strength[l] = densities.rho[l] * normalise / square_root(s.d0[l]);
    }
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
