// Samples for defaults from a stored level, of a field that does not fit into memory.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/place.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// A volume with the numbers of components of its field, and what places its samples.
struct DefaultSamples {
  std::shared_ptr<const data::Volume> volume;
  std::array<int, 3> halvings{0, 0, 0};
  // Of a view, for these samples.
  [[nodiscard]] Lattice lattice(const Lattice& whole) const;
  [[nodiscard]] std::optional<Slice> slice(const std::optional<Slice>& whole) const;
};

// Samples of the coarsest stored level that has enough of them for defaults, with the range of the
// field: drawn ones of a vector; of a scalar one of the two values, each as often as its share.
// nullopt: the field fits into memory, or has no levels. Errors: those of loading.
Result<std::optional<DefaultSamples>> stored_samples(data::Dataset& dataset,
                                                     const std::string& field, std::size_t step);

// The default stride of lines of vectors that do not fit into memory: at most `stride`, or the next
// greater one of which the middles of kernels are stored, so that lines are drawn from these;
// `stride` if they fit, or have no levels.
int stored_stride(int stride, const std::string& field, const data::Dataset& dataset);

}  // namespace windsplat::scene
