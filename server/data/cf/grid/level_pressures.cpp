#include "server/data/cf/grid/level_pressures.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/data/cf/units.hpp"

namespace windsplat::data::cf {

namespace {

const std::string& variable_name(const ArrayFile& file, int variable) {
  return file.contents().variables.at(at(variable)).name;
}

Result<void> place_by_pressure(const ArrayFile& file, HybridLevels hybrid, Placement& grid,
                               DatasetInfo& info, PressureLevels& pressures) {
  const Levels all{0, grid.length[2]};
  const double bytes = decoded_step_bytes(file, grid, hybrid.surface, all);
  if (auto fine = file.charge(hybrid.surface, bytes); !fine) {
    info.notes.push_back("terrain-following levels of unknown pressure (" + fine.error().message +
                         "): the coordinate of the file is used");
    return {};
  }
  std::vector<float> surface(grid.layer());
  if (auto read = read_variable(file, grid, hybrid.surface, 0, all, surface.data(), [](double) {});
      !read) {
    return read;
  }
  double sum = 0;
  double count = 0;
  for (const float p : surface) {
    if (!std::isfinite(p)) continue;
    sum += static_cast<double>(p);
    ++count;
  }
  const bool turned = grid.turned[2];
  Axis axis = info.grid.axes[2];
  const auto mean = [&](std::size_t k) {
    return hybrid.a[k] / hybrid.unit_pa + hybrid.b[k] * sum / count;
  };
  // Levels may be numbered from the top without an attribute that says so.
  if (count > 0 && mean(0) < mean(axis.coordinates.size() - 1)) {
    std::reverse(hybrid.a.begin(), hybrid.a.end());
    std::reverse(hybrid.b.begin(), hybrid.b.end());
    grid.turned[2] = !grid.turned[2];
  }
  bool falls = count > 0;
  for (std::size_t k = 0; k < axis.coordinates.size(); ++k) {
    axis.coordinates[k] = mean(k);
    falls = falls && axis.coordinates[k] > 0 &&
            (k == 0 || axis.coordinates[k] < axis.coordinates[k - 1]);
  }
  if (!falls) {
    grid.turned[2] = turned;
    info.notes.emplace_back(
        "terrain-following levels whose mean pressures do not decrease from level to level: "
        "the coordinate of the file is used");
    return {};
  }
  axis.kind = AxisKind::pressure;
  axis.standard_name = "air_pressure";
  axis.units = hybrid.units;
  info.grid.axes[2] = std::move(axis);
  info.notes.push_back(hybrid.note);
  for (LeftOut& left : info.left_out) {
    if (left.name == variable_name(file, hybrid.surface)) {
      left.reason = "surface pressure: gives the pressure of the levels";
    }
    for (const int v : hybrid.coefficients) {
      if (left.name == variable_name(file, v)) left.reason = "coefficient of the levels' pressure";
    }
  }
  pressures.hybrid = std::move(hybrid);
  return {};
}

// Whether pressures are finite, positive and descend.
bool fall(const std::vector<double>& pressures) {
  for (std::size_t k = 0; k < pressures.size(); ++k) {
    const bool positive = pressures[k] > 0 && std::isfinite(pressures[k]);
    if (!positive || (k > 0 && pressures[k] >= pressures[k - 1])) return false;
  }
  return true;
}

void place_by_logarithm(LogarithmicLevels logarithmic, DatasetInfo& info,
                        PressureLevels& pressures) {
  if (!fall(logarithmic.pressures)) {
    info.notes.emplace_back(
        "levels of the logarithm of pressure whose pressures do not decrease from level to level: "
        "the coordinate of the file is used");
    return;
  }
  Axis& axis = info.grid.axes[2];
  axis.kind = AxisKind::pressure;
  axis.standard_name = "air_pressure";
  axis.units = "Pa";
  axis.coordinates = logarithmic.pressures;
  info.notes.push_back(
      "levels of the logarithm of pressure: the vertical axis has their pressures" +
      logarithmic.note);
  pressures.level = std::move(logarithmic.pressures);
}

}  // namespace

Result<PressureLevels> find_pressures(const ArrayFile& file, int coordinate, Placement& grid,
                                      DatasetInfo& info) {
  PressureLevels pressures;
  Axis& axis = info.grid.axes[2];
  const bool by_pressure = axis.kind == AxisKind::pressure;
  const auto unit = pascals_in(axis.units);
  if (!by_pressure) {
    auto logarithmic = find_logarithmic(file, grid, coordinate);
    if (!logarithmic) return logarithmic.error();
    if (*logarithmic) {
      place_by_logarithm(std::move(**logarithmic), info, pressures);
      return pressures;
    }
    auto hybrid = find_hybrid(file, grid, coordinate);
    if (!hybrid) return hybrid.error();
    if (*hybrid) {
      auto placed = place_by_pressure(file, std::move(**hybrid), grid, info, pressures);
      if (!placed) return placed.error();
      return pressures;
    }
  }
  if (by_pressure && unit) {
    for (const double p : axis.coordinates) pressures.level.push_back(p * *unit);
    const int surface = find_surface_pressure(file.contents(), grid);
    if (surface >= 0) {
      info.notes.push_back(in_quotes(variable_name(file, surface)) +
                           " is the surface pressure: values below the surface are shown as "
                           "stored unless marked as missing");
    }
  }
  return pressures;
}

}  // namespace windsplat::data::cf
