// Common parts of the built-in samples: sizes, the base class of a Source that computes its
// numbers, and the functions used by their formulas. Formula -> SampleSource::fill -> Volume.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data {

struct SampleSize {
  std::array<int, 3> dims{};
  int steps = 1;
};

inline constexpr SampleSize tornado_size{{64, 64, 64}, 12};
inline constexpr SampleSize climate_size{{320, 160, 19}, 8};
inline constexpr SampleSize efield_size{{64, 26, 32}, 16};

std::unique_ptr<Source> make_tornado(const SampleSize& size);
std::unique_ptr<Source> make_climate(const SampleSize& size);
std::unique_ptr<Source> make_efield(const SampleSize& size);

// A source whose fields are computed on request, independent of each other.
class SampleSource : public Source {
 public:
  [[nodiscard]] const DatasetInfo& info() const override { return info_; }
  Result<Volume> read(std::size_t field, std::size_t step) override;
  Result<Volume> read_part(std::size_t field, std::size_t step, const StoredPart& part) override;

 protected:
  // `formula_version` is part of the digest: increment it whenever a formula changes.
  SampleSource(const std::string& name, const std::string& title, const SampleSize& size,
               int formula_version, std::string time_units);

  // Computes the samples of a box: of the whole, unless the field is read by boxes
  // (FieldInfo::box_chunk). `volume` has the dimensions of the box and its components set and its
  // values zeroed; finish_volume() is called afterwards.
  virtual void fill(std::size_t field, std::size_t step, const Box& box, Volume& volume) = 0;

  DatasetInfo info_;

 private:
  Volume computed(std::size_t field, std::size_t step, const Box& box);
};

Axis sample_axis(std::string name, std::string standard_name, std::string units, AxisKind kind,
                 std::vector<double> coordinates);

// x, y, z in metres, each a uniform axis of cell centres.
std::array<Axis, 3> sample_box(const std::array<int, 3>& dims, const std::array<double, 3>& low_m,
                               const std::array<double, 3>& high_m);

// A float32 field. `standard_name` is the CF name of a scalar, empty if there is none.
FieldInfo sample_scalar(const std::string& name, const std::string& units,
                        const std::string& standard_name, const std::string& long_name);
FieldInfo sample_vector(const std::string& name, std::vector<std::string> components,
                        const std::string& units, const std::string& long_name);

// Centres of `count` equal cells that fill [low, high].
std::vector<double> cell_centres(double low, double high, int count);

// 0 below `low`, 1 above `high`, between them a cubic with zero slope at both ends.
double smooth_step(double low, double high, double value);

double clamp_unit(double value);  // clamps to [0, 1]

// Gradient noise (after Perlin 1985, 2002) on the integer lattice; periodic in x with `period_x`.
// Zero at lattice points, continuous with its first two derivatives, about [-0.7, 0.7].
// Deterministic: the gradients are a hash of (lattice point, seed).
double gradient_noise(double x, double y, double z, std::int64_t period_x, std::uint32_t seed);

// `octaves` of gradient noise, each at twice the frequency and half the amplitude, scaled to about
// [-1, 1].
double fractal_noise(double x, double y, double z, std::int64_t period_x, int octaves,
                     std::uint32_t seed);

}  // namespace windsplat::data
