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

// Has one sample along `axis`. The lattice of the data, `whole`, must outlive it and what is
// derived from it, unless `owner` keeps it.
struct Section {
  const Lattice* whole = nullptr;
  std::shared_ptr<const void> owner;
  // Identify the places of the samples of the data among those of the dataset, and the plane.
  std::vector<double> placement;
  std::string heights;  // name of the height field, if there is one
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
  // Time that sampling took so far, of all copies, in microseconds.
  std::shared_ptr<std::int64_t> sampling_us = std::make_shared<std::int64_t>(0);
};

// Takes the same time for any number of samples. Errors: invalid at /geometry/plane.
Result<Section> make_section(const protocol::GeometryView& geometry, const Lattice& whole);

// The box is that of the whole grid. The places of the samples, unless they are on a rectilinear
// lattice, are kept by the dataset. Errors: those of Dataset::auxiliary().
Result<Lattice> lattice_of(const Section& section, data::Dataset& dataset);
// The variant under which the places are kept; empty: there are none.
std::string places_of(const Section& section);

// The values of an array that is indexed by a sample along an axis, along a layer.
std::vector<double> along_section(const Section& section, int axis, std::vector<double> values);

// A field of that many components interpolated linearly along each axis. In the outer half of the
// outermost cells it has their value; outside of the box, and where a sample with a share in it is
// masked, it is masked. Computed on several threads.
data::Derivation sampled(const Section& section, int components);

// The same for the vectors of a plane, along its own directions: with the magnitude of the data,
// and the direction in which the factors draw them.
data::Derivation sampled_vectors(const Section& section, const ComponentFactors& factors);

// What determines the colour of a plane's lines, for line colours that depend on the axes: world_z,
// rise (the position on the map) or direction. `layer` has length, magnitude range and colours.
data::Derivation sampled_colors(const Section& section, const ComponentFactors& factors,
                                const VectorLayer& layer);

}  // namespace windsplat::scene
