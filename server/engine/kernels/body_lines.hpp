// Part of the kernel body: oriented lines, from a stop's wind to a ribbon on the screen.
#pragma once

#include "server/engine/kernels/body_stops.hpp"

namespace windsplat::engine::kernels {
namespace {

// One a stop. A ribbon's place along it is f in [0, 1] from its tail end to its head end, as
// clipped; colour and depth are linear in f.
struct Ribbons {
  int drawn[brick_stops];
  float x[brick_stops], y[brick_stops];    // f = 0, pixels
  float ux[brick_stops], uy[brick_stops];  // from f = 0 to 1, pixels
  float inverse_u2[brick_stops];
  float w0[brick_stops];  // where along itself a line is met at its start: 0; a dot everywhere: 1/2
  float depth_ratio[brick_stops];  // view distance at f = 0 over that at f = 1
  float tail[3][brick_stops];      // colour at f = 0
  float rise[3][brick_stops];      // colour at f = 1 minus that
  float depth[brick_stops];        // view distance at f = 0 minus the kernel's centre's
  float depth_rise[brick_stops];
};

// Segments in the world: the line's centre and extent, clipped to q in [low, high].
struct Segments {
  float offset[3][brick_stops];  // of the line's centre from the stop
  float in_box[3][brick_stops];  // of the line's centre from its kernel's centre
  float extent[3][brick_stops];  // tail to head
  float low[brick_stops], high[brick_stops];
};

void move_centres(const Pass& pass, const Stops& stops, Segments& s) {
  const LineStyle& line = pass.line;
  const Hash3 key = pcg3d({line.seed, line.epoch, 0x9e3779b9U});
  std::uint32_t at[3][brick_stops];
  float cell[3][brick_stops];
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = pass.axis[a];
    for (int l = 0; l < stops.count; ++l) {
      at[a][l] = static_cast<std::uint32_t>(axis.sample[stops.index[a][l]]);
      cell[a][l] = axis.cell[stops.index[a][l]];
    }
  }
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const Hash3 kernel = pcg3d({at[0][l] + key.x, at[1][l] + key.y, at[2][l] + key.z});
    const Hash3 centre = pcg3d(kernel);
    const float us[3] = {unit_interval(kernel.x), unit_interval(kernel.y), unit_interval(kernel.z)};
    const float uc[3] = {unit_interval(centre.x), unit_interval(centre.y), unit_interval(centre.z)};
    for (int a = 0; a < 3; ++a) {
      s.in_box[a][l] = line.jitter_center * (uc[a] - 0.5F) * cell[a][l];
      s.offset[a][l] = s.in_box[a][l] + line.jitter_stride * (us[a] - 0.5F) * cell[a][l];
    }
  }
}

// Liang-Barsky against the kernel box: per axis |in_box + q extent| <= half the box.
void clip_to_box(const Pass& pass, const Stops& stops, Segments& s) {
  for (int l = 0; l < stops.count; ++l) {
    s.low[l] = -0.5F;
    s.high[l] = 0.5F;
  }
  for (int a = 0; a < 3; ++a) {
    float half[brick_stops];
    for (int l = 0; l < stops.count; ++l) {
      half[l] = pass.line.half_span * pass.axis[a].cell[stops.index[a][l]];
    }
    WINDSPLAT_LANES
    for (int l = 0; l < stops.count; ++l) {
      const float inverse = 1.0F / divisor(s.extent[a][l]);
      const float enter = (-half[l] - s.in_box[a][l]) * inverse;
      const float leave = (half[l] - s.in_box[a][l]) * inverse;
      s.low[l] = larger(s.low[l], smaller(enter, leave));
      s.high[l] = smaller(s.high[l], larger(enter, leave));
    }
  }
}

inline float dot3(const float a[3], float x, float y, float z) {
  return a[0] * x + a[1] * y + a[2] * z;
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

inline float color_value(const Pass& pass, const Stops& stops, const Winds& winds,
                         const Segments& s, float view_distance, int l) {
  const LineStyle& line = pass.line;
  const float z = pass.axis[2].position[stops.index[2][l]] + s.offset[2][l];
  switch (line.color_by) {
    case 0:
      return z;
    case 1:
      return view_distance;
    case 2: {
      const float height = (z - line.box_low_z) * line.inverse_box_height;
      const float rise = 0.5F + 0.5F * winds.direction[2][l];
      return (1.0F - line.rise_weight) * height + line.rise_weight * rise;
    }
    case 3:
      return winds.magnitude[l];
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
    float rgb[3];
    look_up(line.color, color_value(pass, stops, winds, s, distance, l), rgb);
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

template <bool Perspective>
void prepare_ribbons(const Camera& camera, const Pass& pass, const Stops& stops, const Winds& winds,
                     Ribbons& ribbons) {
  Segments segments;
  float q_low[brick_stops];
  float q_high[brick_stops];
  const LineStyle& line = pass.line;
  move_centres(pass, stops, segments);
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const float part = clamped(winds.magnitude[l] * line.inverse_full_magnitude, 0.0F, 1.0F);
    for (int a = 0; a < 3; ++a) {
      segments.extent[a][l] = winds.direction[a][l] * (line.length * part);
    }
  }
  clip_to_box(pass, stops, segments);
  project_segments<Perspective>(camera, pass, stops, winds, segments, q_low, q_high, ribbons);
  color_ribbons(camera, pass, stops, winds, segments, q_low, q_high, ribbons);
}

}  // namespace
}  // namespace windsplat::engine::kernels
