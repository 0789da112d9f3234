// Fields -> default ranges, colour maps and extinctions.
#include "server/scene/defaults.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>
#include <string_view>

#include "server/scene/defaults/some_samples.hpp"
#include "server/scene/defaults/spacing.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"

namespace windsplat::scene {

namespace {

constexpr double value_max = 1e38;  // limit on numbers in a view

// A kind of scalar: words that identify it as part of its names, and short names that must match
// exactly. Earlier kinds are preferred as media.
struct Kind {
  std::vector<std::string_view> words;
  std::vector<std::string_view> names;
  ScalarStyle signature;
};

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all = {
      {{"cloud", "condens", "liquid water content", "liquid_water_content", "ice water content",
        "ice_water_content", "liquid water mixing ratio", "liquid water specific", "cldliq",
        "cldice"},
       {"cl",  "cc",     "clt",  "clw",  "cli",  "clwc", "ciwc", "qc",  "qi",
        "tcc", "cldtot", "ql",   "qn",   "qcl",  "qcf",  "qci",  "lwc", "iwc",
        "cwc", "clwmr",  "icmr", "qliq", "qice", "rct",  "rit"},
       {"clouds", 0.12, 12, true, false, false}},
      {{"energy"}, {}, {"inferno", 0.30, 6, false}},
      {{"smoke", "dust", "aerosol", "ash", "concentration", "tracer"},
       {},
       {"sunset", 0.05, 12, false}},
      {{"rain", "snow", "precip", "hail", "graupel"}, {"qr", "qs", "qg"}, {"ice", 0.05, 12, false}},
      {{"vortic", "helicity", "q_criterion"}, {}, {"plasma", 0.10, 10, false}},
      {{"humidity", "water", "vapor", "vapour", "moist"},
       {"q", "qv", "hus", "hur", "rh", "r", "shum", "rhum"},
       {"ice", 0.45, 8, false}},
      {{"fraction", "density", "ozone"}, {"rho"}, {"moss", 0.25, 8, false}},
  };
  return all;
}

const ScalarStyle body_style = {"grays", 0.0, 6, false, false, false};
const ScalarStyle other_style = {"magma", 0.30, 8, false, true, true};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool is_body(const data::FieldInfo& field) {
  constexpr std::array<std::string_view, 6> names = {"wall",  "walls",     "obstacle",
                                                     "solid", "conductor", "building"};
  return std::find(names.begin(), names.end(), lower(field.name)) != names.end();
}

// Index of the kind of a field; kinds().size() if none matches. Other quantities of clouds and of
// sea water, such as temperature, height or velocity, are excluded, and what lies on the ground,
// such as liquid_water_content_of_surface_snow.
std::size_t kind_of(const data::FieldInfo& field) {
  const std::string name = lower(field.name);
  std::string text = name + " " + lower(field.standard_name) + " " + lower(field.long_name);
  for (const char* other :
       {"temperature", "pressure", "altitude", "height", "flux", "speed", "velocity",
        "surface_snow", "surface snow", "snow_layer", "snow layer", "snow_depth", "snow depth",
        "snowpack", "canopy", "land_ice", "land ice", "sea_ice", "sea ice"}) {
    if (text.find(other) != std::string::npos) return kinds().size();
  }
  for (const std::string_view sea : {"sea_water", "sea water"}) {
    for (auto at = text.find(sea); at != std::string::npos; at = text.find(sea)) {
      text.erase(at, sea.size());
    }
  }
  const bool in_soil = text.find("soil") != std::string::npos;
  for (std::size_t n = in_soil ? 1 : 0; n < kinds().size(); ++n) {
    for (const std::string_view word : kinds()[n].words) {
      if (text.find(word) != std::string::npos) return n;
    }
    for (const std::string_view whole : kinds()[n].names) {
      if (name == whole) return n;
    }
  }
  return kinds().size();
}

bool says(const data::FieldInfo& field, const std::vector<std::string_view>& words) {
  const std::string text =
      lower(field.name) + " " + lower(field.standard_name) + " " + lower(field.long_name);
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return text.find(word) != std::string::npos; });
}

// Whether a quantity of clouds in the unit 1 or % is a share of an area or volume, as opposed to a
// mixing ratio: by its names, otherwise by its values, since a range of shares would leave every
// mixing ratio too small to be seen.
bool is_share(const data::FieldInfo& field, double whole, double most) {
  if (says(field, {"mixing", "mass_fraction", "mass fraction", "content", "specific"}))
    return false;
  if (says(field, {"area_fraction", "cover", "cloud fraction", "cloud_fraction", "cloud area"})) {
    return true;
  }
  return most <= 0 || most > scalar_style(field).clear_below * whole;
}

