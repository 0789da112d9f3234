// The sample "climate": an analytic snapshot of the general circulation in January, of the size of
// the global model in Crawfis & Max (320 x 160 x 19, winds and percent cloudiness).
// Position and time -> a few horizontal maps, each multiplied by a vertical profile.
//
// phi latitude, lambda longitude, p pressure in hPa, time in hours. bump(x) = exp(-x^2).
// Jets: u = U(lambda) bump((phi - phi_j) / width) bump(ln(p / 200) / depth) about a meandering axis
//   phi_j = phi_0 + A sin(m (lambda - c t) + phase), and v = u dphi_j/dlambda / cos(phi_0), so that
//   the wind follows the meander; m and c are those of the cyclones below.
// Streaks: the horizontal wind varies by some tens of per cent, in streaks along the flow.
// Trades and Hadley cell: easterlies at +-13 degrees and flow to the equator below 750 hPa, flow to
//   the poles near 200 hPa; polar easterlies near the ground; a stratospheric jet at 65 N.
// Cyclones: m in each hemisphere, drifting east; with local distances d = (dlon cos phi_c, dlat)
//   and r = |d|, v_theta = V (r / R) exp((1 - r^2 / R^2) / 2), fastest at r = R;
//   counter-clockwise in the north, clockwise in the south; anticyclones between them rotate the
//   other way. Aloft they are further west (baroclinic tilt); near the ground friction turns the
//   wind towards the low.
// Fronts: a log-spiral arm, angle(r) = a - b ln(r / R), from the tail on the equatorward west
//   around the east into the centre (the comma cloud). Ascent along the arm, descent behind it.
// Cloud: comma arms, storm tracks, the intertropical convergence zone (an undulating line in the
//   summer hemisphere) and marine stratus, each with a map of coverage. Its texture is fractal
//   noise that drifts with the flow and is wound up by the cyclones. There is cloud where
//   coverage + noise exceeds a threshold, which increases towards the top and base of a cloud.
#include "server/data/samples/climate.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <utility>

#include "server/data/samples/source.hpp"

namespace windsplat::data {

namespace {

constexpr int climate_version = 1;
constexpr int step_hours = 6;
constexpr double jet_level_hpa = 200;
constexpr float cloud_rate = 2.2F;  // increase of cloud fraction per unit of coverage beyond the
                                    // threshold
constexpr std::array<double, 19> levels_hpa = {1000, 925, 850, 775, 700, 600, 500, 400, 300, 250,
                                               200,  150, 125, 100, 70,  50,  30,  20,  10};

// `count` pressures from 1000 to 10 hPa: the list of the sample's own 19 levels, interpolated
// linearly in its index and in log p.
std::vector<double> pressure_levels(int count) {
  std::vector<double> levels(static_cast<std::size_t>(count));
  if (count == 1) return {500.0};
  for (int k = 0; k < count; ++k) {
    const double place = static_cast<double>(k) * (levels_hpa.size() - 1) / (count - 1);
    const auto below = std::min(static_cast<std::size_t>(place), levels_hpa.size() - 2);
    const double t = place - static_cast<double>(below);
    const double ratio = levels_hpa[below + 1] / levels_hpa[below];
    levels[static_cast<std::size_t>(k)] = levels_hpa[below] * std::pow(ratio, t);
  }
  levels.front() = levels_hpa.front();
  levels.back() = levels_hpa.back();
  return levels;
}

std::string iso_time(int hours) {
  using std::chrono::sys_days;
  const sys_days start = std::chrono::year{2001} / 1 / 1;
  const std::chrono::year_month_day date{start + std::chrono::days{hours / 24}};
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02uT%02d:00:00Z",
                static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                static_cast<unsigned>(date.day()), hours % 24);
  return text.data();
}

// Factors of a level by which the maps of the wind are multiplied.
struct WindProfile {
  double jet, low, high;
  double friction_cosine, friction_sine;
  double w;  // m/s at maximum lift
};

WindProfile wind_profile(double pressure_hpa) {
  const double depth = std::log(pressure_hpa / jet_level_hpa);
  const double low = smooth_step(380, 750, pressure_hpa);
  const double friction = 0.45 * smooth_step(820, 1000, pressure_hpa);  // radians
  // The updraft is fastest in the middle troposphere, and zero at the ground and in the
  // stratosphere.
  const double rise = smooth_step(1000, 600, pressure_hpa) * smooth_step(110, 350, pressure_hpa);
  const double reach = depth > 0 ? 0.50 : 0.45;  // scale depth below and above the jets
  return {climate::bump(depth / reach),
          low * (1.0 - 0.35 * smooth_step(880, 1000, pressure_hpa)),
          (1.0 - low) * smooth_step(90, 220, pressure_hpa) * 0.9,
          std::cos(friction),
          std::sin(friction),
          0.12 * rise};
}

// The zonal mean of the wind, m/s.
std::array<double, 2> zonal_wind(double latitude, double pressure_hpa) {
  const double poleward = std::abs(latitude);
  const double ground = smooth_step(650, 850, pressure_hpa);
  const double outflow = climate::bump(std::log(pressure_hpa / 180.0) / 0.35);
  const double stratosphere = smooth_step(120, 15, pressure_hpa);
  const double to_equator = -std::tanh(latitude / 6.0);
  const double cell = climate::bump((poleward - 12.0) / 9.0);
  const double u = ground * (-7.5 * climate::bump((poleward - 13.0) / 8.0) +
                             4.0 * climate::bump((poleward - 48.0) / 12.0) -
                             3.0 * climate::bump((poleward - 74.0) / 8.0)) +
                   stratosphere * (15.0 * climate::bump((latitude - 65.0) / 14.0) -
                                   10.0 * climate::bump((latitude + 15.0) / 30.0));
  const double v = to_equator * cell * (3.0 * ground - 2.5 * outflow);
  return {u, v};
}

enum CloudLayer : std::size_t { low_layer, middle_layer, high_layer, deep_layer, layer_count };

// The coverage above which a column has cloud at this level: least in the middle of the layer, more
// towards its base and top. Tropical clouds reach higher.
std::array<double, layer_count> cloud_thresholds(double latitude, double pressure_hpa) {
  const double tropics = climate::bump(latitude / 30.0);
  const double top = std::log(270.0 - 130.0 * tropics);
  const double bottom = std::log(960.0);
  const double level = std::log(pressure_hpa);
  const auto threshold = [level](double centre, double half_depth) {
    const double away = (level - centre) / half_depth;
    return 0.42 + 0.55 * away * away;
  };
  return {threshold(std::log(880.0), 0.13), threshold(std::log(560.0), 0.28),
          threshold(top + 0.22, 0.22), threshold(0.5 * (top + bottom), 0.5 * (bottom - top))};
}

class Climate final : public SampleSource {
 public:
  explicit Climate(const SampleSize& size);

