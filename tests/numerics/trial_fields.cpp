// Formulas of the trial fields. Noise is interpolated between hashed lattice values, in octaves.
#include "tests/numerics/trial_fields.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>

#include "server/base/pcg3d.hpp"

namespace windsplat::test {

// Uniform in [-1, 1).
double hashed(int i, int j, int k, std::uint32_t salt) {
  const auto bits = pcg3d({static_cast<std::uint32_t>(i) * 3U + salt,
                           static_cast<std::uint32_t>(j) * 5U + 7919U * salt,
                           static_cast<std::uint32_t>(k) * 7U + 104729U * salt});
  return bits[0] / 2147483648.0 - 1;
}

double noise(const Point& at, int cells, std::uint32_t salt) {
  std::array<int, 3> low{};
  Point f{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double place = at[a] * cells;
    low[a] = static_cast<int>(place);
    f[a] = place - low[a];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1;
    const int dy = corner >> 1 & 1;
    const int dz = corner >> 2;
    const double w =
        (dx != 0 ? f[0] : 1 - f[0]) * (dy != 0 ? f[1] : 1 - f[1]) * (dz != 0 ? f[2] : 1 - f[2]);
    sum += w * hashed(low[0] + dx, low[1] + dy, low[2] + dz, salt);
  }
  return sum;
}

double turbulence(const Point& at, int finest, double decay, std::uint32_t salt) {
  double sum = 0;
  double amplitude = 1;
  for (int cells = 2; cells <= finest; cells *= 2, amplitude *= decay) {
    sum += amplitude * noise(at, cells, salt + static_cast<std::uint32_t>(cells));
  }
  return sum;
}

namespace {

constexpr double two_pi = 6.283185307179586;
constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

Values turbulent(const Point& at, int finest, double decay) {
  Values out;
  for (std::uint32_t c = 0; c < 3; ++c) {
    out.flow[c] = 10 * turbulence(at, finest, decay, 100 * c + 1);
  }
  out.cloud = std::clamp(0.3 + turbulence(at, finest, decay, 900), 0.0, 1.0);
  return out;
}

Values white_noise(const std::array<int, 3>& i) {
  Values out;
  for (std::uint32_t c = 0; c < 3; ++c) out.flow[c] = 10 * hashed(i[0], i[1], i[2], c);
  out.cloud = 0.5 + 0.5 * hashed(i[0], i[1], i[2], 5);
  return out;
}

// Thirty vortices about the vertical, of radii from a hundredth to a tenth of the box; still air
// between them.
Values vortices(const Point& at) {
  Values out;
  for (int n = 0; n < 30; ++n) {
    const double x = at[0] - (0.5 + 0.45 * hashed(n, 0, 0, 11));
    const double y = at[1] - (0.5 + 0.45 * hashed(n, 0, 0, 12));
    const double radius = 0.01 * std::pow(10, 0.5 + 0.5 * hashed(n, 0, 0, 13));
    const double fall = std::exp(-(x * x + y * y) / (radius * radius));
    if (fall < 1e-4) continue;
    out.flow[0] -= 60 * y / radius * fall;
    out.flow[1] += 60 * x / radius * fall;
    out.flow[2] += 5 * fall;
    out.cloud += fall;
  }
  out.cloud = std::min(out.cloud, 1.0);
  return out;
}

// The direction of the wind of each layer is independent of that of its neighbours.
Values shear_layers(const Point& at, const std::array<int, 3>& index) {
  const double bearing = two_pi * hashed(0, 0, index[2], 21);
  const double speed = 8 + 4 * noise(at, 16, 22);
  Values out;
  out.flow = {speed * std::sin(bearing), speed * std::cos(bearing),
              0.05 * hashed(index[0], index[1], index[2], 23)};
  out.cloud = hashed(0, 0, index[2], 24) > 0.6 ? 0.5 + 0.5 * noise(at, 32, 25) : 0;
  return out;
}

// Concentric shells, outflow and inflow in turn.
Values shells(const Point& at) {
  const Point from{at[0] - 0.5, at[1] - 0.5, at[2] - 0.5};
  const double r = std::hypot(from[0], from[1], from[2]) + 1e-9;
  const double wave = std::sin(two_pi * 20 * r);
  Values out;
  for (std::size_t c = 0; c < 3; ++c) out.flow[c] = 10 * wave * from[c] / r;
  out.cloud = wave > 0.7 ? 1 : 0;
  return out;
}

Values front(const Point& at) {
  const double across = at[0] - 0.5 - 0.1 * std::sin(two_pi * at[1]);
  const double side = std::tanh(across / 0.008);
  Values out;
  out.flow = {6 * side, 8, 2 * (1 - side * side)};
  out.cloud = (1 - side * side) * (0.6 + 0.4 * noise(at, 48, 31));
  return out;
}

// A rising helix of smoke; masked outside of its box of influence.
Values plume(const Point& at) {
  const double turn = two_pi * 3 * at[2];
  const double x = at[0] - 0.5 - 0.2 * at[2] * std::cos(turn);
  const double y = at[1] - 0.5 - 0.2 * at[2] * std::sin(turn);
  const double width = 0.02 + 0.08 * at[2];
  const double core = std::exp(-(x * x + y * y) / (width * width));
  Values out;
  if (core < 1e-3) return {{no_value, no_value, no_value}, no_value};
  const double eddies = 1 + 0.8 * turbulence(at, 64, 0.7, 41);
  out.flow = {-20 * y * eddies, 20 * x * eddies, 6 * core * eddies};
  out.cloud = std::clamp(core * eddies, 0.0, 1.0);
  return out;
}

TrialFormula formula_of(const std::string& name) {
  if (name.starts_with("white noise")) {
    return [](const Point&, const std::array<int, 3>& i) { return white_noise(i); };
  }
  if (name.starts_with("steep turbulence")) {
    return [](const Point& at, const std::array<int, 3>&) { return turbulent(at, 64, 0.5); };
  }
  if (name.starts_with("turbulence")) {
    return [](const Point& at, const std::array<int, 3>&) { return turbulent(at, 64, 0.8); };
  }
  if (name.starts_with("vortices")) {
    return [](const Point& at, const std::array<int, 3>&) { return vortices(at); };
  }
  if (name.starts_with("shear layers")) return shear_layers;
  if (name.starts_with("shells")) {
    return [](const Point& at, const std::array<int, 3>&) { return shells(at); };
  }
  if (name.starts_with("front")) {
    return [](const Point& at, const std::array<int, 3>&) { return front(at); };
  }
  return [](const Point& at, const std::array<int, 3>&) { return plume(at); };
}

class TrialSource final : public data::Source {
 public:
  TrialSource(const TrialField& field, TrialFormula formula) : formula_(std::move(formula)) {
    info_.id = info_.title = info_.digest = field.name;
    info_.source = "formula";
    info_.format = "trial";
    for (std::size_t a = 0; a < 3; ++a) {
      data::Axis& axis = info_.grid.axes[a];
      axis.name = std::string(1, "xyz"[a]);
      axis.units = "";  // proportions are kept, also those of sheets
      axis.kind = data::AxisKind::cartesian;
      for (int i = 0; i < field.dims[a]; ++i) {
        axis.coordinates.push_back((i + 0.5) / field.dims[a] * field.extent_m[a]);
      }
    }
    info_.fields = {described("flow", {"u", "v", "w"}, "m s-1"),
                    described("cloud", {"cloud"}, "1")};
    if (field.terrain) info_.fields.push_back(described("height", {"height"}, "m"));
    info_.steps = {{0.0, "0"}};
  }

  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }

