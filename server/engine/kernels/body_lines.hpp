// Part of the kernel body: oriented lines, from a stop's wind to a ribbon on the screen.
#pragma once

#include "server/engine/kernels/body_cells.hpp"

namespace windsplat::engine::kernels {
namespace {

// Segments, clipped to q in [low, high].
struct Segments {
  float offset[3][brick_stops];  // of the line's centre from the stop, world units
  float in_box[3][brick_stops];  // of the line's centre from its kernel's centre, cells
  float extent[3][brick_stops];  // tail to head, world units
  float along[3][brick_stops];   // the same in cells
  float low[brick_stops], high[brick_stops];
  float lift[brick_stops];   // of the line's centre from the stop along z, cells
  float phase[brick_stops];  // of the texture's motion
};

template <bool Curved>
void move_centres(const Pass& pass, const Stops& stops, const Cells& cells, Segments& s) {
  const LineStyle& line = pass.line;
  const Hash3 key = pcg3d({line.seed, line.epoch, 0x9e3779b9U});
  std::uint32_t at[3][brick_stops];
  for (int a = 0; a < 3; ++a) {
    for (int l = 0; l < stops.count; ++l) {
      at[a][l] = static_cast<std::uint32_t>(pass.axis[a].sample[stops.index[a][l]]);
    }
  }
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const Hash3 kernel = pcg3d({at[0][l] + key.x, at[1][l] + key.y, at[2][l] + key.z});
    const Hash3 centre = pcg3d(kernel);
    const float us[3] = {unit_interval(kernel.x), unit_interval(kernel.y), unit_interval(kernel.z)};
    const float uc[3] = {unit_interval(centre.x), unit_interval(centre.y), unit_interval(centre.z)};
    float moved[3];
    for (int a = 0; a < 3; ++a) {
      s.in_box[a][l] = line.jitter_center * (uc[a] - 0.5F);
      moved[a] = s.in_box[a][l] + line.jitter_stride * (us[a] - 0.5F);
    }
    float offset[3];
    to_world<Curved>(cells, l, moved, offset);
    for (int a = 0; a < 3; ++a) s.offset[a][l] = offset[a];
    s.lift[l] = moved[2];
    s.phase[l] = unit_interval(pcg3d(centre).x);
  }
}

// The drawn vector, in the world and in cells; a slice keeps what lies in its plane.
template <bool Curved>
void extend_segments(const Pass& pass, const Stops& stops, const Cells& cells, const Winds& winds,
                     Segments& s) {
  const LineStyle& line = pass.line;
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const float part = clamped(winds.magnitude[l] * line.inverse_full_magnitude, 0.0F, 1.0F);
    float extent[3];
    float along[3];
    for (int a = 0; a < 3; ++a) {
      extent[a] = (Curved ? winds.bent[a][l] : winds.direction[a][l]) * (line.length * part);
      if (!Curved) extent[a] *= line.keep[a];
    }
    to_grid<Curved>(cells, l, extent, along);
    for (int a = 0; a < 3; ++a) {
      s.extent[a][l] = extent[a];
      s.along[a][l] = along[a];
    }
  }
}

// Liang-Barsky against the kernel box: per axis |in_box + q along| <= half the box.
void clip_to_box(const Pass& pass, const Stops& stops, Segments& s) {
  const float half = pass.line.half_span;
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    float low = -0.5F;
    float high = 0.5F;
    for (int a = 0; a < 3; ++a) {
      const float inverse = 1.0F / divisor(s.along[a][l]);
      const float enter = (-half - s.in_box[a][l]) * inverse;
      const float leave = (half - s.in_box[a][l]) * inverse;
      low = larger(low, smaller(enter, leave));
      high = smaller(high, larger(enter, leave));
    }
    s.low[l] = low;
    s.high[l] = high;
  }
}

