// Columns and time -> the horizontal maps of the sample "climate"; the formulas are in climate.cpp.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "server/data/samples/climate.hpp"
#include "server/data/samples/source.hpp"

namespace windsplat::data::climate {

namespace {

constexpr double degree = std::numbers::pi / 180.0;

double wrap_degrees(double angle) { return angle - 360.0 * std::floor((angle + 180.0) / 360.0); }

// Parameters of the storm track of a hemisphere.
struct Track {
  double hemisphere;
  int waves;             // number of cyclones around the globe
  double longitude;      // longitude of the first one at time 0
  double latitude;       // latitude of the track, towards the pole
  double drift;          // degrees east per hour
  double jet_latitude;   // towards the pole
  double jet_speed;      // m/s
  double jet_width;      // degrees
  double meander;        // degrees, with the cyclones
  double long_meander;   // degrees, with three stationary waves
  double jet_variation;  // relative variation of its speed along the latitude circle
};
constexpr std::array<Track, 2> tracks = {
    {{1.0, 6, -164.0, 49.0, 0.42, 34.0, 34.0, 9.0, 5.0, 4.0, 0.45},
     {-1.0, 7, -171.0, 52.0, 0.50, 40.0, 31.0, 9.0, 4.5, 3.0, 0.35}}};

constexpr double thread_strength = 0.70;
constexpr double tilt_degrees = 9.0;  // lows aloft are this far west of those at the ground
constexpr double spread_aloft = 1.35;

// Calls body(index, dx, dy) for every column within `reach` radii of a vortex; dx, dy are in radii.
template <class Body>
void near_vortex(const Columns& columns, const Vortex& vortex, double reach, const Body& body) {
  const double cosine = std::cos(vortex.latitude * degree);
  const std::size_t row = columns.longitudes.size();
  for (std::size_t j = 0; j < columns.latitudes.size(); ++j) {
    const double dy = (columns.latitudes[j] - vortex.latitude) / vortex.radius;
    if (std::abs(dy) > reach) continue;
    for (std::size_t i = 0; i < row; ++i) {
      const double dx =
          wrap_degrees(columns.longitudes[i] - vortex.longitude) * cosine / vortex.radius;
      if (dx * dx + dy * dy <= reach * reach) body(j * row + i, dx, dy);
    }
  }
}

void add_swirl(const Columns& columns, const Vortex& vortex, Map& u, Map& v) {
  near_vortex(columns, vortex, 3.5, [&](std::size_t index, double dx, double dy) {
    const double rate = vortex.spin * vortex.speed * std::exp(0.5 * (1.0 - dx * dx - dy * dy));
    u[index] += static_cast<float>(-rate * dy);
    v[index] += static_cast<float>(rate * dx);
  });
}

// Proximity of a column to the front of a cyclone, 0..1: a log spiral with a sharp rear edge and a
// diffuse leading edge.
double front(double dx, double dy_poleward) {
  constexpr double angle_at_radius = 0.45;  // a
  constexpr double winding = 2.1;           // b
  const double r = std::sqrt(dx * dx + dy_poleward * dy_poleward);
  if (r < 1e-6) return 0.6;
  const double spiral = angle_at_radius - winding * std::log(r);
  const double ahead = std::remainder(std::atan2(dy_poleward, dx) - spiral, 2.0 * std::numbers::pi);
  const double width = (0.34 + 0.10 * r) / std::max(r, 0.45);
  const double across = ahead > 0 ? ahead / (1.9 * width) : ahead / (0.7 * width);
  return bump(across) * smooth_step(4.2, 2.2, r) * smooth_step(-0.1, 0.3, r);
}

// A displacement of columns as two maps, degrees.
struct Displacement {
  Map longitude, latitude;
};

// The fronts of the cyclones, 0..1; `ragged` displaces each column before the spiral is evaluated.
Map front_map(const Columns& columns, const std::vector<Vortex>& all, const Displacement* ragged) {
  Map map(columns.count(), 0.0F);
  for (const Vortex& vortex : all) {
    if (!vortex.cyclone) continue;
    near_vortex(columns, vortex, 4.3, [&](std::size_t index, double dx, double dy) {
      if (ragged != nullptr) {
        dx += static_cast<double>(ragged->longitude[index]) / vortex.radius;
        dy += static_cast<double>(ragged->latitude[index]) / vortex.radius;
      }
      const auto value = static_cast<float>(front(dx, dy * vortex.hemisphere));
      map[index] = std::max(map[index], value);
    });
  }
  return map;
}

double convergence_latitude(double longitude, double hours) {
  return -2.0 + 5.0 * std::sin((2.0 * longitude + 40.0) * degree) +
         1.6 * std::sin((5.0 * longitude + 1.5 * hours) * degree);
}

// Displacement of the texture by the flow: each cyclone winds up the air around its centre; gives
// the origin of the air of a column, relative to the column.
Displacement winding(const Columns& columns, const std::vector<Vortex>& all) {
  Displacement map{Map(columns.count(), 0.0F), Map(columns.count(), 0.0F)};
  for (const Vortex& vortex : all) {
    if (!vortex.cyclone) continue;
    const double cosine = std::cos(vortex.latitude * degree);
    near_vortex(columns, vortex, 3.0, [&](std::size_t index, double dx, double dy) {
      const double turn = -vortex.spin * 3.2 * std::exp(-0.8 * (dx * dx + dy * dy));
      const double from_x = std::cos(turn) * dx - std::sin(turn) * dy;
      const double from_y = std::sin(turn) * dx + std::cos(turn) * dy;
      map.longitude[index] += static_cast<float>((from_x - dx) * vortex.radius / cosine);
      map.latitude[index] += static_cast<float>((from_y - dy) * vortex.radius);
    });
  }
  return map;
}

// A texture with cells of `longitude_cell` x `latitude_cell` degrees, which drifts east and changes
// slowly.
struct Texture {
  int cells_around;
  double latitude_cell;
  double drift;  // degrees per hour
  int octaves;
  std::uint32_t seed;
};
constexpr Texture low_texture = {32, 6.5, 0.30, 3, 101};
constexpr Texture middle_texture = {20, 10.0, 0.42, 4, 202};
constexpr Texture high_texture = {9, 7.0, 0.70, 4, 303};
constexpr Texture cluster_texture = {11, 17.0, -0.35, 4, 404};
constexpr Texture thread_texture = {22, 2.4, 0.55, 2, 606};
constexpr Texture ragged_texture = {18, 16.0, 0.45, 3, 505};

double texture_at(const Texture& texture, double longitude, double latitude, double hours) {
  const double x = (longitude - texture.drift * hours) * texture.cells_around / 360.0;
  return fractal_noise(x, latitude / texture.latitude_cell, hours / 30.0, texture.cells_around,
                       texture.octaves, texture.seed);
}

// Fronts and the convergence zone are irregular: noise displaces them by some degrees.
Displacement ragged_edges(const Columns& columns, double hours) {
  constexpr double reach_degrees = 3.5;
  Displacement map{Map(columns.count()), Map(columns.count())};
  Texture other = ragged_texture;
  other.seed += 50;
  const std::size_t row = columns.longitudes.size();
  for (std::size_t n = 0; n < columns.count(); ++n) {
    const double longitude = columns.longitudes[n % row];
    const double latitude = columns.latitudes[n / row];
    map.longitude[n] =
        static_cast<float>(reach_degrees * texture_at(ragged_texture, longitude, latitude, hours));
    map.latitude[n] =
        static_cast<float>(reach_degrees * texture_at(other, longitude, latitude, hours));
  }
  return map;
}

// Quantities that do not depend on longitude.
struct CloudRow {
  double storm_track, trades, stratus, polar;
};

CloudRow cloud_row(double latitude) {
  const double poleward = std::abs(latitude);
  return {bump((poleward - 53.0) / 12.0), bump((poleward - 14.0) / 9.0),
          bump((poleward - 27.0) / 9.0), smooth_step(58.0, 76.0, poleward)};
}

}  // namespace

std::vector<Vortex> vortices(double hours) {
  std::vector<Vortex> all;
  for (const Track& track : tracks) {
    for (int n = 0; n < track.waves; ++n) {
      // Incommensurate sines, from -1 to 1, so that no two lows are equal.
      const double a = std::sin(2.4 * n + 1.1 * track.hemisphere);
      const double b = std::sin(3.9 * n + 0.7);
      const double centre = track.longitude + 360.0 * n / track.waves + track.drift * hours;
      all.push_back({wrap_degrees(centre + 9.0 * a), track.hemisphere * (track.latitude + 6.0 * b),
                     9.0 + 2.5 * a, 30.0 + 6.0 * b, track.hemisphere, track.hemisphere, true});
      all.push_back({wrap_degrees(centre + 180.0 / track.waves + 6.0 * b),
                     track.hemisphere * (track.latitude - 19.0), 12.0 + 2.0 * b, 13.0 + 4.0 * a,
                     -track.hemisphere, track.hemisphere, false});
    }
  }
  return all;
}

WindMaps wind_maps(const Columns& columns, double hours) {
  const std::size_t count = columns.count();
  WindMaps maps{Map(count), Map(count), Map(count), Map(count),
                Map(count), Map(count), Map(count), {Map(count), Map(count), Map(count)}};
  const std::vector<Vortex> all = vortices(hours);
  for (const Vortex& vortex : all) {
    add_swirl(columns, vortex, maps.low_u, maps.low_v);
    Vortex aloft = vortex;
    aloft.longitude -= tilt_degrees;
    aloft.radius *= spread_aloft;
    add_swirl(columns, aloft, maps.high_u, maps.high_v);
  }
  maps.lift = front_map(columns, all, nullptr);
  const Displacement from = winding(columns, all);
  const std::size_t row = columns.longitudes.size();
  for (std::size_t j = 0; j < columns.latitudes.size(); ++j) {
    const double latitude = columns.latitudes[j];
    const Track& track = latitude >= 0 ? tracks[0] : tracks[1];
    const double poleward = std::abs(latitude);
    const double sinking = 0.25 * bump((poleward - 25.0) / 10.0);
    const double cosine = std::cos(track.jet_latitude * degree);
    for (std::size_t i = 0; i < row; ++i) {
      const double longitude = columns.longitudes[i];
      const double phase =
          track.waves * (longitude - track.longitude - track.drift * hours + tilt_degrees) * degree;
      // The axis of the jet is displaced to the equator above the troughs; positive values are
      // towards the pole in both hemispheres.
      const double stands = 3.0 * (longitude - 20.0) * degree;
      const double axis = track.jet_latitude - track.meander * std::cos(phase) +
                          track.long_meander * std::sin(stands);
      const double slope = degree / cosine *
                           (track.meander * track.waves * std::sin(phase) +
                            track.long_meander * 3.0 * std::cos(stands));
      const double strength =
          1.0 + track.jet_variation * std::cos(2.0 * (longitude - 140.0) * degree);
      const double u = track.jet_speed * strength * bump((poleward - axis) / track.jet_width);
      const std::size_t index = j * row + i;
      maps.jet_u[index] = static_cast<float>(u);
      maps.jet_v[index] = static_cast<float>(u * slope * track.hemisphere);
      // Streaks are along the jets and wound up by the cyclones.
      const double across =
          poleward - axis + track.hemisphere * static_cast<double>(from.latitude[index]);
      const double along = longitude + static_cast<double>(from.longitude[index]);
      for (std::size_t n = 0; n < maps.threads.size(); ++n) {
        Texture texture = thread_texture;
        texture.seed += static_cast<std::uint32_t>(10 * n);
        const double uneven = texture_at(texture, along, across, hours);
        maps.threads[n][index] = static_cast<float>(1.0 + thread_strength * uneven);
      }
      const double tropics = bump((latitude - convergence_latitude(longitude, hours)) / 5.0);
      maps.lift[index] = static_cast<float>(maps.lift[index] + 0.5 * tropics - sinking);
    }
  }
  return maps;
}

CloudMaps cloud_maps(const Columns& columns, double hours) {
  const std::size_t count = columns.count();
  CloudMaps maps{Map(count), Map(count), Map(count), Map(count)};
  const std::vector<Vortex> all = vortices(hours);
  const Displacement ragged = ragged_edges(columns, hours);
  const Map fronts = front_map(columns, all, &ragged);
  const Displacement from = winding(columns, all);
  const std::size_t row = columns.longitudes.size();
  for (std::size_t j = 0; j < columns.latitudes.size(); ++j) {
    const double latitude = columns.latitudes[j];
    const CloudRow zone = cloud_row(latitude);
    for (std::size_t i = 0; i < row; ++i) {
      const std::size_t index = j * row + i;
      const double longitude = columns.longitudes[i];
      const double source_x = longitude + static_cast<double>(from.longitude[index]);
      const double source_y = latitude + static_cast<double>(from.latitude[index]);
      const double fine = texture_at(low_texture, source_x, source_y, hours);
      const double broad = texture_at(middle_texture, source_x, source_y, hours);
      const double streaks = texture_at(high_texture, source_x, source_y, hours);
      const double clusters = texture_at(cluster_texture, longitude, latitude, hours);
      const double line = latitude + static_cast<double>(ragged.latitude[index]) -
                          convergence_latitude(longitude, hours);
      const double tropics = bump(line / 5.0) * clamp_unit(0.75 + 1.0 * clusters);
      const auto arm = static_cast<double>(fronts[index]);
      const double patches = clamp_unit(0.5 + 0.9 * clusters);
      const double low = 0.95 * zone.stratus * patches +
                         zone.storm_track * (0.30 + 0.45 * patches) + 0.35 * arm +
                         0.75 * zone.polar * patches + 0.32 * zone.trades;
      const double middle = 0.85 * arm + zone.storm_track * (0.15 + 0.40 * patches) +
                            0.40 * zone.polar * patches + 0.50 * tropics;
      const double high = 0.70 * arm + zone.storm_track * (0.10 + 0.35 * patches) + 0.75 * tropics;
      maps.low[index] = static_cast<float>(low + 0.50 * fine);
      maps.middle[index] = static_cast<float>(middle + 0.50 * broad + 0.15 * fine);
      maps.high[index] = static_cast<float>(high + 0.55 * streaks);
      maps.deep[index] =
          static_cast<float>(0.95 * arm + 0.9 * tropics + 0.40 * broad + 0.25 * fine);
    }
  }
  return maps;
}

}  // namespace windsplat::data::climate
