// Base class of all built-in samples, and the noise for their texture.
#include "server/data/samples/source.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::data {

namespace {

// Integer mixing by two multiply-xorshift rounds over a running state; every bit of the inputs
// affects every bit of the result.
std::uint32_t mix(std::uint32_t state, std::uint32_t value) {
  state ^= value + 0x9e3779b9U + (state << 6U) + (state >> 2U);
  state ^= state >> 16U;
  state *= 0x7feb352dU;
  state ^= state >> 15U;
  state *= 0x846ca68bU;
  state ^= state >> 16U;
  return state;
}

// Dot product of the hashed gradient at one lattice point with the offset from it. The components
// of the gradient are three 10-bit fields of the hash, each mapped to [-1, 1].
double corner(std::uint32_t hash, double dx, double dy, double dz) {
  constexpr double unit = 2.0 / 1023.0;
  const double gx = static_cast<double>(hash & 1023U) * unit - 1.0;
  const double gy = static_cast<double>((hash >> 10U) & 1023U) * unit - 1.0;
  const double gz = static_cast<double>((hash >> 20U) & 1023U) * unit - 1.0;
  return gx * dx + gy * dy + gz * dz;
}

double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

std::int64_t wrap(std::int64_t i, std::int64_t period) {
  const std::int64_t r = i % period;
  return r < 0 ? r + period : r;
}

}  // namespace

SampleSource::SampleSource(const std::string& name, const std::string& title,
                           const SampleSize& size, int formula_version, std::string time_units) {
  info_.time_units = std::move(time_units);
  info_.id = name;
  info_.title = title;
  info_.source = "built-in sample";
  info_.format = "sample";
  info_.digest = "sample:" + name + ":" + std::to_string(size.dims[0]) + "x" +
                 std::to_string(size.dims[1]) + "x" + std::to_string(size.dims[2]) + ":" +
                 std::to_string(size.steps) + ":v" + std::to_string(formula_version);
}

Result<Volume> SampleSource::read(std::size_t field, std::size_t step) {
  return computed(field, step, whole_box(info_.grid.dims()));
}

Result<Volume> SampleSource::read_part(std::size_t field, std::size_t step,
                                       const StoredPart& part) {
  if (auto fine = check_part(field, part); !fine) return fine.error();
  if (!info_.fields.at(field).is_read_by_boxes()) return Source::read_part(field, step, part);
  return computed(field, step, part.box);
}

Volume SampleSource::computed(std::size_t field, std::size_t step, const Box& box) {
  WINDSPLAT_CHECK(field < info_.fields.size() && step < info_.steps.size());
  Volume volume;
  volume.dims = box.count;
  volume.components = static_cast<int>(info_.fields[field].components.size());
  volume.values = Samples(volume.samples() * static_cast<std::size_t>(volume.components));
  fill(field, step, box, volume);
  finish_volume(volume);
  return volume;
}

Axis sample_axis(std::string name, std::string standard_name, std::string units, AxisKind kind,
                 std::vector<double> coordinates) {
  Axis axis;
  axis.name = std::move(name);
  axis.standard_name = std::move(standard_name);
  axis.units = std::move(units);
  axis.kind = kind;
  axis.coordinates = std::move(coordinates);
  return axis;
}

std::array<Axis, 3> sample_box(const std::array<int, 3>& dims, const std::array<double, 3>& low_m,
                               const std::array<double, 3>& high_m) {
  const auto make = [&](const char* name, std::size_t a) {
    return sample_axis(name, "", "m", AxisKind::cartesian,
                       cell_centres(low_m[a], high_m[a], dims[a]));
  };
  return {make("x", 0), make("y", 1), make("z", 2)};
}

FieldInfo sample_scalar(const std::string& name, const std::string& units,
                        const std::string& standard_name, const std::string& long_name) {
  FieldInfo info;
  info.name = name;
  info.kind = FieldKind::scalar;
  info.components = {name};
  info.units = units;
  info.component_units = {units};
  info.standard_name = standard_name;
  info.long_name = long_name;
  info.dtype = "float32";
  return info;
}

FieldInfo sample_vector(const std::string& name, std::vector<std::string> components,
                        const std::string& units, const std::string& long_name) {
  FieldInfo info;
  info.name = name;
  info.kind = FieldKind::vector;
  info.components = std::move(components);
  info.units = units;
  info.component_units.assign(info.components.size(), units);
  info.long_name = long_name;
  info.dtype = "float32";
  return info;
}

std::vector<double> cell_centres(double low, double high, int count) {
  std::vector<double> centres(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    centres[static_cast<std::size_t>(i)] = low + (high - low) * (i + 0.5) / count;
  }
  return centres;
}

double smooth_step(double low, double high, double value) {
  const double t = clamp_unit((value - low) / (high - low));
  return t * t * (3.0 - 2.0 * t);
}

double clamp_unit(double value) { return std::min(1.0, std::max(0.0, value)); }

double gradient_noise(double x, double y, double z, std::int64_t period_x, std::uint32_t seed) {
  const double floor_x = std::floor(x);
  const double floor_y = std::floor(y);
  const double floor_z = std::floor(z);
  const double dx = x - floor_x;
  const double dy = y - floor_y;
  const double dz = z - floor_z;
  const double fx = fade(dx);
  const double fy = fade(dy);
  const auto ix = static_cast<std::int64_t>(floor_x);
  const std::array<std::uint32_t, 2> hash_x = {
      mix(seed, static_cast<std::uint32_t>(wrap(ix, period_x))),
      mix(seed, static_cast<std::uint32_t>(wrap(ix + 1, period_x)))};
  const auto iy = static_cast<std::int64_t>(floor_y);
  const auto iz = static_cast<std::int64_t>(floor_z);
  std::array<double, 2> layer{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto lattice_z = static_cast<std::uint32_t>(iz + static_cast<std::int64_t>(k));
    const double oz = dz - static_cast<double>(k);
    std::array<double, 2> row{};
    for (std::size_t j = 0; j < 2; ++j) {
      const auto lattice_y = static_cast<std::uint32_t>(iy + static_cast<std::int64_t>(j));
      const double oy = dy - static_cast<double>(j);
      const double left = corner(mix(mix(hash_x[0], lattice_y), lattice_z), dx, oy, oz);
      const double right = corner(mix(mix(hash_x[1], lattice_y), lattice_z), dx - 1.0, oy, oz);
      row[j] = left + fx * (right - left);
    }
    layer[k] = row[0] + fy * (row[1] - row[0]);
  }
  return layer[0] + fade(dz) * (layer[1] - layer[0]);
}

double fractal_noise(double x, double y, double z, std::int64_t period_x, int octaves,
                     std::uint32_t seed) {
  double sum = 0;
  double strength = 1;
  for (int octave = 0; octave < octaves; ++octave) {
    sum += strength * gradient_noise(x, y, z, period_x, seed + static_cast<std::uint32_t>(octave));
    x *= 2;
    y *= 2;
    z *= 2;
    period_x *= 2;
    strength *= 0.5;
  }
  // The typical amplitude of one octave is about 0.5, and the strengths add up to at most 2.
  return sum * 1.25;
}

}  // namespace windsplat::data
