// The sample "efield": the electric field in and around a small metal cabin with a window, excited
// by a plane wave; an approximate analytic model, not a solution of Maxwell's equations. Surface
// sums over the front wall and the window -> phasor E -> Re(E exp(-i w t)) at each step.
//
// Lengths are in metres; the wave travels towards +x and is polarised along z, 600 MHz, 100 V/m.
// k = w / c.
// Outside: incident wave + physical optics. The front wall W carries the current of an infinite
//   mirror, J = 2 n x H; with P_S = Int_S exp(ikR) / (2 pi R) dS, R^2 = r^2 + (half a wall)^2,
//     E_W = (i / k) (k^2 P_W z + grad dP_W/dz),    for an infinite wall -z exp(ik|x|),
//   which yields the standing wave in front and the shadow behind. The part E_A due to the current
//   in the window is subtracted in front of the wall, and faded in again along the sides of the
//   cabin.
// Inside: the field of an aperture A in a conducting plane with the incident field in it (Smythe's
//   form of Kirchhoff's integral), F = Int_A exp(ikR) / (2 pi R) dS:
//     E = curl(0, -F, 0) = (dF/dz, 0, -dF/dx),     divergence-free, tangential E = 0 beside A
//   plus its mirror images in the side, floor, ceiling and back walls (one reflection each, F odd
//   in y, even in z and x, as required at a conductor), each attenuated by a lossy lining. The
//   static part of grad F has a closed form, the solid angle of the window and logarithms; the
//   rest is summed numerically.
// In the walls both fields are evanescent: they decay as exp(-depth / skin).
// Energy: (epsilon_0 / 2) |E|^2 at the time of the step.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "server/data/samples/source.hpp"

namespace windsplat::data {

namespace {

using Complex = std::complex<double>;
using Vector = std::array<Complex, 3>;

constexpr int efield_version = 1;
constexpr double pi = std::numbers::pi;
constexpr double light_speed = 299792458.0;     // m/s
constexpr double epsilon_0 = 8.8541878128e-12;  // F/m
constexpr double frequency_hz = 600e6;
constexpr double wave_number = 2.0 * pi * frequency_hz / light_speed;
constexpr double amplitude = 100.0;  // V/m
constexpr double bounce = 0.8;       // amplitude retained at a reflection inside
constexpr double wall_m = 0.07;
constexpr double skin_m = 0.015;
constexpr double element_m = 0.0625;  // step of the sums: an eighth of the wavelength

struct Rectangle {
  double y0, y1, z0, z1;
};

// The inner faces of the cabin; the walls are outside them. The current of the front wall and the
// window are in its outer face.
constexpr double front_x = -0.45;
constexpr double back_x = 0.75;
constexpr double face_x = front_x - wall_m;
constexpr double side_y = 0.50;
constexpr double side_z = 0.45;
constexpr Rectangle window = {-0.36, 0.36, -0.24, 0.34};
constexpr Rectangle front_wall = {-side_y - wall_m, side_y + wall_m, -side_z - wall_m,
                                  side_z + wall_m};

struct Element {
  double y, z;
  double weight;  // area, or length for an edge
};

std::vector<Element> surface_elements(const Rectangle& r) {
  const int ny = static_cast<int>(std::ceil((r.y1 - r.y0) / element_m));
  const int nz = static_cast<int>(std::ceil((r.z1 - r.z0) / element_m));
  const double area = (r.y1 - r.y0) / ny * (r.z1 - r.z0) / nz;
  std::vector<Element> elements;
  for (const double z : cell_centres(r.z0, r.z1, nz)) {
    for (const double y : cell_centres(r.y0, r.y1, ny)) elements.push_back({y, z, area});
  }
  return elements;
}

// d/dz of a surface integral is the difference of the integrals along the edges z0 and z1.
std::vector<Element> edge_elements(const Rectangle& r) {
  const int ny = static_cast<int>(std::ceil((r.y1 - r.y0) / (0.5 * element_m)));
  const double length = (r.y1 - r.y0) / ny;
  std::vector<Element> elements;
  for (const double y : cell_centres(r.y0, r.y1, ny)) {
    elements.push_back({y, r.z0, length});
    elements.push_back({y, r.z1, -length});
  }
  return elements;
}

// A tabulated function of R, interpolated linearly with a relative error of 1e-5 at this spacing.
class RadialTable {
 public:
  template <class Function>
  RadialTable(double reach_m, const Function& function) {
    constexpr double spacing_m = 1.0 / 1024.0;
    const auto count = static_cast<std::size_t>(reach_m / spacing_m) + 2;
    values_.reserve(count);
    for (std::size_t n = 0; n < count; ++n) {
      values_.push_back(function(std::max(static_cast<double>(n), 0.5) * spacing_m));
    }
  }
  [[nodiscard]] Complex operator()(double r_m) const {
    const double place = r_m * 1024.0;
    const auto n = std::min(static_cast<std::size_t>(place), values_.size() - 2);
    return values_[n] + (place - static_cast<double>(n)) * (values_[n + 1] - values_[n]);
  }

