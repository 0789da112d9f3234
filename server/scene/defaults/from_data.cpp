#include "server/scene/defaults/from_data.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "server/scene/camera.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/defaults/first_step.hpp"
#include "server/scene/defaults/opacity.hpp"
#include "server/scene/detail.hpp"
#include "server/scene/difference/difference.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/rates.hpp"
#include "server/scene/refusal.hpp"
#include "server/scene/section.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"

namespace windsplat::scene {

namespace {

using protocol::ColorBy;
using protocol::FieldChoice;
using protocol::Range;
using protocol::View;

std::vector<double> numbers_of(const Range& range) { return {range.begin(), range.end()}; }

// Placement and slice as part of a cache key.
std::vector<double> numbers_of(const Lattice& lattice, const std::optional<Slice>& slice) {
  std::vector<double> out{slice ? slice->axis + 1.0 : 0.0,
                          slice ? static_cast<double>(slice->sample) : 0.0};
  for (int a = 0; a < 3; ++a) {
    out.push_back(lattice.box_min[a]);
    out.push_back(lattice.box_max[a]);
  }
  out.insert(out.end(), lattice.positions[2].begin(), lattice.positions[2].end());
  return out;
}

Result<void> complete_magnitudes(View& view, const Placed& placed,
                                 const std::optional<Slice>& slice, data::Dataset& dataset) {
  const Lattice& lattice = placed.lattice;
  protocol::VectorView& vector = view.vector;
  const bool named = vector.field.kind == FieldChoice::Kind::named;
  const std::string& field = vector.field.name;
  if (!vector.magnitude_range && named) {
    const auto range = from_first_step(
        dataset, "magnitudes", field, {},
        [](const DefaultSamples& of) { return numbers_of(default_magnitude_range(*of.volume)); });
    if (!range) return range.error();
    vector.magnitude_range = Range{(*range)[0], (*range)[1]};
  }
  if (!vector.magnitude_range) vector.magnitude_range = Range{0, 1};
  const Range& range = *vector.magnitude_range;
  if (!vector.min_magnitude && named) {
    // The check uses default lines, so that it does not depend on the other keys of the view's
    // lines.
    const LineSpacing spacing = spacing_of(view.geometry, lattice);
    std::vector<double> arguments = numbers_of(lattice, slice);
    arguments.insert(arguments.end(), {range[0], range[1], spacing.length, 1.0 * spacing.stride});
    const auto least = from_first_step(
        dataset, "least magnitude", field, arguments,
        [&](const DefaultSamples& of) {
          return std::vector{
              default_min_magnitude(range, spacing, *of.volume, lattice, of.slice(slice))};
        },
        &placed);
    if (!least) return least.error();
    vector.min_magnitude = least->front();
  }
  if (!vector.min_magnitude) vector.min_magnitude = 0.0;
  return {};
}

Result<Range> first_scalar_range(const data::FieldInfo& field, data::Dataset& dataset) {
  const auto range =
      from_first_step(dataset, "range", field.name, {}, [&](const DefaultSamples& of) {
        return numbers_of(dataset.subtrahend() ? default_difference_range(*of.volume)
                                               : default_scalar_range(field, *of.volume));
      });
  if (!range) return range.error();
  return Range{(*range)[0], (*range)[1]};
}

Result<Range> first_rise_range(const View& view, const Placed& placed, data::Dataset& dataset) {
  const protocol::VectorView& vector = view.vector;
  const auto factors = component_factors(view, placed, *dataset.info().find(vector.field.name));
  if (!factors) return factors.error();
  const std::optional<Slice> slice = slice_of(view.geometry, placed.lattice);
  std::vector<double> arguments = numbers_of(placed.lattice, slice);
  arguments.insert(arguments.end(),
                   {*vector.length, *vector.min_magnitude, (*vector.magnitude_range)[1],
                    factors->scale.x, factors->scale.y, factors->scale.z});
  if (const auto& rates = factors->rates) {
    arguments.insert(arguments.end(), rates->x.begin(), rates->x.end());
    arguments.push_back(rates->y);
    arguments.insert(arguments.end(), rates->z.begin(), rates->z.end());
  }
  const auto range = from_first_step(
      dataset, "rises", vector.field.name, arguments,
      [&](const DefaultSamples& of) {
        ComponentFactors here = *factors;
        if (auto& rates = here.rates) {
          const auto& widths = placed.lattice.spacing;
          rates->x = coarsen_along(rates->x, widths[1], of.halvings[1]);
          rates->z = coarsen_along(rates->z, widths[2], of.halvings[2]);
        }
        return numbers_of(default_rise_range(vector, here, *of.volume, of.slice(slice)));
      },
      &placed);
  if (!range) return range.error();
  return Range{(*range)[0], (*range)[1]};
}

// A magnitude range that the view states is also that of the colours.
Result<Range> magnitude_colors(const protocol::VectorView& vector, bool is_range_given,
                               data::Dataset& dataset) {
  if (is_range_given || vector.field.kind != FieldChoice::Kind::named) {
    return default_magnitude_colors(vector, 0);
  }
  const auto top = from_first_step(
      dataset, "colour top", vector.field.name, {},
      [](const DefaultSamples& of) { return std::vector{default_color_top(*of.volume)}; });
  if (!top) return top.error();
  return default_magnitude_colors(vector, top->front());
}

// The range of the value that determines the colour. `is_range_given`: of magnitudes, by the view.
Result<Range> default_color_range(const View& view, bool is_range_given, const Placed& placed,
                                  const std::array<double, 2>& depths, data::Dataset& dataset) {
  const Lattice& lattice = placed.lattice;
  const protocol::VectorView& vector = view.vector;
  const bool lines = vector.field.kind == FieldChoice::Kind::named;
  switch (*vector.color.by) {
    case ColorBy::world_z: {
      if (!lines) return height_range(lattice);
      std::vector<double> arguments = numbers_of(lattice, std::nullopt);
      arguments.push_back(*vector.min_magnitude);
      const auto range = from_first_step(
          dataset, "heights", vector.field.name, arguments,
          [&](const DefaultSamples& of) {
            return numbers_of(default_height_range(vector, *of.volume, of.lattice(lattice)));
          },
          &placed);
      if (!range) return range.error();
      return Range{(*range)[0], (*range)[1]};
    }
    case ColorBy::screen_z:
      return Range{depths[0], depths[1]};
    case ColorBy::magnitude:
      return magnitude_colors(vector, is_range_given, dataset);
    case ColorBy::direction:
      return Range{0, 360};
    case ColorBy::scalar: {
      if (!lines) break;
      return first_scalar_range(*dataset.info().find(vector.color.field.value()), dataset);
    }
    case ColorBy::rise:
      return lines ? first_rise_range(view, placed, dataset)
                   : Result<Range>(Range{-*vector.length, *vector.length});
    case ColorBy::constant:
      break;
  }
  return Range{0, 1};
}

// Sets an extinction that follows from the values.
Result<void> make_transparent(protocol::ScalarView& scalar, const Range& range,
                              const Placed& placed, data::Dataset& dataset) {
  std::vector<double> arguments = numbers_of(placed.lattice, std::nullopt);
  arguments.insert(arguments.end(), range.begin(), range.end());
  const auto points = from_first_step(
      dataset, "extinction", scalar.field, arguments,
      [&](const DefaultSamples& of) {
        const data::FieldInfo& field = *dataset.info().find(scalar.field);
        std::vector<double> numbers;
        for (const auto& [value, extinction] : transparent_extinction(
                 scalar_style(field), range, *of.volume, of.lattice(placed.lattice))) {
          numbers.insert(numbers.end(), {value, extinction});
        }
        return numbers;
      },
      &placed);
  if (!points) return points.error();
  scalar.extinction.emplace();
  for (std::size_t n = 0; n + 1 < points->size(); n += 2) {
    scalar.extinction->push_back({(*points)[n], (*points)[n + 1]});
  }
  return {};
}

// Whether a medium has depth: more than one sample along each axis.
bool is_solid(const Lattice& lattice) {
  return std::all_of(lattice.dims.begin(), lattice.dims.end(), [](int n) { return n > 1; });
}

Result<void> complete_scalar(protocol::ScalarView& scalar, const Placed& placed,
                             const std::optional<Slice>& slice, bool map, data::Dataset& dataset) {
  const Lattice& lattice = placed.lattice;
  if (scalar.color.range && scalar.extinction) return {};
  const data::FieldInfo& field = *dataset.info().find(scalar.field);
  const auto range = first_scalar_range(field, dataset);
  if (!range) return range.error();
  if (!scalar.color.range) scalar.color.range = *range;
  if (scalar.extinction) return {};
  if (dataset.subtrahend()) {
    scalar.extinction = default_difference_extinction(field, *range, lattice, slice, map);
  } else if (slice || map || !is_solid(lattice) || !scalar_style(field).transparent) {
    scalar.extinction = default_extinction(field, *range, lattice, slice, map);
  } else {
    return make_transparent(scalar, *range, placed, dataset);
  }
  return {};
}

}  // namespace

LineSpacing spacing_of(const protocol::GeometryView& geometry, const Lattice& lattice) {
  constexpr double plane_strides = 5;
  if (geometry.plane) return {1, spaced_length(plane_strides, 1, lattice, std::nullopt)};
  return default_spacing(lattice, slice_of(geometry, lattice));
}

Result<void> complete_from_data(View& view, const Camera& camera, const Placed& placed,
                                data::Dataset& dataset) {
  const Lattice& lattice = placed.lattice;
  const std::optional<Slice> slice = slice_of(view.geometry, lattice);
  const bool is_range_given = view.vector.magnitude_range.has_value();
  if (auto ok = complete_magnitudes(view, placed, slice, dataset); !ok) return ok;
  if (!view.vector.color.range) {
    auto range =
        default_color_range(view, is_range_given, placed, view_depths(camera, lattice), dataset);
    if (!range) return range.error();
    view.vector.color.range = *range;
  }
  const bool map = draws_map(view, dataset.info());
  for (protocol::ScalarView& scalar : *view.scalars) {
    if (auto ok = complete_scalar(scalar, placed, slice, map, dataset); !ok) return ok;
  }
  for (protocol::SurfaceView& surface : view.surfaces) {
    const std::string field = color_field_of(surface);
    if (field.empty() || surface.color.range) continue;
    const auto range = first_scalar_range(*dataset.info().find(field), dataset);
    if (!range) return range.error();
    surface.color.range = *range;
  }
  return {};
}

}  // namespace windsplat::scene