protocol::Range pick(std::vector<double>& values, double low, double high) {
  if (values.empty()) return {0, 0};
  const auto at = [&values](double quantile) {
    const auto n = static_cast<std::ptrdiff_t>(quantile * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + n, values.end());
    return values[static_cast<std::size_t>(n)];
  };
  const double lower = at(low);
  return {lower, at(high)};
}

// A range within the limits of a view and of nonzero width.
protocol::Range sound_range(double low, double high) {
  low = std::clamp(low, -value_max, value_max);
  high = std::clamp(high, -value_max, value_max);
  const double width_min = std::max(1e-30, 1e-6 * std::abs(low));
  if (!(high - low >= width_min)) {
    const double width = low == 0 ? 1.0 : 0.1 * std::abs(low);
    high = low + std::max(width, width_min);
  }
  return {low, high};
}

}  // namespace

double nice_above(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  for (const double digits : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0}) {
    if (digits * power >= value * (1.0 - 1e-9)) return digits * power;
  }
  return 10.0 * power;
}

protocol::Range quantiles(const data::Volume& volume, double low, double high,
                          const std::optional<Slice>& slice) {
  std::vector<double> values;
  for_some_samples(volume, slice, [&](std::size_t, double value) { values.push_back(value); });
  return pick(values, low, high);
}

protocol::Range height_range(const Lattice& lattice) {
  const std::vector<double>& at = lattice.positions[2];
  const std::vector<double>& width = lattice.spacing[2];
  return {at.front() - 0.5 * width.front(), at.back() + 0.5 * width.back()};
}

double magnitude_of_nearly_all(const data::Volume& volume) {
  constexpr double nearly_all = 0.98;  // of the samples
  constexpr double weak = 0.25;        // of the sum of the magnitudes
  // One in a thousand of 2^15: lines with a stride hardly meet a place of so few, and one bad
  // sample may exceed the sum of all others.
  constexpr std::size_t few_samples = 32;
  std::vector<double> magnitudes;
  for_some_samples(volume, std::nullopt,
                   [&](std::size_t, double magnitude) { magnitudes.push_back(magnitude); });
  std::sort(magnitudes.begin(), magnitudes.end());
  // A flow may lie in a few of the samples visited, or between them.
  if (magnitudes.empty() || !(magnitudes.back() > 0)) return static_cast<double>(volume.range[1]);
  std::size_t summed = magnitudes.size() - std::min(few_samples, magnitudes.size());
  if (summed == 0 || !(magnitudes[summed - 1] > 0)) summed = magnitudes.size();
  double sum = 0;
  for (std::size_t n = 0; n < summed; ++n) sum += magnitudes[n];
  double below = 0;
  std::size_t n = 0;
  while (n + 1 < summed && below + magnitudes[n] < weak * sum) below += magnitudes[n++];
  const double most = static_cast<double>(magnitudes.size() - 1);
  return std::max(magnitudes[n], magnitudes[static_cast<std::size_t>(nearly_all * most)]);
}

protocol::Range default_magnitude_range(const data::Volume& volume) {
  const double top = magnitude_of_nearly_all(volume);
  if (!(top > 1e-29) || !std::isfinite(top)) return {0, 1};
  return {0, std::min(nice_above(top), value_max)};
}

double hidden_share(double min_magnitude, const data::Volume& volume) {
  std::size_t all = 0;
  std::size_t hidden = 0;
  for_some_samples(volume, std::nullopt, [&](std::size_t, double magnitude) {
    ++all;
    hidden += magnitude < min_magnitude ? 1 : 0;
  });
  return all == 0 ? 0 : static_cast<double>(hidden) / static_cast<double>(all);
}

protocol::Range default_height_range(const protocol::VectorView& vector, const data::Volume& volume,
                                     const Lattice& lattice) {
  constexpr double below = 0.25;  // fraction of the width
  const std::size_t layer =
      static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  std::vector<double> heights;
  for_some_samples(volume, std::nullopt, [&](std::size_t at, double magnitude) {
    if (magnitude >= *vector.min_magnitude) heights.push_back(lattice.positions[2][at / layer]);
  });
  protocol::Range range = pick(heights, 0.02, 0.98);
  const protocol::Range whole = height_range(lattice);
  const double box = whole[1] - whole[0];
  if (!(range[1] - range[0] > 0.1 * box)) range = whole;
  const double grain = readable_grain(box);
  return {std::floor((range[0] - below * (range[1] - range[0])) / grain) * grain,
          std::ceil(range[1] / grain) * grain};
}

