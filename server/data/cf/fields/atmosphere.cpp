// Layers of constant lapse rate, from the ground upwards.
#include "server/data/cf/fields/atmosphere.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace windsplat::data::cf {

namespace {

constexpr double layer_gas_constant = 287.05287;  // name in the standard

struct Layer {
  double height;       // height of the base, geopotential metres
  double temperature;  // at the base, K
  double lapse;        // K per metre upwards
  double pressure;     // at the base, Pa
};

constexpr double sea_level_pressure = 101325.0;

// Pressure at a height above a layer's base.
double pressure_at(const Layer& layer, double height) {
  const double rise = height - layer.height;
  if (layer.lapse == 0) {
    return layer.pressure *
           std::exp(-standard_gravity * rise / (layer_gas_constant * layer.temperature));
  }
  return layer.pressure * std::pow(1 + layer.lapse * rise / layer.temperature,
                                   -standard_gravity / (layer_gas_constant * layer.lapse));
}

std::array<Layer, 7> make_layers() {
  std::array<Layer, 7> layers{{{0, 288.15, -0.0065, sea_level_pressure},
                               {11000, 216.65, 0, 0},
                               {20000, 216.65, 0.001, 0},
                               {32000, 228.65, 0.0028, 0},
                               {47000, 270.65, 0, 0},
                               {51000, 270.65, -0.0028, 0},
                               {71000, 214.65, -0.002, 0}}};
  for (std::size_t n = 1; n < layers.size(); ++n) {
    layers.at(n).pressure = pressure_at(layers.at(n - 1), layers.at(n).height);
  }
  return layers;
}

const Layer& layer_at(double pascals) {
  static const std::array<Layer, 7> layers = make_layers();
  std::size_t n = 0;
  while (n + 1 < layers.size() && pascals < layers.at(n + 1).pressure) ++n;
  return layers.at(n);
}

}  // namespace

double standard_height(double pascals) {
  if (!(pascals > 0)) return std::numeric_limits<double>::quiet_NaN();
  const Layer& layer = layer_at(pascals);
  const double ratio = std::log(pascals / layer.pressure);
  if (layer.lapse == 0) {
    return layer.height - layer_gas_constant * layer.temperature / standard_gravity * ratio;
  }
  const double exponent = -layer_gas_constant * layer.lapse / standard_gravity;
  return layer.height + layer.temperature / layer.lapse * std::expm1(exponent * ratio);
}

double standard_temperature(double pascals) {
  if (!(pascals > 0)) return std::numeric_limits<double>::quiet_NaN();
  const Layer& layer = layer_at(pascals);
  return layer.temperature + layer.lapse * (standard_height(pascals) - layer.height);
}

}  // namespace windsplat::data::cf