// Where along its texture each line begins: a line at full magnitude runs through motion_cycles.
void phase_ribbons(const Pass& pass, const Stops& stops, const Winds& winds, const Segments& s,
                   const float* q_low, const float* q_high, Ribbons& r) {
  const LineStyle& line = pass.line;
  for (int l = 0; l < stops.count; ++l) {
    const float part = clamped(winds.magnitude[l] * line.inverse_full_magnitude, 0.0F, 1.0F);
    const double cycles = static_cast<double>(s.phase[l]) + line.motion_cycles * part;
    const double whole = static_cast<double>(static_cast<std::int64_t>(cycles));
    const double rest = cycles - whole;
    const double phase = rest < 0 ? rest + 1 : rest;
    r.phase[l] = static_cast<float>(static_cast<double>(q_low[l]) + 1.5 - phase);
    r.phase_rise[l] = q_high[l] - q_low[l];
  }
}

template <bool Perspective>
void project_segments(const Camera& camera, const Pass& pass, const Stops& stops, const Winds& w,
                      const Segments& s, float* __restrict q_low, float* __restrict q_high,
                      Ribbons& __restrict r) {
  const float least = 1e-6F * pass.line.r2;
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const float ex = s.extent[0][l];
    const float ey = s.extent[1][l];
    const float ez = s.extent[2][l];
    const float vx = dot3(camera.right, ex, ey, ez);
    const float vy = dot3(camera.down, ex, ey, ez);
    const float vz = dot3(camera.forward, ex, ey, ez);
    const float ox = s.offset[0][l];
    const float oy = s.offset[1][l];
    const float oz = s.offset[2][l];
    const float px = stops.x[l] + dot3(camera.right, ox, oy, oz);
    const float py = stops.y[l] + dot3(camera.down, ox, oy, oz);
    const float dz = dot3(camera.forward, ox, oy, oz);
    const float pz = stops.z[l] + dz;
    // The near plane takes off the end that is nearer to the eye.
    const float q_near = (camera.near - pz) / divisor(vz);
    const float near_low = vz > 0 ? q_near : -0.5F;
    const float near_high = vz < 0 ? q_near : 0.5F;
    const float low = Perspective ? larger(s.low[l], near_low) : s.low[l];
    const float high = Perspective ? smaller(s.high[l], near_high) : s.high[l];
    const float z0 = Perspective ? larger(pz + low * vz, camera.near) : 1.0F;
    const float z1 = Perspective ? larger(pz + high * vz, camera.near) : 1.0F;
    // Negative if there is no line, nothing of it in its box, or nothing beyond the near plane.
    float shown = smaller(w.magnitude[l], high - low);
    if (Perspective) shown = smaller(shown, pz + 0.5F * absolute(vz) - camera.near);
    r.drawn[l] = shown >= 0 ? 1 : 0;
    const float k0 = camera.inverse_pixel / z0;
    const float k1 = camera.inverse_pixel / z1;
    const float x0 = (px + low * vx) * k0;
    const float y0 = (py + low * vy) * k0;
    const float ux = (px + high * vx) * k1 - x0;
    const float uy = (py + high * vy) * k1 - y0;
    r.x[l] = x0 + camera.half_width_px;
    r.y[l] = y0 + camera.half_height_px;
    r.ux[l] = ux;
    r.uy[l] = uy;
    const float u2 = ux * ux + uy * uy;
    const float inverse_u2 = 1.0F / larger(u2, least * least);
    r.inverse_u2[l] = inverse_u2;
    r.w0[l] = 0.5F - 0.5F * (u2 * inverse_u2);
    r.depth_ratio[l] = z0 / z1;
    r.depth[l] = dz + low * vz;
    r.depth_rise[l] = (high - low) * vz;
    q_low[l] = low;
    q_high[l] = high;
  }
}

// The compass bearing of a vector in degrees, 0 along y, 90 along x, in [0, 360). atan on [0, 1] by
// a polynomial (1e-6 radians).
inline float bearing(float x, float y) {
  const float ax = absolute(x);
  const float ay = absolute(y);
  const float t = smaller(ax, ay) / larger(larger(ax, ay), 1e-30F);
  const float t2 = t * t;
  float p = -0.0117212F;
  p = p * t2 + 0.05265332F;
  p = p * t2 - 0.11643287F;
  p = p * t2 + 0.19354346F;
  p = p * t2 - 0.33262347F;
  p = p * t2 + 0.99997726F;
  constexpr float degrees = 57.29577951F;
  const float from_axis = p * t * degrees;                      // 0 .. 45
  const float first = ax > ay ? 90.0F - from_axis : from_axis;  // from north towards east
  const float half = y < 0 ? 180.0F - first : first;
  const float whole = x < 0 ? 360.0F - half : half;
  return whole < 360.0F ? whole : 0.0F;
}