  Result<data::Volume> read(std::size_t field, std::size_t /*step*/) override {
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = field == 0 ? 3 : 1;
    const std::size_t samples = volume.samples();
    volume.values = data::Samples(samples * static_cast<std::size_t>(volume.components));
    std::size_t n = 0;
    std::array<int, 3> i{};
    for (i[2] = 0; i[2] < volume.dims[2]; ++i[2]) {
      for (i[1] = 0; i[1] < volume.dims[1]; ++i[1]) {
        for (i[0] = 0; i[0] < volume.dims[0]; ++i[0], ++n) {
          Point at{};
          for (std::size_t a = 0; a < 3; ++a) at[a] = (i[a] + 0.5) / volume.dims[a];
          const Values values = formula_(at, i);
          if (field == 1) volume.values[n] = static_cast<float>(values.cloud);
          if (field == 2) volume.values[n] = static_cast<float>(values.height);
          for (std::size_t c = 0; field == 0 && c < 3; ++c) {
            volume.values[c * samples + n] = static_cast<float>(values.flow[c]);
          }
        }
      }
    }
    data::finish_volume(volume);
    return volume;
  }

 private:
  static data::FieldInfo described(const std::string& name, std::vector<std::string> components,
                                   const std::string& units) {
    data::FieldInfo info;
    info.name = name;
    info.kind = components.size() > 1 ? data::FieldKind::vector : data::FieldKind::scalar;
    info.component_units.assign(components.size(), units);
    info.components = std::move(components);
    info.units = units;
    info.dtype = "float32";
    return info;
  }

  TrialFormula formula_;
  data::DatasetInfo info_;
};

}  // namespace

const std::vector<TrialField>& trial_fields() {
  static const std::vector<TrialField> fields{
      {"white noise", {80, 80, 80}, {1e3, 1e3, 1e3}},
      {"turbulence", {96, 96, 96}, {1e3, 1e3, 1e3}},
      {"turbulence in a shallow box", {128, 128, 48}, {1e5, 1e5, 2e3}},
      {"steep turbulence", {96, 96, 96}, {1e3, 1e3, 1e3}},
      {"vortices", {128, 128, 40}, {4e3, 4e3, 2e3}},
      {"shear layers in a shallow box", {128, 128, 64}, {1e5, 1e5, 2e3}},
      {"shells", {96, 96, 96}, {1e3, 1e3, 1e3}},
      {"front", {128, 96, 32}, {2e5, 1e5, 1e4}},
      {"plume", {80, 80, 160}, {1e3, 1e3, 2e3}},
      {"turbulence in a column", {48, 48, 384}, {800, 800, 4e3}},
  };
  return fields;
}

std::unique_ptr<data::Dataset> formula_dataset(const TrialField& field, TrialFormula formula) {
  return std::make_unique<data::Dataset>(std::make_unique<TrialSource>(field, std::move(formula)),
                                         "trial", std::uint64_t{1} << 30U);
}

std::unique_ptr<data::Dataset> trial_dataset(const TrialField& field) {
  return formula_dataset(field, formula_of(field.name));
}

}  // namespace windsplat::test
