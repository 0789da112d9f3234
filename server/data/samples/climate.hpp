// Horizontal maps of which the sample "climate" is composed: one value per column of the grid, at
// one time. Longitude varies fastest. climate.cpp multiplies them by vertical profiles.
#pragma once

#include <array>
#include <cmath>
#include <vector>

namespace windsplat::data::climate {

using Map = std::vector<float>;

inline double bump(double x) { return std::exp(-x * x); }

// Column positions, degrees.
struct Columns {
  std::vector<double> longitudes;
  std::vector<double> latitudes;
  [[nodiscard]] std::size_t count() const { return longitudes.size() * latitudes.size(); }
};

// A round low or high, which drifts with the mean flow.
struct Vortex {
  double longitude;  // degrees, of the centre
  double latitude;
  double radius;      // degrees of arc from the centre to the fastest wind
  double speed;       // m/s, the fastest wind
  double spin;        // +1 counter-clockwise seen from above, -1 clockwise
  double hemisphere;  // +1 north, -1 south
  bool cyclone;       // a low: carries fronts
};

// The cyclones and the anticyclones between them, at a time in hours.
std::vector<Vortex> vortices(double hours);

// m/s, except lift: -1..1, a factor of the profile of w.
struct WindMaps {
  Map jet_u, jet_v;    // at the level of the jets
  Map low_u, low_v;    // vortices near the ground, without friction
  Map high_u, high_v;  // vortices aloft
  Map lift;
  // About 1: small-scale variation of the wind, as streaks along the flow. Levels alternate between
  // the two maps.
  std::array<Map, 3> threads;
};
WindMaps wind_maps(const Columns& columns, double hours);

// Coverage including texture: there is cloud where it exceeds the threshold of the profile.
struct CloudMaps {
  Map low, middle, high, deep;
};
CloudMaps cloud_maps(const Columns& columns, double hours);

}  // namespace windsplat::data::climate
