// The samples that a scene draws: their places, neighbours and media.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>

#include "server/frame/medium_sample.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

using Index = std::array<int, 3>;

struct Mean {
  double sum = 0;
  double weight = 0;
  void add(double value, double its_weight) {
    sum += its_weight * value;
    weight += its_weight;
  }
  [[nodiscard]] double value() const { return weight > 0 ? sum / weight : 0; }
};

// The scene must outlive it.
class DrawnSamples {
 public:
  explicit DrawnSamples(const scene::Scene& scene);

  [[nodiscard]] const scene::Scene& scene() const { return scene_; }
  [[nodiscard]] std::int64_t count() const { return count_; }
  // Indices of the first sample and of the one after the last; those of a slice are its layer.
  [[nodiscard]] const Index& low() const { return low_; }
  [[nodiscard]] const Index& high() const { return high_; }
  [[nodiscard]] bool contains(const Index& i) const;
  [[nodiscard]] std::size_t number(const Index& i) const;  // in a field
  [[nodiscard]] glm::dvec3 place(const Index& i) const;    // world units
  [[nodiscard]] std::optional<Index> neighbour(const Index& i, std::size_t a, int step) const;
  [[nodiscard]] double edge(const Index& i, std::size_t a) const;  // of its cell, world units
  [[nodiscard]] Medium medium(const Index& i) const;

 private:
  const scene::Scene& scene_;
  Index low_{0, 0, 0};
  Index high_;
  std::int64_t count_ = 1;
};

}  // namespace windsplat::frame