 private:
  std::vector<Complex> values_;
};

constexpr double reach_m = 8.0;  // beyond the largest distance from any image of the window

Complex wave(double r) { return {std::cos(wave_number * r), std::sin(wave_number * r)}; }

struct Tables {
  // G = exp(ikR) / (2 pi R) and G'(R) / R.
  RadialTable green{reach_m, [](double r) { return wave(r) / (2.0 * pi * r); }};
  RadialTable green_slope{
      reach_m,
      [](double r) { return wave(r) * Complex(-1.0, wave_number * r) / (2.0 * pi * r * r * r); }};
  // g = (exp(ikR) - 1) / (2 pi R): g'(R) / R, bounded except for 1 / R at the origin.
  RadialTable remainder_slope{reach_m, [](double r) {
                                const Complex e = wave(r);
                                return (Complex(0, wave_number * r) * e - (e - 1.0)) /
                                       (2.0 * pi * r * r * r);
                              }};
};

// Currents on a rectangle in the plane of the front wall.
struct Plate {
  std::vector<Element> surface;
  std::vector<Element> edges;
  explicit Plate(const Rectangle& r) : surface(surface_elements(r)), edges(edge_elements(r)) {}
};

// E of the mirror current on a plate, for an incident wave of 1 at the plate. x is measured from
// the plate.
Vector plate_field(const Plate& plate, const Tables& tables, double x, double y, double z) {
  constexpr double soft2 = 0.25 * wall_m * wall_m;
  Complex potential = 0;
  for (const Element& e : plate.surface) {
    const double r2 = x * x + (y - e.y) * (y - e.y) + (z - e.z) * (z - e.z);
    potential += e.weight * tables.green(std::sqrt(r2 + soft2));
  }
  Vector gradient{};
  for (const Element& e : plate.edges) {
    const double dy = y - e.y;
    const double dz = z - e.z;
    const Complex slope =
        e.weight * tables.green_slope(std::sqrt(x * x + dy * dy + dz * dz + soft2));
    gradient[0] += slope * x;
    gradient[1] += slope * dy;
    gradient[2] += slope * dz;
  }
  const Complex factor(0, 1.0 / wave_number);
  return {factor * gradient[0], factor * gradient[1],
          factor * (wave_number * wave_number * potential + gradient[2])};
}

// (dF/dx, dF/dz) of a window in the plane x = 0.
std::array<Complex, 2> window_gradient(const Rectangle& r, const std::vector<Element>& elements,
                                       const Tables& tables, double x, double y, double z) {
  Complex along_x = 0;
  Complex along_z = 0;
  for (const Element& e : elements) {
    const double dy = y - e.y;
    const double dz = z - e.z;
    const Complex slope = e.weight * tables.remainder_slope(std::sqrt(x * x + dy * dy + dz * dz));
    along_x += slope * x;
    along_z += slope * dz;
  }
  // The static part of -dF/dx is the solid angle over 2 pi, that of dF/dz the difference of the
  // potentials of the two edges.
  const auto angle = [&](double u, double v) {
    return std::atan2(u * v, x * std::sqrt(u * u + v * v + x * x));
  };
  const double solid = angle(r.y1 - y, r.z1 - z) - angle(r.y0 - y, r.z1 - z) -
                       angle(r.y1 - y, r.z0 - z) + angle(r.y0 - y, r.z0 - z);
  const auto edge = [&](double v) {
    const double away = std::max(std::hypot(x, v), 0.25 * wall_m);
    return std::asinh((r.y1 - y) / away) - std::asinh((r.y0 - y) / away);
  };
  along_x -= solid / (2.0 * pi);
  along_z += (edge(z - r.z0) - edge(z - r.z1)) / (2.0 * pi);
  return {along_x, along_z};
}

// The interval [low, high] after n reflections at the walls +-half.
std::array<double, 2> mirrored(double low, double high, int n, double half) {
  if (n == 0) return {low, high};
  return {2.0 * n * half - high, 2.0 * n * half - low};
}

struct WindowImage {
  Rectangle rectangle;
  std::vector<Element> elements;
  double weight;
};

std::vector<WindowImage> window_images() {
  std::vector<WindowImage> images;
  for (int nz = -1; nz <= 1; ++nz) {
    for (int ny = -1; ny <= 1; ++ny) {
      const auto y = mirrored(window.y0, window.y1, ny, side_y);
      const auto z = mirrored(window.z0, window.z1, nz, side_z);
      const Rectangle rectangle = {y[0], y[1], z[0], z[1]};
      const double weight = (ny == 0 ? 1.0 : -bounce) * (nz == 0 ? 1.0 : bounce);
      images.push_back({rectangle, surface_elements(rectangle), weight});
    }
  }
  return images;
}

Vector cabin_field(const std::vector<WindowImage>& images, const Tables& tables, double x, double y,
                   double z) {
  Vector field{};
  const double depth = std::max(x - face_x, 1e-4);
  const double from_back = 2.0 * (back_x - face_x) - depth;
  for (const WindowImage& image : images) {
    const auto direct = window_gradient(image.rectangle, image.elements, tables, depth, y, z);
    const auto echo = window_gradient(image.rectangle, image.elements, tables, from_back, y, z);
    field[0] += image.weight * (direct[1] + bounce * echo[1]);
    field[2] -= image.weight * (direct[0] - bounce * echo[0]);
  }
  return field;
}

// Distance outside the box of the inner faces of the cabin widened by `margin`; negative inside.
double outside_m(double x, double y, double z, double margin) {
  return std::max({front_x - margin - x, x - back_x - margin, std::abs(y) - side_y - margin,
                   std::abs(z) - side_z - margin});
}

bool in_window_opening(double x, double y, double z) {
  return x >= face_x && x <= front_x && y > window.y0 && y < window.y1 && z > window.z0 &&
         z < window.z1;
}

class CabinField {
 public:
  CabinField() : images_(window_images()) {}