 private:
  void fill(std::size_t field, std::size_t step, const Box& /*whole*/, Volume& volume) override {
    const double hours = info_.steps[step].value;
    if (field == 0) {
      fill_wind(hours, volume);
    } else {
      fill_cloud(hours, volume);
    }
  }
  void fill_wind(double hours, Volume& volume) const;
  void fill_cloud(double hours, Volume& volume) const;

  climate::Columns columns_;
};

Climate::Climate(const SampleSize& size)
    : SampleSource("climate", "Global circulation with clouds", size, climate_version,
                   "hours since 2001-01-01 00:00:00") {
  columns_ = {cell_centres(-180, 180, size.dims[0]), cell_centres(-90, 90, size.dims[1])};
  info_.grid.axes = {
      sample_axis("lon", "longitude", "degrees_east", AxisKind::longitude, columns_.longitudes),
      sample_axis("lat", "latitude", "degrees_north", AxisKind::latitude, columns_.latitudes),
      sample_axis("level", "air_pressure", "hPa", AxisKind::pressure,
                  pressure_levels(size.dims[2]))};
  info_.fields = {sample_vector("wind", {"u", "v", "w"}, "m s-1", "wind, w upward"),
                  sample_scalar("cloud", "1", "cloud_area_fraction_in_atmosphere_layer",
                                "percent cloudiness as a fraction")};
  for (int i = 0; i < size.steps; ++i) {
    const int hours = step_hours * i;
    info_.steps.push_back({static_cast<double>(hours), iso_time(hours)});
  }
}

void Climate::fill_wind(double hours, Volume& volume) const {
  const climate::WindMaps maps = climate::wind_maps(columns_, hours);
  const std::size_t samples = volume.samples();
  const std::size_t row = columns_.longitudes.size();
  float* u = volume.values.data();
  float* v = u + samples;
  float* w = v + samples;
  const auto& levels = info_.grid.axes[2].coordinates;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    const double pressure = levels[k];
    const climate::Map& thread = maps.threads[k % maps.threads.size()];
    const WindProfile profile = wind_profile(pressure);
    const auto jet = static_cast<float>(profile.jet);
    const auto high = static_cast<float>(profile.high);
    const auto along = static_cast<float>(profile.low * profile.friction_cosine);
    const auto rise = static_cast<float>(profile.w);
    for (std::size_t j = 0; j < columns_.latitudes.size(); ++j) {
      const double latitude = columns_.latitudes[j];
      const std::array<double, 2> zonal = zonal_wind(latitude, pressure);
      const auto zonal_u = static_cast<float>(zonal[0]);
      const auto zonal_v = static_cast<float>(zonal[1]);
      // Friction turns the wind to the left in the northern hemisphere, to the right in the
      // southern.
      const auto across =
          static_cast<float>(profile.low * profile.friction_sine * std::tanh(latitude / 5.0));
      for (std::size_t n = j * row; n < (j + 1) * row; ++n) {
        *u++ = thread[n] * (zonal_u + jet * maps.jet_u[n] + along * maps.low_u[n] -
                            across * maps.low_v[n] + high * maps.high_u[n]);
        *v++ = thread[n] * (zonal_v + jet * maps.jet_v[n] + along * maps.low_v[n] +
                            across * maps.low_u[n] + high * maps.high_v[n]);
        *w++ = rise * maps.lift[n];
      }
    }
  }
}

void Climate::fill_cloud(double hours, Volume& volume) const {
  const climate::CloudMaps maps = climate::cloud_maps(columns_, hours);
  const std::size_t row = columns_.longitudes.size();
  float* cloud = volume.values.data();
  for (const double pressure : info_.grid.axes[2].coordinates) {
    for (std::size_t j = 0; j < columns_.latitudes.size(); ++j) {
      const auto needed = cloud_thresholds(columns_.latitudes[j], pressure);
      const auto low = static_cast<float>(needed[low_layer]);
      const auto middle = static_cast<float>(needed[middle_layer]);
      const auto high = static_cast<float>(needed[high_layer]);
      const auto deep = static_cast<float>(needed[deep_layer]);
      for (std::size_t n = j * row; n < (j + 1) * row; ++n) {
        const float thick = std::max(maps.deep[n] - deep, maps.middle[n] - middle);
        const float thin = std::max(maps.low[n] - low, maps.high[n] - high);
        *cloud++ = std::clamp(std::max(thick, thin) * cloud_rate, 0.0F, 1.0F);
      }
    }
  }
}

}  // namespace

std::unique_ptr<Source> make_climate(const SampleSize& size) {
  return std::make_unique<Climate>(size);
}

}  // namespace windsplat::data
