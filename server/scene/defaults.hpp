// What a dataset's fields suggest for a first picture: robust ranges rounded to nice numbers, and
// which scalar is a medium worth looking through.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The smallest of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10 times a power of ten that is >= value;
// value > 0.
double nice_above(double value);

// Low and high quantiles (0..1) of a scalar's values or a vector's magnitude, masked samples left
// out; from at most 2^15 samples spread evenly. {0, 0} when everything is masked.
protocol::Range quantiles(const data::Volume& volume, double low, double high,
                          const std::optional<Slice>& slice = std::nullopt);

// [0, top]: top so that a few per cent of the lines reach their full length.
protocol::Range default_magnitude_range(const data::Volume& volume);

// The magnitude that so many lines exceed as cover the box's picture about `coverage` times when
// each is as long and wide as the view says: fewer leave it bare, more hide the flow behind their
// nearest layer. At least a hundredth of the range's top. Of a slice only its own lines and
// area count.
double default_min_magnitude(const protocol::VectorView& vector, const data::Volume& volume,
                             const Lattice& lattice, const std::optional<Slice>& slice);

// Magnitudes from a little below the weakest line that is drawn to the range's top.
protocol::Range default_magnitude_colors(const protocol::VectorView& vector);

// World heights between which most of the drawn lines lie, the lower end moved down so that no line
// takes the darkest colours of a map.
protocol::Range default_height_range(const protocol::VectorView& vector, const data::Volume& volume,
                                     const Lattice& lattice);

// How a kind of scalar is shown.
struct ScalarStyle {
  const char* map;
  double clear_below;  // of the range: no extinction up to here
  double opacity;      // optical depth of a full medium through the box's shortest edge
  bool fraction;       // bounded by 0 and 1 or 100 %
};
ScalarStyle scalar_style(const data::FieldInfo& field);

// Names of the scalars shown by default: the best cloud-like or density-like one, and bodies that
// the flow goes round; without a vector field the first scalar if none is alike.
std::vector<std::string> default_scalars(const data::DatasetInfo& info);

protocol::Range default_scalar_range(const data::FieldInfo& field, const data::Volume& volume);

// Dense parts are nearly opaque through the box's shortest edge; a slice through itself.
std::vector<std::array<double, 2>> default_extinction(const data::FieldInfo& field,
                                                      const protocol::Range& range,
                                                      const Lattice& lattice,
                                                      const std::optional<Slice>& slice);

// About five grid spacings a stride, in a slice of those within it.
double default_length(const Lattice& lattice, int stride, const std::optional<Slice>& slice);

// By height where the vertical is an axis of its own kind (winds in an atmosphere), else magnitude.
protocol::ColorBy default_color_by(const data::Grid& grid);

}  // namespace windsplat::scene