  // The phasor at a point, in units of the amplitude of the incident wave.
  [[nodiscard]] Vector at(double x, double y, double z) const {
    const double beyond_inner = outside_m(x, y, z, 0);
    if (beyond_inner <= 0 || in_window_opening(x, y, z)) return inside(x, y, z);
    const double beyond_outer = outside_m(x, y, z, wall_m);
    if (beyond_outer >= 0) return outside(x, y, z);
    const double from_inside = std::exp(-beyond_inner / skin_m);
    const double from_outside = std::exp(beyond_outer / skin_m);
    const Vector inner = inside(x, y, z);
    const Vector outer = outside(x, y, z);
    Vector field;
    for (std::size_t a = 0; a < 3; ++a) field[a] = from_inside * inner[a] + from_outside * outer[a];
    return field;
  }

 private:
  [[nodiscard]] Vector inside(double x, double y, double z) const {
    return cabin_field(images_, tables_, x, y, z);
  }

  [[nodiscard]] Vector outside(double x, double y, double z) const {
    const double from_wall = x - face_x;
    Vector field = plate_field(wall_, tables_, from_wall, y, z);
    const double open = smooth_step(0.5, 0.0, from_wall);
    if (open > 0) {
      const Vector opening = plate_field(window_, tables_, from_wall, y, z);
      for (std::size_t a = 0; a < 3; ++a) field[a] -= open * opening[a];
    }
    field[2] += wave(from_wall);
    return field;
  }

