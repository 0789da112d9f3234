// The samples of a lattice that a picture may show. Camera + lattice -> boxes of samples.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "server/scene/scene.hpp"

namespace windsplat::scene {

// How far kernels reach beyond their positions.
struct Reach {
  std::array<double, 3> world{};
  double pixels = 0;  // in addition
};

// Boxes of units along each axis: the first, and the one after the last.
using Units = std::array<std::array<int, 2>, 3>;

// Finds the units of samples in sight, dividing boxes of them.
class Sight {
 public:
  Sight(const Camera& camera, const Lattice& level, const Reach& reach,
        const std::array<int, 3>& quantum);

  // The bounds of all in sight; the first unit if none is.
  [[nodiscard]] Units bounds() const;
  // The boxes of units of which all are in sight, of at most so many units; nullopt: of more. The
  // first unit if none is in sight.
  [[nodiscard]] std::optional<std::vector<Units>> boxes(std::size_t units_max) const;
  // Whether boxes that lie within the picture as a whole have more units than that.
  [[nodiscard]] bool has_within(std::size_t units) const;

 private:
  enum class Seen { none, partly, all };

  [[nodiscard]] Units all() const;

  // Calls add() with boxes of units, but for those that are left out: single units in sight, and
  // boxes that are within the picture as a whole.
  template <class LeftOut, class Add>
  void visit(const Units& units, const LeftOut& is_left_out, const Add& add) const;
  // As the engine culls: in sight unless every corner of the box of positions, widened by the reach
  // of kernels, is outside of the same plane. As a whole if none is outside of any.
  [[nodiscard]] Seen seen_of(const Units& units) const;

  const Camera& camera_;
  const Lattice& level_;
  const Reach reach_;
  const std::array<int, 3> quantum_;
  std::array<double, 2> edges_{};  // of the picture from its middle, at unit depth
};

}  // namespace windsplat::scene