double default_color_top(const data::Volume& volume) {
  constexpr double far_beyond = 2.5;
  const auto most = static_cast<double>(volume.range[1]);
  const double nearly_all = magnitude_of_nearly_all(volume);
  double top = most;
  if (most > far_beyond * nearly_all) {
    const double few = quantiles(volume, 0.999, 0.999)[0];
    top = std::clamp(few, nearly_all, far_beyond * nearly_all);
  }
  if (!(top > 1e-29) || !std::isfinite(top)) return 0;
  const double grain = readable_grain(top);
  return std::min(std::ceil(top / grain * (1 - 1e-9)) * grain, value_max);
}

protocol::Range default_magnitude_colors(const protocol::VectorView& vector, double top) {
  const protocol::Range drawn = {(*vector.magnitude_range)[0],
                                 std::max((*vector.magnitude_range)[1], top)};
  const double grain = readable_grain(std::max(std::abs(drawn[0]), std::abs(drawn[1])));
  const double below = std::floor(0.7 * *vector.min_magnitude / grain) * grain;
  const double low = std::max(drawn[0], below);
  return low < drawn[1] ? protocol::Range{low, drawn[1]} : drawn;
}

protocol::Range default_rise_range(const protocol::VectorView& vector,
                                   const ComponentFactors& factors, const data::Volume& volume,
                                   const std::optional<Slice>& slice) {
  const double length = *vector.length;
  const double full = (*vector.magnitude_range)[1];
  const auto row = static_cast<std::size_t>(volume.dims[0]);
  const auto rows = static_cast<std::size_t>(volume.dims[1]);
  std::vector<double> rises;
  double most = 0;
  for_some_samples(volume, slice, [&](std::size_t at, double magnitude) {
    if (!(magnitude > 0) || magnitude < *vector.min_magnitude) return;
    glm::dvec3 drawn(0);
    for (int c = 0; c < volume.components; ++c) {
      drawn[c] = factors.scale[c] * static_cast<double>(volume.component(c)[at]) / magnitude;
    }
    if (const auto& rates = factors.rates) {
      drawn *= glm::dvec3(rates->x[at / row % rows], rates->y, rates->z[at / (row * rows)]);
    }
    const double norm = glm::length(drawn);
    if (!(norm > 0)) return;
    const double part = full > 0 ? std::min(magnitude / full, 1.0) : 1.0;
    rises.push_back(std::abs(drawn.z / norm) * part * length);
    most = std::max(most, rises.back());
  });
  double top = pick(rises, 0.0, 0.98)[1];
  // For lines that are level nearly everywhere, use the maximum.
  if (!(top > 1e-3 * most)) top = most;
  top = top > 1e-9 * length ? nice_above(top) : length;
  return {-top, top};
}

ScalarStyle scalar_style(const data::FieldInfo& field) {
  if (is_body(field)) return body_style;
  const std::size_t kind = kind_of(field);
  return kind < kinds().size() ? kinds()[kind].signature : other_style;
}

bool is_map(const data::DatasetInfo& info) {
  return info.grid.dims()[2] == 1 && info.first(data::FieldKind::vector) == nullptr;
}

std::string default_map(const data::FieldInfo& field, const data::DatasetInfo& info) {
  const std::string map = scalar_style(field).map;
  return is_map(info) && map == other_style.map ? "viridis" : map;  // whose low end is not black
}

std::vector<std::string> default_scalars(const data::DatasetInfo& info) {
  if (is_map(info)) {
    const auto shown =
        std::find_if(info.fields.begin(), info.fields.end(), [](const data::FieldInfo& field) {
          return field.kind == data::FieldKind::scalar && field.standard_name != "time";
        });
    if (shown != info.fields.end()) return {shown->name};
  }
  const data::FieldInfo* best = nullptr;
  std::size_t best_kind = kinds().size();
  const data::FieldInfo* body = nullptr;
  for (const data::FieldInfo& field : info.fields) {
    if (field.kind != data::FieldKind::scalar || field.derived) continue;
    if (is_body(field)) {
      if (body == nullptr) body = &field;
      continue;
    }
    const std::size_t kind = kind_of(field);
    if (kind < best_kind) {
      best = &field;
      best_kind = kind;
    }
  }
  const bool has_vector = info.first(data::FieldKind::vector) != nullptr;
  if (best == nullptr && !has_vector) best = info.first(data::FieldKind::scalar);
  std::vector<std::string> names;
  if (best != nullptr) names.push_back(best->name);
  if (body != nullptr && body != best) names.push_back(body->name);
  return names;
}

