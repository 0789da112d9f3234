// The samples that a scene draws: their places, neighbours and media.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "server/engine/reference/kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

using Index = std::array<int, 3>;

// The medium at a sample: value -> extinction and colour by the transfer functions of the layers.
inline double extinction_at(const scene::ScalarLayer& layer, double value) {
  if (layer.extinction.empty() || std::isnan(value)) return 0;
  return engine::reference::table_extinction(layer, value);
}

inline glm::dvec3 color_at(const scene::ColorTable& table, double value) {
  if (table.entries.empty() || std::isnan(value)) return {0, 0, 0};
  const auto c = engine::reference::table_color(table, value);
  return {c[0], c[1], c[2]};
}

struct Medium {
  double extinction = 0;
  glm::dvec3 emission{0, 0, 0};  // extinction times colour
  [[nodiscard]] glm::dvec3 color() const {
    return extinction > 0 ? emission / extinction : emission;
  }
  // bright: factor of the colour.
  void add(const scene::ScalarLayer& layer, double value, double share, double bright) {
    const double rho = share * extinction_at(layer, value);
    extinction += rho;
    emission += rho * bright * color_at(layer.color, value);
  }
};

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
  // Of a grid of boxes, those beyond the end of the data count too.
  [[nodiscard]] std::int64_t count() const { return count_; }
  // The n-th of these; nullopt: it lies beyond the end of the data.
  [[nodiscard]] std::optional<Index> at(std::int64_t n) const;
  // Indices of the first sample and of the one after the last; those of a slice are its layer, of a
  // part those that it holds.
  [[nodiscard]] const Index& low() const { return low_; }
  [[nodiscard]] const Index& high() const { return high_; }
  [[nodiscard]] bool contains(const Index& i) const;
  [[nodiscard]] std::size_t number(const Index& i) const;  // in a field
  // In that of the vectors; where it holds the middles of kernels alone, of the sample's kernel.
  [[nodiscard]] std::size_t vector_number(const Index& i) const;
  [[nodiscard]] glm::dvec3 place(const Index& i) const;  // world units
  [[nodiscard]] std::optional<Index> neighbour(const Index& i, std::size_t a, int step) const;
  // The sample of the next line along an axis, from that of a line; at the end of the axis of the
  // one before.
  [[nodiscard]] std::optional<Index> neighbour_line(const Index& i, std::size_t a) const;
  // The sample of the kernel with a line that represents a sample.
  [[nodiscard]] Index line_of(const Index& i) const;
  [[nodiscard]] double edge(const Index& i, std::size_t a) const;  // of its cell, world units
  [[nodiscard]] Medium medium(const Index& i) const;
  // Factors of colours at a sample by the light of the scene.
  [[nodiscard]] double brightness(const scene::ScalarLayer& layer, const Index& i) const;
  [[nodiscard]] double line_brightness(const Index& i) const;

 private:
  const scene::Scene& scene_;
  Index low_{0, 0, 0};
  Index high_{0, 0, 0};
  std::int64_t count_ = 1;
  std::vector<data::Box> boxes_;  // empty: the scene has all samples of a box
};

}  // namespace windsplat::frame
