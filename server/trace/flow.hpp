// A vector field on a lattice -> its flow in index coordinates: samples have integer coordinates,
// so that evenly spaced, uneven and curved lattices are one case.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace windsplat::trace {

// Components at a time, as those of Flow.
struct Frame {
  double time = 0;
  std::array<const float*, 3> components{};
};

// Views of the field and its lattice; x fastest. Between samples, positions and components are
// interpolated linearly along each axis. The domain reaches half a cell beyond the outermost
// samples; there components are constant, and positions continue linearly. A place belongs to its
// nearest sample: where that is masked, there is no flow; elsewhere masked samples have no share.
struct Flow {
  std::array<int, 3> dims{1, 1, 1};
  std::array<const float*, 3> components{};  // null: zero. Masked: NaN in the first
  // A field that changes: frames of ascending times, linear between them and constant beyond, in
  // place of `components`. What is masked in one of two frames is masked between them.
  std::span<const Frame> frames;
  // Factors from components to the drawn vector, whose components lie along the edges of the cell.
  glm::dvec3 scale{1, 1, 1};
  std::span<const double> rate_x;  // by y; empty: no rates
  double rate_y = 1;
  std::span<const double> rate_z;                    // by z
  std::array<std::span<const double>, 3> positions;  // ascending, world units
  std::array<std::span<const double>, 3> spacing;    // widths of cells, world units
  const std::array<float, 3>* places = nullptr;      // curved: the position of each sample
  // Number of samples along x that close a circle; 0: x does not close. On a flat lattice a place
  // after `turn` turns is where that of the first turn is.
  int around = 0;

  // In the domain, and the nearest sample is not masked.
  [[nodiscard]] bool holds(const glm::dvec3& index, double time = 0) const;
  // Within the bounds of the lattice.
  [[nodiscard]] bool bounds(const glm::dvec3& index) const;
  // World position.
  [[nodiscard]] glm::dvec3 place(const glm::dvec3& index) const;
  // Number of the nearest sample, x fastest.
  [[nodiscard]] std::uint32_t nearest(const glm::dvec3& index) const;
  // Turns of a flat lattice that closes, at the edges of its cells; otherwise 0.
  [[nodiscard]] int turn(const glm::dvec3& index) const;
  // The same place, or where it is beyond a turn the end of that turn.
  [[nodiscard]] glm::dvec3 within_turn(const glm::dvec3& index, int turn) const;
  // World volume of a cell of the lattice at a place.
  [[nodiscard]] double cell_volume(const glm::dvec3& index) const;
};

// The flow at a place.
struct Motion {
  glm::dvec3 vector{0, 0, 0};  // components of the data
  double magnitude = 0;        // of the data
  double speed = 0;            // length of the drawn vector; 0: no direction
  glm::dvec3 drawn{0, 0, 0};   // unit vector along the edges of the cell
  glm::dvec3 along{0, 0, 0};   // change of index per unit of world length along the flow
};
// False where all samples with a share are masked, or the cell is degenerate (at a pole).
bool motion_at(const Flow& flow, const glm::dvec3& index, Motion& out, double time = 0);

// A scalar of the same lattice, interpolated in the same way; NaN where every sample with a share
// is masked.
double value_at(const Flow& flow, const float* values, const glm::dvec3& index);

}  // namespace windsplat::trace
