// Default ranges, colours and media of a view, derived from the fields of a dataset: robust
// quantiles rounded to readable numbers, and the scalars to show as media.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/volume.hpp"
#include "server/scene/rates.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// The smallest of 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10 times a power of ten that is >= value;
// value > 0.
double nice_above(double value);

// Low and high quantiles (0..1) of the values of a scalar or the magnitudes of a vector without
// masked samples, from at most 2^15 evenly distributed samples. {0, 0} if all are masked.
protocol::Range quantiles(const data::Volume& volume, double low, double high,
                          const std::optional<Slice>& slice = std::nullopt);

// The magnitude that 98 % of the unmasked samples do not exceed, or, if that is greater, the one
// below which a quarter of the sum of all magnitudes lies (of a flow in a small part of the box).
// From at most 2^15 samples, the 32 greatest of which are not summed unless all others are 0.
double magnitude_of_nearly_all(const data::Volume& volume);

// [0, top], with top the magnitude of nearly all samples, so that lines of about 2 % reach their
// full length.
protocol::Range default_magnitude_range(const data::Volume& volume);

// The share of unmasked samples whose magnitude is smaller, from at most 2^15 of them.
double hidden_share(double min_magnitude, const data::Volume& volume);

// The magnitude up to which colours reach by default: the greatest of the field, rounded up; where
// that is more than 2.5 times as great as all but 2 % of the samples, that many times or all but
// one in a thousand, whichever is less, since the few would keep most of the map for themselves.
// 0 if every sample is masked or 0.
double default_color_top(const data::Volume& volume);

// Magnitudes from slightly below the weakest line drawn to `top`, or to the top of the magnitude
// range if that is greater.
protocol::Range default_magnitude_colors(const protocol::VectorView& vector, double top);

// World heights that contain most of the drawn lines, with the lower end extended so that no line
// has the darkest colours of a map.
protocol::Range default_height_range(const protocol::VectorView& vector, const data::Volume& volume,
                                     const Lattice& lattice);

// The rise of lines from tail to head (LineColor::rise): [-r, r], with r such
// that about 2 % of the drawn lines rise or sink by more. The range of their full length if none
// rises. `vector` is completed but for the colours. For a slice, only its own lines count.
protocol::Range default_rise_range(const protocol::VectorView& vector,
                                   const ComponentFactors& factors, const data::Volume& volume,
                                   const std::optional<Slice>& slice);

// Default appearance of a kind of scalar.
struct ScalarStyle {
  const char* map;
  double clear_below;  // fraction of the range without extinction
  double opacity;      // optical depth at the top of the range through the shortest edge of the box
  bool fraction;       // bounded by 0 and 1 or 100 %
  bool transparent = true;  // its depth is seen through it (transparent_extinction)
  bool generic = false;     // nothing is known of which values matter
};
ScalarStyle scalar_style(const data::FieldInfo& field);

// The vector field shown by default: the first one, or in its place the conversion that has its
// horizontal components and the same unit for all: magnitudes of m/s and Pa/s mean nothing. Null:
// there is none.
const data::FieldInfo* default_vector(const data::DatasetInfo& info);

// Whether a dataset is a map: one layer of scalars, without a vector field.
bool is_map(const data::DatasetInfo& info);

// The colour map of a scalar.
std::string default_map(const data::FieldInfo& field, const data::DatasetInfo& info);

// Names of the scalars shown by default: the best match of a cloud or density, and solid bodies in
// the flow; in a dataset without a vector field at least the first scalar; of a map the first.
std::vector<std::string> default_scalars(const data::DatasetInfo& info);

// The fields of a dataset that a view, completed or not, may load: without duplicates, and without
// those that do not exist. Loads nothing.
std::vector<std::string> fields_of(const protocol::View& view, const data::DatasetInfo& info);

protocol::Range default_scalar_range(const data::FieldInfo& field, const data::Volume& volume);

// Dense parts are nearly opaque through the shortest edge of the box; in a slice through its layer.
// A map is opaque everywhere, so that only masked samples are dark.
std::vector<std::array<double, 2>> default_extinction(const data::FieldInfo& field,
                                                      const protocol::Range& range,
                                                      const Lattice& lattice,
                                                      const std::optional<Slice>& slice, bool map);

// Whether the media of a view are drawn as a map: those of a map, and of a slice or plane in which
// they hide no lines, because it has none or they are laid over the media.
bool draws_map(const protocol::View& view, const data::DatasetInfo& info);

// The default: by height if the unit of the vertical axis differs from that of the horizontal ones
// (as in the atmosphere), otherwise by magnitude. By magnitude in a slice or plane, whose lines are
// seen where they are.
protocol::ColorBy default_color_by(const data::Grid& grid, const std::optional<Slice>& slice);

}  // namespace windsplat::scene
