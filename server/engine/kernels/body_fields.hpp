// Part of the kernel body: magnitudes and extinctions at the kernel positions of a brick, read from
// the fields.
#pragma once

#include "server/engine/kernels/body_rows.hpp"

namespace windsplat::engine::kernels {
namespace {

// Nonzero magnitudes of lines are never less, so that none is lost as a denormal; see
// LineStyle::magnitude_scale.
constexpr float magnitude_least = 0x1p-124F;
constexpr float normal_least = 1.17549435e-38F;

// The vectors at kernel positions.
struct Vectors {
  Kernel magnitude;         // of the raw data times magnitude_scale; negative: no line
  Three<Kernel> direction;  // a unit vector along the axes of the cell
};

// Lengths and their inverses; the inverse is finite but arbitrary below normal_least.
struct Norm {
  Kernel length, inverse;
};

constexpr float moderate_low = 1e-15F;
constexpr float moderate_high = 1e15F;

// The norm of vectors whose largest component is zero or of moderate size.
KERNEL_INLINE Norm moderate_norm(const Three<Kernel>& v) {
  const Kernel square = dot3(v, v);
  const Kernel inverse = inverse_root(hn::Max(square, all<Kernel>(1e-30F)));
  // A further Newton step: a vector whose length equals a tolerance must not fall below it.
  const Kernel length = square * inverse;
  const Kernel rest = hn::NegMulAdd(length, length, square);
  return {hn::MulAdd(rest, all<Kernel>(0.5F) * inverse, length), inverse};
}

// Avoids overflow and underflow by dividing by the largest component, unless that is zero or of
// moderate size in every lane.
KERNEL_INLINE Norm norm_of(const Three<Kernel>& v) {
  const Kernel top = hn::Max(hn::Max(hn::Abs(v.x), hn::Abs(v.y)), hn::Abs(v.z));
  const auto moderate =
      hn::And(hn::Ge(top, all<Kernel>(moderate_low)), hn::Le(top, all<Kernel>(moderate_high)));
  const auto nothing = hn::Le(top, hn::Zero(KernelTag()));
  if (HWY_LIKELY(hn::AllTrue(KernelTag(), hn::Or(moderate, nothing)))) {
    return moderate_norm(v);
  }
  const Kernel least = all<Kernel>(normal_least);
  const Kernel scale = inverse_of(hn::Max(top, least));
  const Three<Kernel> unit = {v.x * scale, v.y * scale, v.z * scale};
  const Kernel length = top * hn::Sqrt(dot3(unit, unit));
  return {length, inverse_of(hn::Max(length, least))};
}

// Vectors in the field; zero if masked (a masked sample is masked in every component).
KERNEL_INLINE Three<Kernel> fetch_vectors(const Pass& pass, const Rows& rows, int i) {
  const LineStyle& line = pass.line;
  const Kernel zero = hn::Zero(KernelTag());
  const Kernel x = fetch(line.velocity[0], rows, i);
  const Kernel y = fetch(line.velocity[1], rows, i);
  const Kernel z = line.velocity[2] != nullptr ? fetch(line.velocity[2], rows, i) : zero;
  const auto masked = is_masked(x);
  return {hn::IfThenElse(masked, zero, x), hn::IfThenElse(masked, zero, y),
          hn::IfThenElse(masked, zero, z)};
}

// Indices below 2^22 divided by the stride of the data, rounded down. Half an index more than a
// multiple is farther from the next one than the product is from the quotient.
KERNEL_INLINE UnsignedOf<Kernel> divided_by_stride(const LineStyle& line,
                                                   UnsignedOf<Kernel> index) {
  const hn::RebindToUnsigned<KernelTag> tag;
  const hn::RebindToSigned<KernelTag> integers;
  const Kernel number = from_integer<Kernel>(hn::BitCast(integers, index)) + all<Kernel>(0.5F);
  return hn::BitCast(tag, hn::ConvertTo(integers, number * all<Kernel>(line.inverse_data_stride)));
}

// The samples of the data whose lines are drawn. At a coarser level, each is drawn from a group by
// the highest bits of a hash (data::Reduction::drawn). Where the group has no sample at that place
// the field is masked, and the sample any one.
KERNEL_INLINE Hash3<UnsignedOf<Kernel>> drawn_samples(const LineStyle& line, const Rows& rows,
                                                      int i) {
  const hn::RebindToUnsigned<KernelTag> tag;
  const hn::RebindToSigned<KernelTag> integers;
  const auto position = [&](int a) {
    return hn::BitCast(tag, hn::Load(integers, rows.sample[a] + i));
  };
  const Hash3<UnsignedOf<Kernel>> group = {position(0), position(1), position(2)};
  if (line.merged == 0) return group;
  const auto drawn = [&](int a, UnsignedOf<Kernel> index, UnsignedOf<Kernel> bits) {
    const auto number = [&](int n) { return hn::Set(tag, static_cast<std::uint32_t>(n)); };
    const auto place = hn::ShiftRight<16>(hn::ShiftRight<16>(bits) * number(line.drawn_places[a]));
    const auto first = hn::ShiftLeftSame(index, line.halvings[a]);
    const auto last = number(line.data_dims[a] - 1);
    if (line.data_stride == 1) return hn::Min(first + place, last);
    // The middle one of the samples of the kernel.
    const auto kernel = divided_by_stride(line, first + number(line.data_stride / 2)) + place;
    const auto low = hn::Min(kernel * number(line.data_stride), last);
    const auto high = hn::Min(low + number(line.data_stride - 1), last);
    return low + hn::ShiftRight<1>(high - low);
  };
  const Hash3<UnsignedOf<Kernel>> hash = pcg3d(group);
  return {drawn(0, group.x, hash.x), drawn(1, group.y, hash.y), drawn(2, group.z, hash.z)};
}

KERNEL_INLINE Kernel looked_up(const float* table, UnsignedOf<Kernel> indices) {
  alignas(64) std::uint32_t index[pair_kernels];
  alignas(64) float lanes[pair_kernels];
  hn::Store(indices, hn::RebindToUnsigned<KernelTag>(), index);
  for (int k = 0; k < kernel_lanes; ++k) lanes[k] = table[index[k]];
  return load<Kernel>(lanes);
}

// Factors from the components of vectors of the field to those drawn.
KERNEL_INLINE Three<Kernel> rates_of(const LineStyle& line, const Rows& rows, int i) {
  const Kernel one = all<Kernel>(1.0F);
  const Kernel rate_y = all<Kernel>(line.rate_y);
  if (line.rate_x == nullptr && line.rate_z == nullptr) return {one, rate_y, one};
  const Hash3<UnsignedOf<Kernel>> sample = drawn_samples(line, rows, i);
  return {line.rate_x == nullptr ? one : looked_up(line.rate_x, sample.y), rate_y,
          line.rate_z == nullptr ? one : looked_up(line.rate_z, sample.z)};
}

// Vectors whose largest component is zero or of moderate size. Compared as integers: a denormal,
// which may count as zero in floating point, is neither.
KERNEL_INLINE MaskOf<Kernel> is_moderate(const Three<Kernel>& v) {
  const hn::RebindToSigned<KernelTag> integers;
  const auto size = [&](Kernel c) {
    return hn::And(hn::BitCast(integers, c), hn::Set(integers, 0x7fffffff));
  };
  const auto top = hn::Max(hn::Max(size(v.x), size(v.y)), size(v.z));
  const auto low = hn::Set(integers, __builtin_bit_cast(std::int32_t, moderate_low));
  const auto high = hn::Set(integers, __builtin_bit_cast(std::int32_t, moderate_high));
  const auto extreme = hn::Or(hn::Lt(top, low), hn::Gt(top, high));
  return hn::RebindMask(KernelTag(), hn::Or(hn::Not(extreme), hn::Eq(top, hn::Zero(integers))));
}

// The value of any float, where the processor takes denormals for zero too.
inline double widened(float v) {
  const auto bits = __builtin_bit_cast(std::uint32_t, v);
  if ((bits & 0x7f800000U) != 0) return static_cast<double>(v);
  const double size = static_cast<double>(bits & 0x7fffffU) * 0x1p-149;
  return (bits >> 31U) != 0 ? -size : size;
}

inline double length_of(const double v[3]) {
  return __builtin_sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

inline float least_magnitude(const LineStyle& line) {
  return larger(line.min_magnitude, magnitude_least);
}

// The magnitude of a vector times magnitude_scale. Its place above or below the tolerance is
// decided before rounding.
inline float scaled_magnitude(const LineStyle& line, double magnitude) {
  constexpr double largest = 3e38;
  const auto least = static_cast<double>(least_magnitude(line));
  const bool kept = magnitude >= line.unscaled_min_magnitude;
  const double low = kept ? least : static_cast<double>(normal_least);
  const double high = kept ? largest : 0.5 * least;
  const double scaled = magnitude * line.magnitude_scale;
  return static_cast<float>(scaled < low ? low : scaled > high ? high : scaled);
}

// Replaces the vectors of the lanes in `bits`, which may be of any size: in double precision
// neither their squares nor their inverses leave the range of numbers.
inline void read_extremes(const LineStyle& line, const Three<Kernel>& rates, const Three<Kernel>& v,
                          std::uint32_t bits, Vectors& vectors) {
  alignas(64) float data[3][pair_kernels], rate[3][pair_kernels], direction[3][pair_kernels],
      magnitude[pair_kernels];
  store(v.x, data[0]);
  store(v.y, data[1]);
  store(v.z, data[2]);
  store(rates.x, rate[0]);
  store(rates.y, rate[1]);
  store(rates.z, rate[2]);
  store(vectors.magnitude, magnitude);
  store(vectors.direction.x, direction[0]);
  store(vectors.direction.y, direction[1]);
  store(vectors.direction.z, direction[2]);
  for (; bits != 0; bits &= bits - 1U) {
    const int k = __builtin_ctz(bits);
    double at[3] = {widened(data[0][k]), widened(data[1][k]), widened(data[2][k])};
    const double length = length_of(at);
    magnitude[k] = -1;
    if (length <= 0) continue;
    for (int c = 0; c < 3; ++c) {
      at[c] *= static_cast<double>(line.scale[c]) * static_cast<double>(rate[c][k]) / length;
    }
    const double drawn = length_of(at);
    if (drawn <= 0) continue;
    magnitude[k] = scaled_magnitude(line, length);
    for (int c = 0; c < 3; ++c) direction[c][k] = static_cast<float>(at[c] / drawn);
  }
  vectors = {load<Kernel>(magnitude),
             {load<Kernel>(direction[0]), load<Kernel>(direction[1]), load<Kernel>(direction[2])}};
}

// Unit directions as drawn, and magnitudes; a masked sample or one without a direction gets a
// negative magnitude.
KERNEL_INLINE Vectors read_vectors(const Pass& pass, const Rows& rows, int i) {
  const LineStyle& line = pass.line;
  if (line.chains.q != nullptr) {
    const Kernel zero = hn::Zero(KernelTag());
    return {fetch(line.chains.magnitude, rows, i), {zero, zero, zero}};
  }
  const Three<Kernel> all_sizes = fetch_vectors(pass, rows, i);
  const auto moderate = is_moderate(all_sizes);
  const Three<Kernel> v = {hn::IfThenElseZero(moderate, all_sizes.x),
                           hn::IfThenElseZero(moderate, all_sizes.y),
                           hn::IfThenElseZero(moderate, all_sizes.z)};
  const Norm raw = moderate_norm(v);
  // Scaled by 1/m first: the products stay finite for any data.
  const Three<Kernel> rates = rates_of(line, rows, i);
  const Three<Kernel> drawn = {v.x * raw.inverse * all<Kernel>(line.scale[0]) * rates.x,
                               v.y * raw.inverse * all<Kernel>(line.scale[1]) * rates.y,
                               v.z * raw.inverse * all<Kernel>(line.scale[2]) * rates.z};
  const Norm shown = norm_of(drawn);
  const auto known = hn::Ge(shown.length, all<Kernel>(normal_least));
  Vectors vectors = {hn::IfThenElse(known, raw.length, all<Kernel>(-1.0F)),
                     {drawn.x * shown.inverse, drawn.y * shown.inverse, drawn.z * shown.inverse}};
  const std::uint32_t lanes = (2U << (kernel_lanes - 1)) - 1U;
  const std::uint32_t extreme = line.scaled != 0 ? lanes : lanes & ~bits_of<Kernel>(moderate);
  if (HWY_UNLIKELY(extreme != 0)) read_extremes(line, rates, all_sizes, extreme, vectors);
  return vectors;
}

// Upper bound on the width of the cell over all view directions: its longest edge.
KERNEL_INLINE Kernel cell_longest(const Rows& rows, int i) {
  const Kernel x = load<Kernel>(rows.cell[0] + i);
  const Kernel y = load<Kernel>(rows.cell[1] + i);
  return hn::Max(hn::Max(x, y), load<Kernel>(rows.cell[2] + i));
}

struct Extinctions {
  Kernel rho;           // extinction per world unit, sum of all layers
  MaskOf<Kernel> kept;  // optical depth reaches the tolerance in at least one view direction
};

KERNEL_INLINE Extinctions read_extinctions(const Pass& pass, const Rows& rows, int i) {
  const Medium& medium = pass.medium;
  const Kernel zero = hn::Zero(KernelTag());
  Kernel total = zero;
  for (int k = 0; k < medium.layers; ++k) {
    const Extinction& extinction = medium.layer[k].extinction;
    const Kernel raw = fetch(medium.layer[k].values, rows, i);
    const auto masked = is_masked(raw);
    // The value of the first point extends below it. A masked sample lies below every point.
    const Kernel value = hn::IfThenElse(masked, all<Kernel>(-3e38F), raw);
    Kernel rho = hn::IfThenElse(masked, zero, all<Kernel>(extinction.y[0]));
    for (int p = 0; p < extinction.points; ++p) {
      const Kernel x = all<Kernel>(extinction.x[p]);
      const Kernel here =
          all<Kernel>(extinction.y[p]) + all<Kernel>(extinction.slope[p]) * (value - x);
      rho = hn::IfThenElse(hn::Ge(value, x), here, rho);
    }
    rho = hn::Max(rho, zero);
    if (medium.layer[k].share != nullptr) rho = rho * fetch(medium.layer[k].share, rows, i);
    total = total + hn::IfThenElse(masked, zero, rho);
  }
  const Kernel depth = total * cell_longest(rows, i) * all<Kernel>(1.0F / footprint_integral);
  return {total,
          hn::And(hn::Ge(depth, all<Kernel>(medium.min_optical_depth)), hn::Gt(total, zero))};
}

// ---- light of the sun: factors of colours (scene::Light) ----

// Strength of the sun times the phase function of Henyey and Greenstein towards the eye,
// (1 - g^2) / (1 + g^2 - 2 g cos)^(3/2) with the cosine between the ray and the direction of the
// sun.
template <bool Perspective>
inline float sun_seen(const Sunlight& light, const KernelPositions& positions, int l) {
  if (!Perspective || light.anisotropy == 0) return light.media_strength;
  const float x = positions.x[l];
  const float y = positions.y[l];
  const float z = positions.z[l];
  const float way = square_root(larger(x * x + y * y + z * z, 1e-30F));
  const float cosine = (x * light.sun[0] + y * light.sun[1] + z * light.sun[2]) / way;
  const float g = light.anisotropy;
  const float least = (1.0F - larger(g, -g)) * (1.0F - larger(g, -g));
  const float square = larger(1.0F + g * g - 2.0F * g * cosine, least);
  return light.media_strength * (1.0F - g * g) / (square * square_root(square));
}

inline float lit(const Sunlight& light, float sun) {
  return light.ambient + (1.0F - light.ambient) * smaller(sun, 1.0F);
}

constexpr float factor_unit = 1.0F / 65535.0F;

inline float medium_light(const Sunlight& light, const MediumLayer& layer, std::int64_t offset,
                          float sun) {
  if (layer.light == nullptr) return layer.scatters != 0 ? lit(light, sun) : 1.0F;
  const float factor = factor_unit * static_cast<float>(layer.light[offset]);
  return lit(light, layer.scatters != 0 ? sun * factor : factor);
}

inline float line_light(const Sunlight& light, std::int64_t offset) {
  if (light.sunlight == nullptr) return lit(light, light.strength);
  return lit(light, light.strength * factor_unit * static_cast<float>(light.sunlight[offset]));
}

// The colour of all layers together, weighted by their extinctions. `sun`: strength of the light.
template <bool Lit>
void color_density(const Pass& pass, std::int64_t offset, float sun, float* color) {
  const Medium& medium = pass.medium;
  if (medium.layers == 1) {
    look_up(medium.layer[0].color, medium.layer[0].values[offset], color);
    if (!Lit) return;
    const float bright = medium_light(pass.light, medium.layer[0], offset, sun);
    for (int c = 0; c < 3; ++c) color[c] *= bright;
    return;
  }
  color[0] = color[1] = color[2] = 0;
  float total = 0;
  for (int k = 0; k < medium.layers; ++k) {
    const MediumLayer& layer = medium.layer[k];
    const float value = layer.values[offset];
    if (is_masked(value)) continue;
    float rho = extinction_at(layer.extinction, value);
    if (layer.share != nullptr) rho *= layer.share[offset];
    if (rho <= 0) continue;
    float layer_color[3];
    look_up(layer.color, value, layer_color);
    const float bright = Lit ? medium_light(pass.light, layer, offset, sun) : 1.0F;
    for (int c = 0; c < 3; ++c) color[c] += rho * bright * layer_color[c];
    total += rho;
  }
  const float inverse = 1.0F / total;
  for (int c = 0; c < 3; ++c) color[c] *= inverse;
}

// Upper bound on the optical depth summed over pixels of a splat of unit extinction: the volume of
// the cell if it is no narrower than a pixel. A narrower splat is bounded by one that is a pixel
// wide with the same peak, hence by a section of the cell or its longest chord. `scale` is pixels
// per world unit. The extents of a curved cell bound all three.
inline float splat_cover(const Pass& pass, const Rows& rows, int i, float scale) {
  const bool curved = pass.places != nullptr;
  float edge[3];
  for (int a = 0; a < 3; ++a) edge[a] = curved ? pass.cell_max[a] : rows.cell[a][i];
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

// The length of a line that is not drawn relative to LineStyle::length.
inline float weak_part(const LineStyle& line, const Rows& rows, int i, float magnitude) {
  if (line.chains.q != nullptr) return line.chains.q[offset_of(rows, i)];
  return smaller(magnitude * line.inverse_full_magnitude, 1.0F);
}

// Adds the lines of a pair of rows to the summary. Returns the positions with a line.
std::uint32_t summarise_lines(const Pass& pass, const Rows& rows, BrickSummary& summary) {
  const Kernel least = all<Kernel>(least_magnitude(pass.line));
  std::uint32_t lines = 0;
  for (int i = 0; i < pair_kernels; i += kernel_lanes) {
    const std::uint32_t here = pair_bits(rows) >> static_cast<unsigned>(i);
    const Vectors vectors = read_vectors(pass, rows, i);
    const auto drawn = hn::Ge(vectors.magnitude, least);
    const std::uint32_t bits = bits_of<Kernel>(drawn) & here;
    lines |= bits << static_cast<unsigned>(i);
    alignas(64) float magnitude[pair_kernels];
    store(vectors.magnitude, magnitude);
    for (int k = 0; k < kernel_lanes; ++k) {
      if ((bits >> static_cast<unsigned>(k) & 1U) != 0) {
        summary.magnitude_max = larger(summary.magnitude_max, magnitude[k]);
      } else if ((here >> static_cast<unsigned>(k) & 1U) != 0 && magnitude[k] > 0) {
        ++summary.weak_lines;
        summary.weak_parts += weak_part(pass.line, rows, i + k, magnitude[k]);
      }
    }
  }
  return lines;
}

// The same for splats.
std::uint32_t summarise_splats(const Pass& pass, const Rows& rows, float scale,
                               BrickSummary& summary) {
  std::uint32_t splats = 0;
  for (int i = 0; i < pair_kernels; i += kernel_lanes) {
    const Extinctions found = read_extinctions(pass, rows, i);
    const std::uint32_t here = pair_bits(rows) >> static_cast<unsigned>(i);
    const std::uint32_t kept = bits_of<Kernel>(found.kept) & here;
    splats |= kept << static_cast<unsigned>(i);
    const auto there = hn::Gt(found.rho, hn::Zero(KernelTag()));
    std::uint32_t thin = bits_of<Kernel>(there) & here & ~kept;
    if (thin == 0) continue;
    alignas(64) float rho[pair_kernels];
    store(found.rho, rho);
    for (; thin != 0; thin &= thin - 1U) {
      const int k = __builtin_ctz(thin);
      summary.thin_medium += rho[k] * splat_cover(pass, rows, i + k, scale);
    }
  }
  return splats;
}

void summarise(const Pass& pass, const Brick& brick, float scale, BrickSummary& summary) {
  Rows rows;
  open_rows(pass, brick, rows);
  summary = {};
  for (int pair = 0; pair < rows.pairs; ++pair) {
    set_pair(pass, pair, rows);
    const std::uint32_t lines = pass.has_lines != 0 ? summarise_lines(pass, rows, summary) : 0;
    const std::uint32_t splats =
        pass.has_medium != 0 ? summarise_splats(pass, rows, scale, summary) : 0;
    summary.lines += __builtin_popcount(lines);
    summary.splats += __builtin_popcount(splats);
    summary.without_both += __builtin_popcount(pair_bits(rows) & ~(lines | splats));
  }
  const int positions = rows.u_count * rows.v_count;
  summary.without_line = pass.has_lines != 0 ? positions - summary.lines : 0;
  summary.without_splat = pass.has_medium != 0 ? positions - summary.splats : 0;
}

}  // namespace
}  // namespace windsplat::engine::kernels
