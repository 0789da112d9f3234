// Part of the kernel body: a brick's stops, from the fields to magnitudes and extinctions.
#pragma once

#include "server/engine/kernels/body_math.hpp"
#include "server/engine/kernels/prepared.hpp"

namespace windsplat::engine::kernels {
namespace {

constexpr float magnitude_least = 1.17549435e-38F;  // denormal vectors count as zero

// What a stop's line needs of the field.
struct Winds {
  float magnitude[brick_stops];     // of the raw data; negative: no line
  float direction[3][brick_stops];  // along the cell's own axes
  float bent[3][brick_stops];       // the same in the world, on a curved lattice only
};

void list_stops(const Pass& pass, const Brick& brick, Stops& stops) {
  const int* us = pass.axis[pass.u].visit + brick.u_first;
  const int* vs = pass.axis[pass.v].visit + brick.v_first;
  const int slab = pass.axis[pass.major].visit[brick.slab];
  const std::int64_t slab_offset = pass.step[pass.major] * pass.axis[pass.major].sample[slab];
  std::int64_t along_u[brick_side];
  for (int i = 0; i < brick.u_count; ++i) {
    along_u[i] = pass.step[pass.u] * pass.axis[pass.u].sample[us[i]];
  }
  int n = 0;
  for (int j = 0; j < brick.v_count; ++j) {
    const std::int64_t row = slab_offset + pass.step[pass.v] * pass.axis[pass.v].sample[vs[j]];
    for (int i = 0; i < brick.u_count; ++i, ++n) {
      stops.index[pass.u][n] = us[i];
      stops.index[pass.v][n] = vs[j];
      stops.index[pass.major][n] = slab;
      stops.offset[n] = row + along_u[i];
    }
  }
  stops.count = n;
}

// Camera coordinates, summed in double so that an eye far away or close by loses nothing.
void place_stops(const Camera& camera, const Pass& pass, const Brick& brick, Stops& stops) {
  const int* us = pass.axis[pass.u].visit + brick.u_first;
  const int* vs = pass.axis[pass.v].visit + brick.v_first;
  const int slab = pass.axis[pass.major].visit[brick.slab];
  double along_u[3][brick_side];
  for (int i = 0; i < brick.u_count; ++i) {
    for (int c = 0; c < 3; ++c) along_u[c][i] = pass.axis[pass.u].camera[3 * us[i] + c];
  }
  const double* from_slab = pass.axis[pass.major].camera + 3 * static_cast<std::ptrdiff_t>(slab);
  for (int j = 0; j < brick.v_count; ++j) {
    const double* from_v = pass.axis[pass.v].camera + 3 * static_cast<std::ptrdiff_t>(vs[j]);
    const double base[3] = {from_slab[0] + from_v[0], from_slab[1] + from_v[1],
                            from_slab[2] + from_v[2]};
    const double middle = base[2] - camera.depth_origin;
    const int row = j * brick.u_count;
    for (int i = 0; i < brick.u_count; ++i) {
      stops.x[row + i] = static_cast<float>(base[0] + along_u[0][i]);
      stops.y[row + i] = static_cast<float>(base[1] + along_u[1][i]);
      stops.z[row + i] = static_cast<float>(base[2] + along_u[2][i]);
      stops.depth[row + i] = static_cast<float>(middle + along_u[2][i]);
    }
  }
}

// Magnitude without overflow or underflow: the largest component is taken out first.
inline float magnitude_of(float x, float y, float z) {
  const float top = larger(larger(absolute(x), absolute(y)), absolute(z));
  const float inverse = 1.0F / larger(top, magnitude_least);
  const float a = x * inverse;
  const float b = y * inverse;
  const float c = z * inverse;
  return top * square_root(a * a + b * b + c * c);
}

// A stop's vector in the field, with the rates that turn it into the picture's; zero if masked.
void fetch_winds(const Pass& pass, const Stops& stops, Winds& winds, float* rate_x, float* rate_z) {
  const LineStyle& line = pass.line;
  const Axis& y = pass.axis[1];
  const Axis& z = pass.axis[2];
  for (int c = 0; c < 3; ++c) {
    const float* values = line.velocity[c];
    if (values == nullptr) {
      for (int l = 0; l < stops.count; ++l) winds.direction[c][l] = 0;
    } else {
      for (int l = 0; l < stops.count; ++l) winds.direction[c][l] = values[stops.offset[l]];
    }
  }
  for (int l = 0; l < stops.count; ++l) {
    // A masked sample is masked in every component.
    const bool masked = is_masked(winds.direction[0][l]);
    for (auto& component : winds.direction) component[l] = masked ? 0.0F : component[l];
  }
  if (line.rate_x == nullptr) {
    for (int l = 0; l < stops.count; ++l) rate_x[l] = rate_z[l] = 1.0F;
  } else {
    for (int l = 0; l < stops.count; ++l) {
      rate_x[l] = line.rate_x[y.sample[stops.index[1][l]]];
      rate_z[l] = line.rate_z[z.sample[stops.index[2][l]]];
    }
  }
}

// Unit directions as drawn, and magnitudes; a masked sample, one below tolerance or one without a
// direction gets a negative magnitude. left_out, if there: the magnitudes below tolerance, else 0.
void read_winds(const Pass& pass, const Stops& stops, Winds& winds, float* left_out = nullptr) {
  const LineStyle& line = pass.line;
  float rate_x[brick_stops];
  float rate_z[brick_stops];
  fetch_winds(pass, stops, winds, rate_x, rate_z);
  const float least = larger(line.min_magnitude, magnitude_least);
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const float u = winds.direction[0][l];
    const float v = winds.direction[1][l];
    const float w = winds.direction[2][l];
    const float m = magnitude_of(u, v, w);
    // Scaled by 1/m first: the products stay finite for any data.
    const float inverse = 1.0F / larger(m, magnitude_least);
    const float x = u * inverse * line.scale[0] * rate_x[l];
    const float y = v * inverse * line.scale[1] * line.rate_y;
    const float z = w * inverse * line.scale[2] * rate_z[l];
    const float length = magnitude_of(x, y, z);
    const float unit = 1.0F / larger(length, magnitude_least);
    winds.direction[0][l] = x * unit;
    winds.direction[1][l] = y * unit;
    winds.direction[2][l] = z * unit;
    const float directed = length >= magnitude_least ? m : -1.0F;
    winds.magnitude[l] = directed;
  }
  for (int l = 0; left_out != nullptr && l < stops.count; ++l) {
    left_out[l] = winds.magnitude[l] < least ? larger(winds.magnitude[l], 0.0F) : 0.0F;
  }
  for (int l = 0; l < stops.count; ++l) {
    winds.magnitude[l] = winds.magnitude[l] >= least ? winds.magnitude[l] : -1.0F;
  }
}

// The widest a ray's cell can be, over all view directions: the stop's longest edge.
inline float cell_longest(const Pass& pass, const Stops& stops, int l) {
  float longest = 0;
  for (int a = 0; a < 3; ++a) longest = larger(longest, pass.axis[a].cell[stops.index[a][l]]);
  return longest;
}

// Extinctions of the layers add; a stop whose optical depth stays below tolerance from every side
// counts as empty. left_out, if there: the extinctions of those, else 0.
void read_densities(const Pass& pass, const Stops& stops, Densities& out,
                    float* left_out = nullptr) {
  const Medium& medium = pass.medium;
  float value[brick_stops];
  float rho[brick_stops];
  for (int l = 0; l < stops.count; ++l) out.rho[l] = 0;
  for (int k = 0; k < medium.layers; ++k) {
    const Extinction& extinction = medium.layer[k].extinction;
    for (int l = 0; l < stops.count; ++l) value[l] = medium.layer[k].values[stops.offset[l]];
    // Below the first point its value holds; a masked sample compares false with every point.
    for (int l = 0; l < stops.count; ++l) {
      rho[l] = is_masked(value[l]) ? 0.0F : extinction.y[0];
      value[l] = is_masked(value[l]) ? -3e38F : value[l];
    }
    for (int p = 0; p < extinction.points; ++p) {
      const float x = extinction.x[p];
      const float y = extinction.y[p];
      const float slope = extinction.slope[p];
      WINDSPLAT_LANES
      for (int l = 0; l < stops.count; ++l) {
        const float here = y + slope * (value[l] - x);
        rho[l] = value[l] >= x ? here : rho[l];
      }
    }
    for (int l = 0; l < stops.count; ++l) out.rho[l] += larger(rho[l], 0.0F);
  }
  for (int l = 0; l < stops.count; ++l) {
    const float depth = out.rho[l] * cell_longest(pass, stops, l) * (1.0F / footprint_integral);
    const bool kept = depth >= medium.min_optical_depth;
    if (left_out != nullptr) left_out[l] = kept ? 0.0F : out.rho[l];
    out.rho[l] = kept ? out.rho[l] : 0.0F;
  }
}

// Colours mix by extinction.
void color_densities(const Pass& pass, const Stops& stops, Densities& out) {
  const Medium& medium = pass.medium;
  for (int l = 0; l < stops.count; ++l) {
    if (out.rho[l] <= 0) continue;
    float color[3] = {0, 0, 0};
    float total = 0;
    for (int k = 0; k < medium.layers; ++k) {
      const MediumLayer& layer = medium.layer[k];
      const float value = layer.values[stops.offset[l]];
      if (is_masked(value)) continue;
      const float rho = extinction_at(layer.extinction, value);
      if (rho <= 0) continue;
      float own[3];
      look_up(layer.color, value, own);
      for (int c = 0; c < 3; ++c) color[c] += rho * own[c];
      total += rho;
    }
    const float inverse = 1.0F / total;
    for (int c = 0; c < 3; ++c) out.color[c][l] = color[c] * inverse;
  }
}

// At most how many pixels a splat of unit extinction covers times its optical depth there: a splat
// whose cell is no narrower than a pixel spreads its volume. One that is narrower is no higher than
// the splat one pixel wide with its peak; then a section of the cell counts, or its longest chord.
// `scale` is pixels a world unit; of a curved cell the extents bound all three.
inline float splat_cover(const Pass& pass, const Stops& stops, int l, float scale) {
  const bool curved = pass.places != nullptr;
  float edge[3];
  for (int a = 0; a < 3; ++a) {
    edge[a] = curved ? pass.cell_max[a] : pass.axis[a].cell[stops.index[a][l]];
  }
  const float volume = edge[0] * edge[1] * edge[2];
  const float faces[3] = {edge[1] * edge[2], edge[2] * edge[0], edge[0] * edge[1]};
  const auto length = [](const float v[3]) {
    return square_root(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  };
  const auto widest = [](const float v[3]) { return larger(larger(v[0], v[1]), v[2]); };
  const float section = curved ? length(faces) : widest(faces);
  const float chord = curved ? length(edge) : widest(edge);
  return larger(larger(volume * scale * scale, section * scale), chord);
}

void summarise(const Pass& pass, const Brick& brick, float scale, BrickSummary& summary) {
  Stops stops;
  list_stops(pass, brick, stops);
  Winds winds;
  Densities densities;
  float lines[brick_stops] = {0};
  float splats[brick_stops] = {0};
  if (pass.has_lines != 0) read_winds(pass, stops, winds, lines);
  if (pass.has_medium != 0) read_densities(pass, stops, densities, splats);
  summary = {};
  for (int l = 0; l < stops.count; ++l) {
    summary.weak_lines += lines[l] > 0 ? 1 : 0;
    summary.weak_parts += smaller(lines[l] * pass.line.inverse_full_magnitude, 1.0F);
    if (splats[l] > 0) summary.thin_medium += splats[l] * splat_cover(pass, stops, l, scale);
  }
  for (int l = 0; l < stops.count; ++l) {
    const bool line = pass.has_lines != 0 && winds.magnitude[l] > 0;
    const bool splat = pass.has_medium != 0 && densities.rho[l] > 0;
    summary.lines += static_cast<int>(line);
    summary.splats += static_cast<int>(splat);
    summary.without_both += static_cast<int>(!line && !splat);
    if (line) summary.magnitude_max = larger(summary.magnitude_max, winds.magnitude[l]);
  }
  summary.without_line = pass.has_lines != 0 ? stops.count - summary.lines : 0;
  summary.without_splat = pass.has_medium != 0 ? stops.count - summary.splats : 0;
}

// Closes the gaps that stops no longer wanted would leave. Order is kept.
void keep_stops(const int* kept, Stops& stops) {
  int n = 0;
  for (int l = 0; l < stops.count; ++l) {
    for (auto& index : stops.index) index[n] = index[l];
    stops.offset[n] = stops.offset[l];
    stops.x[n] = stops.x[l];
    stops.y[n] = stops.y[l];
    stops.z[n] = stops.z[l];
    stops.depth[n] = stops.depth[l];
    n += kept[l];
  }
  stops.count = n;
}

// Leaves out the stops that are nearer than the near plane or whose kernel, at most `reach` about
// them along right, down and forward, misses the tile widened by `margin` pixels. Order is kept.
template <bool Perspective>
void cull_stops(const Camera& camera, const Tile& tile, const float reach[3], float margin,
                Stops& stops) {
  const float x0 = (static_cast<float>(tile.x) - margin - camera.half_width_px) * camera.pixel;
  const float x1 =
      (static_cast<float>(tile.x + tile.width) + margin - camera.half_width_px) * camera.pixel;
  const float y0 = (static_cast<float>(tile.y) - margin - camera.half_height_px) * camera.pixel;
  const float y1 =
      (static_cast<float>(tile.y + tile.height) + margin - camera.half_height_px) * camera.pixel;
  const float rz = Perspective ? reach[2] : 0.0F;
  const float left = reach[0] + absolute(x0) * rz;
  const float right = reach[0] + absolute(x1) * rz;
  const float top = reach[1] + absolute(y0) * rz;
  const float bottom = reach[1] + absolute(y1) * rz;
  int kept[brick_stops];
  WINDSPLAT_LANES
  for (int l = 0; l < stops.count; ++l) {
    const float z = Perspective ? stops.z[l] : 1.0F;
    // The largest of how far it lies outside any plane.
    float outside = x0 * z - stops.x[l] - left;
    outside = larger(outside, stops.x[l] - x1 * z - right);
    outside = larger(outside, y0 * z - stops.y[l] - top);
    outside = larger(outside, stops.y[l] - y1 * z - bottom);
    if (Perspective) outside = larger(outside, z >= camera.near ? outside : 1.0F);
    kept[l] = outside <= 0 ? 1 : 0;
  }
  keep_stops(kept, stops);
}

}  // namespace
}  // namespace windsplat::engine::kernels
