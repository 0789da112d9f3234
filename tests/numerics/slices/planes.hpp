// Datasets of known values, and views of planes through them.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <glm/vec3.hpp>
#include <memory>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/scene/lattice.hpp"
#include "tests/unit/scene/fake.hpp"

namespace windsplat::scene {

inline constexpr std::array<int, 3> box_dims{9, 7, 5};

// Axes in one unit, so that the world is a scaled copy: uneven ones, or spacings of 1, 1 and 2.
inline data::Grid box_grid(bool uneven) {
  data::Grid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> at;
    for (int i = 0; i < box_dims[a]; ++i) {
      at.push_back((a == 2 ? 2.0 : 1.0) * (i + (uneven ? 0.3 * std::sin(2.0 * i) : 0.0)));
    }
    grid.axes[a] = axis(data::AxisKind::cartesian, "km", std::move(at));
  }
  return grid;
}

using Value = std::function<double(const glm::dvec3& at)>;  // at world positions

// A wind with components v, v + 1 and v + 2 and a scalar of value v. Positions are those of the
// default placement.
inline std::unique_ptr<data::Dataset> dataset_with(const data::Grid& grid, const Value& value) {
  class Source final : public data::Source {
   public:
    Source(data::Grid grid, Value value)
        : fake_(std::move(grid), {wind_info(), scalar_info("cloud", "1")}, 1),
          value_(std::move(value)),
          lattice_(place_lattice(fake_.info().grid, {}).value()) {}
    [[nodiscard]] const data::DatasetInfo& info() const override { return fake_.info(); }
    Result<data::Volume> read(std::size_t field, std::size_t step) override {
      auto volume = fake_.read(field, step).value();
      std::size_t n = 0;
      for (const double z : lattice_.positions[2]) {
        for (const double y : lattice_.positions[1]) {
          for (const double x : lattice_.positions[0]) {
            for (int c = 0; c < volume.components; ++c) {
              volume.values[static_cast<std::size_t>(c) * volume.samples() + n] =
                  static_cast<float>(value_({x, y, z}) + c);
            }
            ++n;
          }
        }
      }
      data::finish_volume(volume);
      return volume;
    }

   private:
    FakeSource fake_;
    Value value_;
    Lattice lattice_;
  };
  return dataset_of(std::make_unique<Source>(grid, value));
}

inline double linear(const glm::dvec3& at) { return 2 + 0.7 * at.x - 0.4 * at.y + 1.1 * at.z; }

inline protocol::View plane_view(const protocol::Vec3& point, const protocol::Vec3& normal) {
  protocol::View view;
  view.geometry.plane = protocol::PlaneView{point, normal};
  view.vector.min_magnitude = 0;
  view.image.width = 120;
  view.image.height = 90;
  view.method.detail = protocol::Detail::full;
  view.scalars.emplace();
  view.scalars->emplace_back().field = "cloud";
  view.scalars->front().extinction = {{0, 1}, {4, 3}};
  view.scalars->front().min_optical_depth = 0;
  return view;
}

inline glm::dvec3 place(const Scene& scene, std::size_t n) {
  const auto& at = scene.lattice.places->at(n);
  return {at[0], at[1], at[2]};
}

}  // namespace windsplat::scene
