// A slice that is not a layer of the data: a layer between two layers, or an oblique plane.
// Geometry and lattice of a dataset -> the lattice of its samples, and the fields interpolated on
// it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/scene/rates.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Largest number of samples of a plane; they take up to 48 bytes each.
constexpr std::int64_t plane_samples_max = std::int64_t{1} << 22U;

// Whether the view draws samples between those of the data.
bool is_section(const protocol::GeometryView& geometry);

// Has one sample along `axis`. The lattice of the data, `whole`, must outlive it.
struct Section {
  const Lattice* whole = nullptr;
  int axis = 2;
  std::array<int, 3> dims{1, 1, 1};
  double index = 0;  // of a layer, in samples of the data
  // A plane: its samples lie `pitch` apart along two of these directions, of which along[axis] is
  // the normal and the others are as close to the axes as possible; pitch[axis] is the thickness
  // of a cell.
  bool oblique = false;
  std::array<glm::dvec3, 3> along{};  // orthonormal
  glm::dvec3 first{0, 0, 0};
  std::array<double, 3> pitch{};
};

// Takes the same time for any number of samples. Errors: invalid at /geometry/plane.
Result<Section> make_section(const protocol::GeometryView& geometry, const Lattice& whole);

// The box is that of the whole grid. Errors: out_of_memory.
Result<Lattice> lattice_of(const Section& section, const data::Dataset& dataset);

// The values of an array that is indexed by a sample along an axis, along a layer.
std::vector<double> along_section(const Section& section, int axis, std::vector<double> values);

// A field interpolated linearly along each axis. In the outer half of the outermost cells it has
// their value; outside of the box, and where a sample with a share in it is masked, it is masked.
// Shared and counted as a level. Errors: those of Dataset::derived().
Result<std::shared_ptr<const data::Volume>> sampled(const Section& section, data::Dataset& dataset,
                                                    const std::string& field, std::size_t step);

// The same for the vectors of a plane, along its own directions: with the magnitude of the data,
// and the direction in which the factors draw them.
Result<std::shared_ptr<const data::Volume>> sampled_vectors(const Section& section,
                                                            data::Dataset& dataset,
                                                            const std::string& field,
                                                            std::size_t step,
                                                            const ComponentFactors& factors);

// What determines the colour of a plane's lines, for line colours that depend on the axes: world_z,
// rise (the position on the map) or direction. `layer` has length, magnitude range and colours.
Result<std::shared_ptr<const data::Volume>> sampled_colors(
    const Section& section, data::Dataset& dataset, const std::string& field, std::size_t step,
    const ComponentFactors& factors, const VectorLayer& layer);

}  // namespace windsplat::scene