protocol::Range default_scalar_range(const data::FieldInfo& field, const data::Volume& volume) {
  const ScalarStyle signature = scalar_style(field);
  const auto least = static_cast<double>(volume.range[0]);
  const auto most = static_cast<double>(volume.range[1]);
  if (signature.fraction && least >= -1e-6) {
    if (field.units == "%" && most <= 100.5 && is_share(field, 100, most)) return {0, 100};
    if (field.units == "1" && most <= 1.0001 && is_share(field, 1, most)) return {0, 1};
  }
  if (is_body(field)) return {0, 2};
  const protocol::Range middle = quantiles(volume, 0.01, 0.995);
  if (least >= 0 && middle[0] <= 0.5 * middle[1]) {
    const double top = middle[1] > 1e-3 * most ? middle[1] : most;
    if (!(top > 1e-29)) return {0, 1};
    return sound_range(0, nice_above(top));
  }
  if (!(middle[1] > middle[0])) return sound_range(least, most);
  // Round both ends outward to a readable increment of the width.
  const double grain = nice_above(middle[1] - middle[0]) / 20.0;
  return sound_range(std::floor(middle[0] / grain) * grain, std::ceil(middle[1] / grain) * grain);
}

const data::FieldInfo* default_vector(const data::DatasetInfo& info) {
  const data::FieldInfo* const first = info.first(data::FieldKind::vector);
  const auto is_mixed = [](const data::FieldInfo& field) {
    const auto& units = field.component_units;
    return std::adjacent_find(units.begin(), units.end(), std::not_equal_to<>()) != units.end();
  };
  if (first == nullptr || !is_mixed(*first)) return first;
  const auto converts = [&](const data::FieldInfo& field) {
    return field.kind == data::FieldKind::vector && !is_mixed(field) &&
           field.components.size() == first->components.size() &&
           std::equal(field.components.begin(), field.components.begin() + 2,
                      first->components.begin());
  };
  const auto found = std::find_if(info.fields.begin(), info.fields.end(), converts);
  return found == info.fields.end() ? first : &*found;
}

bool draws_map(const protocol::View& view, const data::DatasetInfo& info) {
  if (is_map(info)) return true;
  if (!view.geometry.slice && !view.geometry.plane) return false;
  using Kind = protocol::FieldChoice::Kind;
  const Kind kind = view.vector.field.kind;
  const bool lines =
      kind == Kind::named || (kind == Kind::dataset_default && default_vector(info) != nullptr);
  return !lines || view.vector.combine == protocol::LineCombination::either;
}

std::vector<std::array<double, 2>> default_extinction(const data::FieldInfo& field,
                                                      const protocol::Range& range,
                                                      const Lattice& lattice,
                                                      const std::optional<Slice>& slice, bool map) {
  const ScalarStyle signature = scalar_style(field);
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    const bool across = slice && slice->axis == static_cast<int>(a);
    shortest = std::min(shortest, cell_size(lattice, a) * (across ? 1 : lattice.dims[a]));
  }
  constexpr double opaque = 12;
  if (map) {
    const double everywhere = nice_above(opaque / shortest);
    return {{range[0], everywhere}, {range[1], everywhere}};
  }
  const double top = nice_above(signature.opacity / shortest);
  const double clear = range[0] + signature.clear_below * (range[1] - range[0]);
  if (signature.clear_below <= 0) return {{range[0], 0}, {range[1], top}};
  return {{range[0], 0}, {clear, 0}, {range[1], top}};
}

protocol::ColorBy default_color_by(const data::Grid& grid, const std::optional<Slice>& slice) {
  const data::Axis& z = grid.axes[2];
  const bool own_kind = z.kind != data::AxisKind::cartesian;
  return own_kind && !slice && z.coordinates.size() >= 4 ? protocol::ColorBy::world_z
                                                         : protocol::ColorBy::magnitude;
}

std::vector<std::string> fields_of(const protocol::View& view, const data::DatasetInfo& info) {
  std::vector<std::string> fields;
  const auto add = [&](const std::string& name) {
    const bool is_known = std::find(fields.begin(), fields.end(), name) != fields.end();
    if (!is_known && info.find(name) != nullptr) fields.push_back(name);
  };
  const protocol::FieldChoice& lines = view.vector.field;
  if (lines.kind == protocol::FieldChoice::Kind::named) add(lines.name);
  if (lines.kind == protocol::FieldChoice::Kind::dataset_default) {
    const data::FieldInfo* const first = default_vector(info);
    if (first != nullptr) add(first->name);
  }
  if (view.vector.color.by == protocol::ColorBy::scalar && view.vector.color.field) {
    add(*view.vector.color.field);
  }
  if (view.scalars) {
    for (const protocol::ScalarView& scalar : *view.scalars) add(scalar.field);
  } else {
    for (const std::string& name : default_scalars(info)) add(name);
  }
  for (const std::string& name : surface_fields(view)) add(name);
  if (view.geometry.height_field) add(*view.geometry.height_field);
  for (const protocol::FilterView& filter : view.region.where) add(filter.field);
  return fields;
}

}  // namespace windsplat::scene