  Tables tables_;
  Plate wall_{front_wall};
  Plate window_{window};
  std::vector<WindowImage> images_;
};

class ElectricField final : public SampleSource {
 public:
  explicit ElectricField(const SampleSize& size)
      : SampleSource("efield", "Electric field about a cabin with a window", size, efield_version,
                     "ns") {
    info_.grid.axes = sample_box(size.dims, {-1.5, -0.61, -0.75}, {1.5, 0.61, 0.75});
    info_.fields = {sample_vector("E", {"Ex", "Ey", "Ez"}, "V m-1", "electric field"),
                    sample_scalar("energy", "J m-3", "", "electric energy density"),
                    sample_scalar("walls", "1", "", "1 in the cabin's metal, 0 elsewhere")};
    const double period_ns = 1e9 / frequency_hz;
    for (int i = 0; i < size.steps; ++i) {
      const double time_ns = period_ns * i / size.steps;
      std::array<char, 32> text{};
      std::snprintf(text.data(), text.size(), "%.4g ns", time_ns);
      info_.steps.push_back({time_ns, text.data()});
    }
  }

 private:
  void fill(std::size_t field, std::size_t step, const Box& /*whole*/, Volume& volume) override {
    if (field == 2) {
      fill_walls(volume);
      return;
    }
    if (phasor_.empty()) fill_phasor();
    const double angle =
        2.0 * pi * static_cast<double>(step) / static_cast<double>(info_.steps.size());
    const double real = amplitude * std::cos(angle);
    const double imaginary = amplitude * std::sin(angle);
    const std::size_t samples = volume.samples();
    for (std::size_t n = 0; n < samples; ++n) {
      double square = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const std::complex<float> value = phasor_[a * samples + n];
        const double now = static_cast<double>(value.real()) * real +
                           static_cast<double>(value.imag()) * imaginary;
        if (field == 0) volume.values[a * samples + n] = static_cast<float>(now);
        square += now * now;
      }
      if (field == 1) volume.values[n] = static_cast<float>(0.5 * epsilon_0 * square);
    }
  }

  // The phasor is expensive to compute, and the same for every step of both fields. Cabin, window
  // and wave are symmetric about y = 0, so one half is the mirror image of the other with the sign
  // of E_y reversed.
  void fill_phasor() {
    const CabinField cabin;
    const auto& axes = info_.grid.axes;
    const std::size_t nx = axes[0].coordinates.size();
    const std::size_t ny = axes[1].coordinates.size();
    const std::size_t samples = info_.grid.samples();
    phasor_.resize(3 * samples);
    for (std::size_t k = 0; k < axes[2].coordinates.size(); ++k) {
      for (std::size_t j = 0; j < ny - ny / 2; ++j) {
        for (std::size_t i = 0; i < nx; ++i) {
          const Vector value =
              cabin.at(axes[0].coordinates[i], axes[1].coordinates[j], axes[2].coordinates[k]);
          const std::size_t here = (k * ny + j) * nx + i;
          const std::size_t mirror = (k * ny + ny - 1 - j) * nx + i;
          for (std::size_t a = 0; a < 3; ++a) {
            const auto single = std::complex<float>(value[a]);
            phasor_[a * samples + mirror] = a == 1 ? -single : single;
            phasor_[a * samples + here] = single;
          }
        }
      }
    }
  }

  void fill_walls(Volume& volume) const {
    const auto& axes = info_.grid.axes;
    float* out = volume.values.data();
    for (const double z : axes[2].coordinates) {
      for (const double y : axes[1].coordinates) {
        for (const double x : axes[0].coordinates) {
          const bool metal = outside_m(x, y, z, 0) > 0 && outside_m(x, y, z, wall_m) < 0 &&
                             !in_window_opening(x, y, z);
          *out++ = metal ? 1.0F : 0.0F;
        }
      }
    }
  }

  std::vector<std::complex<float>> phasor_;  // x, y, z components as consecutive arrays
};

}  // namespace

std::unique_ptr<Source> make_efield(const SampleSize& size) {
  return std::make_unique<ElectricField>(size);
}

}  // namespace windsplat::data
