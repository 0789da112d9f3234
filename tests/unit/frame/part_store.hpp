// A store of a cloud and a wind with levels, and views of parts of it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/resident/dataset.hpp"
#include "tests/numerics/stored/stored_fields.hpp"

namespace windsplat::frame::of_store {

using data::Coarsening;

inline constexpr std::array<int, 3> dims{90, 75, 61};
inline constexpr std::uint64_t samples_bytes = std::uint64_t{90} * 75 * 61 * sizeof(float);
inline constexpr int levels = 4;

// With a hole, in every component.
inline data::Volume made(int components) {
  data::Volume out;
  out.dims = dims;
  out.components = components;
  std::vector<float> values;
  for (int c = 0; c < components; ++c) {
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) {
          const bool hole = i / 20 == 1 && j / 20 == 1 && k / 20 == 1;
          const double wave = std::sin(0.9 * i + c) + std::sin(1.1 * j) * std::cos(0.7 * k);
          const double value = components == 1 ? std::abs(wave) : wave;
          values.push_back(hole ? NAN : static_cast<float>(value));
        }
      }
    }
  }
  out.values = std::move(values);
  finish_volume(out);
  return out;
}

// A cloud and a wind, equal at both steps, on even axes or an uneven vertical one.
inline std::unique_ptr<data::Source> cloud_and_wind(bool uneven) {
  static const auto cloud = std::make_shared<const data::Volume>(made(1));
  static const auto wind = std::make_shared<const data::Volume>(made(3));
  data::DatasetInfo info;
  for (std::size_t a = 0; a < 3; ++a) {
    data::Axis& axis = info.grid.axes.at(a);
    axis.name = "xyz"[a];
    axis.units = "m";
    for (int n = 0; n < dims.at(a); ++n) {
      axis.coordinates.push_back(uneven && a == 2 ? 60.0 * n + n * n : 100.0 * n);
    }
  }
  info.fields.resize(2);
  info.fields[0].name = "cloud";
  info.fields[0].components = {"cloud"};
  info.fields[1].name = "wind";
  info.fields[1].kind = data::FieldKind::vector;
  info.fields[1].components = {"u", "v", "w"};
  info.steps.resize(2);
  return test::stored_fields(std::move(info), {cloud, wind}, levels);
}

inline data::Dataset store(std::uint64_t bytes, bool uneven = false) {
  return {cloud_and_wind(uneven), "store", bytes};
}

class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  double within(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }
  int below(int count) { return static_cast<int>(engine_() % static_cast<std::uint32_t>(count)); }
  protocol::Vec3 point(double size) {
    return {within(-size, size), within(-size, size), within(-size, size)};
  }

 private:
  std::mt19937 engine_;
};

// A view of a corner or of much of the data from outside or inside, with any layers.
inline protocol::View random_view(Random& random) {
  protocol::View view;
  view.dataset = "store";
  view.image.width = 20 + random.below(60);
  view.image.height = 20 + random.below(60);
  const bool perspective = random.below(3) > 0;
  view.camera.projection =
      perspective ? protocol::Projection::perspective : protocol::Projection::orthographic;
  view.camera.eye = random.point(random.below(2) == 0 ? 0.5 : 1.5);
  view.camera.target = random.point(0.5);
  view.camera.fov_y = std::exp(random.within(std::log(2), std::log(50)));
  if (!perspective) view.camera.height = std::exp(random.within(std::log(0.02), std::log(0.8)));
  view.scalars.emplace();
  const int layers = random.below(3);
  if (layers > 0) {
    protocol::ScalarView& medium = view.scalars->emplace_back();
    medium.field = "cloud";
    medium.color.range = {0.0, 2.0};
    medium.extinction = {{{0.2, 0.0}, {2.0, random.within(0.5, 40)}}};
    medium.min_optical_depth = random.below(2) == 0 ? 0 : 1e-2;
  }
  protocol::VectorView& lines = view.vector;
  lines.field = {protocol::FieldChoice::Kind::none, ""};
  if (layers == 1) return view;
  lines.field = {protocol::FieldChoice::Kind::named, "wind"};
  lines.stride = std::array{1, 2, 3, 4, 8}.at(static_cast<std::size_t>(random.below(5)));
  lines.length = random.within(0.005, 0.1);
  lines.magnitude_range = {0.0, 2.0};
  lines.min_magnitude = random.below(2) == 0 ? 0.0 : 0.4;
  lines.color.by = std::array{protocol::ColorBy::world_z, protocol::ColorBy::screen_z,
                              protocol::ColorBy::rise, protocol::ColorBy::magnitude}
                       .at(static_cast<std::size_t>(random.below(4)));
  return view;
}

inline protocol::View of_one_voxel() {
  protocol::View view;
  view.dataset = "store";
  view.image = {40, 30};
  view.camera.projection = protocol::Projection::orthographic;
  view.camera.eye = {0.1, -2, 0.05};
  view.camera.target = {0.1, 0, 0.05};
  view.camera.height = 0.004;
  view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  protocol::ScalarView& medium = view.scalars.emplace().emplace_back();
  medium.field = "cloud";
  medium.color.range = {0.0, 2.0};
  medium.extinction = {{{0.0, 0.1}, {2.0, 20.0}}};
  return view;
}

}  // namespace windsplat::frame::of_store