// Height is that of the unbent lattice on a curved one.
inline float height_of(const Pass& pass, const Stops& stops, const Segments& s, int l) {
  const Axis& z = pass.axis[2];
  return z.position[stops.index[2][l]] + s.lift[l] * z.cell[stops.index[2][l]];
}

inline float color_value(const Pass& pass, const Stops& stops, const Winds& winds,
                         const Segments& s, float view_distance, int l) {
  const LineStyle& line = pass.line;
  const float z = height_of(pass, stops, s, l);
  switch (line.color_by) {
    case 0:
      return z;
    case 1:
      return view_distance;
    case 2: {
      const float height = (z - line.box_low_z) * line.inverse_box_height;
      const float rise = 0.5F + 0.5F * winds.direction[2][l] * line.keep[2];
      return (1.0F - line.rise_weight) * height + line.rise_weight * rise;
    }
    case 3:
      return winds.magnitude[l];
    case 4:
      return bearing(winds.direction[0][l] * line.keep[0], winds.direction[1][l] * line.keep[1]);
    case 5:
      return line.color_values[stops.offset[l]];
    default:
      return 0;
  }
}

// Colour by the table, dimmed by magnitude and by view distance; towards the head it turns grey.
void color_ribbons(const Camera& camera, const Pass& pass, const Stops& stops, const Winds& winds,
                   const Segments& s, const float* q_low, const float* q_high, Ribbons& r) {
  const LineStyle& line = pass.line;
  for (int l = 0; l < stops.count; ++l) {
    if (r.drawn[l] == 0) continue;
    const float distance =
        stops.z[l] + dot3(camera.forward, s.offset[0][l], s.offset[1][l], s.offset[2][l]);
    const float strong =
        clamped((winds.magnitude[l] - line.intensity_low) * line.intensity_scale, 0.0F, 1.0F);
    const float far = clamped((distance - line.cue_near) * line.cue_scale, 0.0F, 1.0F);
    const float dim = (1.0F - line.intensity * (1.0F - strong)) * (1.0F - line.cue_strength * far);
    float rgb[3] = {0.5F, 0.5F, 0.5F};
    const float value = color_value(pass, stops, winds, s, distance, l);
    if (!is_masked(value)) look_up(line.color, value, rgb);
    for (float& c : rgb) c *= dim;
    const float top = larger(larger(rgb[0], rgb[1]), rgb[2]);
    const float grey = line.head_desaturation * (q_low[l] + 0.5F);
    const float more = line.head_desaturation * (q_high[l] - q_low[l]);
    for (int c = 0; c < 3; ++c) {
      r.tail[c][l] = rgb[c] + grey * (top - rgb[c]);
      r.rise[c][l] = more * (top - rgb[c]);
    }
  }
}

template <bool Perspective, bool Curved>
void prepare_ribbons(const Camera& camera, const Pass& pass, const Stops& stops, const Cells& cells,
                     const Winds& winds, Ribbons& ribbons) {
  Segments segments;
  float q_low[brick_stops];
  float q_high[brick_stops];
  move_centres<Curved>(pass, stops, cells, segments);
  extend_segments<Curved>(pass, stops, cells, winds, segments);
  clip_to_box(pass, stops, segments);
  project_segments<Perspective>(camera, pass, stops, winds, segments, q_low, q_high, ribbons);
  color_ribbons(camera, pass, stops, winds, segments, q_low, q_high, ribbons);
  if (pass.line.moving != 0) {
    phase_ribbons(pass, stops, winds, segments, q_low, q_high, ribbons);
  }
}

}  // namespace
}  // namespace windsplat::engine::kernels
