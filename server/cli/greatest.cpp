#include "server/cli/greatest.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>

#include "server/base/error.hpp"
#include "server/data/model/measure.hpp"

namespace windsplat::cli {
namespace {

struct Greatest {
  double value = 0;
  std::array<int, 3> index{};
  std::size_t step = 0;
};

std::string five_digits(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.5g", value);
  return text.data();
}

std::string with_units(const std::string& text, const std::string& units) {
  return units.empty() || units == "1" ? text : text + ' ' + printable(units, 80);
}

double magnitude_at(const data::Volume& volume, const std::array<int, 3>& index) {
  const auto [i, j, k] = index;
  const auto x = static_cast<std::size_t>(volume.dims[0]);
  const auto y = static_cast<std::size_t>(volume.dims[1]);
  const std::size_t n = (static_cast<std::size_t>(k) * y + static_cast<std::size_t>(j)) * x +
                        static_cast<std::size_t>(i);
  if (volume.components == 1) return static_cast<double>(volume.component(0)[n]);
  double square = 0;
  for (int c = 0; c < volume.components; ++c) {
    const auto part = static_cast<double>(volume.component(c)[n]);
    square += part * part;
  }
  return std::sqrt(square);
}

// nullopt: not all of the steps are in memory, or all samples are masked.
std::optional<Greatest> greatest_of(const data::Dataset& resident, const std::string& field,
                                    std::size_t steps) {
  std::optional<Greatest> out;
  data::Dataset source = resident;
  for (std::size_t step = 0; step < steps; ++step) {
    const auto volume = source.volume(field, step);
    if (!volume) return std::nullopt;
    const auto ends = data::extremes(**volume);
    if (!ends) continue;
    const double value = magnitude_at(**volume, ends->greatest);
    if (!out || value > out->value) out = Greatest{value, ends->greatest, step};
  }
  return out;
}

// Of columns with longitudes and latitudes of their own, these.
std::string place_text(const data::Grid& grid, const std::array<int, 3>& index) {
  std::string text;
  std::size_t first = 0;
  if (const auto& columns = grid.columns) {
    const std::size_t n =
        static_cast<std::size_t>(index[1]) * static_cast<std::size_t>(grid.dims()[0]) +
        static_cast<std::size_t>(index[0]);
    text = "longitude " + five_digits(columns->longitude[n]) + ", latitude " +
           five_digits(columns->latitude[n]);
    first = 2;
  }
  for (std::size_t a = first; a < 3; ++a) {
    const data::Axis& axis = grid.axes.at(a);
    if (axis.coordinates.size() < 2) continue;
    const double at = axis.coordinates[static_cast<std::size_t>(index.at(a))];
    text += (text.empty() ? "" : ", ") + printable(axis.name, 80) + ' ' +
            with_units(five_digits(at), axis.units);
  }
  return text;
}

}  // namespace

std::vector<std::string> greatest_values(const data::Dataset& dataset, std::size_t steps) {
  const data::DatasetInfo& info = dataset.info();
  const data::Dataset resident = dataset.resident_only();
  std::vector<std::string> lines;
  for (const data::FieldInfo& field : info.fields) {
    if (field.derived) continue;
    const auto found = greatest_of(resident, field.name, steps);
    if (!found) continue;
    std::string line = "greatest " + printable(field.name, 80) + ": " +
                       with_units(five_digits(found->value), field.units) + " at " +
                       place_text(info.grid, found->index);
    if (info.steps.size() > 1) line += ", step " + std::to_string(found->step);
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace windsplat::cli
