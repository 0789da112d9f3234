// A small dataset with known values that counts reads.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::scene {

inline data::Axis axis(data::AxisKind kind, const std::string& units,
                       std::vector<double> coordinates) {
  data::Axis out;
  out.name = "axis";
  out.units = units;
  out.kind = kind;
  out.coordinates = std::move(coordinates);
  return out;
}

inline data::Grid atmosphere_grid() {
  data::Grid grid;
  grid.axes = {axis(data::AxisKind::longitude, "degrees_east", {0, 10, 20, 30}),
               axis(data::AxisKind::latitude, "degrees_north", {-10, 0, 10}),
               axis(data::AxisKind::pressure, "hPa", {1000, 500, 250})};
  return grid;
}

inline data::FieldInfo scalar_info(const std::string& name, const std::string& units) {
  data::FieldInfo info;
  info.name = name;
  info.kind = data::FieldKind::scalar;
  info.components = {name};
  info.units = units;
  info.component_units = {units};
  info.dtype = "float32";
  return info;
}

inline data::FieldInfo wind_info(const std::string& vertical_unit = "m s-1") {
  data::FieldInfo info;
  info.name = "wind";
  info.kind = data::FieldKind::vector;
  info.components = {"u", "v", "w"};
  info.units = "m s-1";
  info.component_units = {"m s-1", "m s-1", vertical_unit};
  info.dtype = "float32";
  return info;
}

// Every sample n of component c at step s is n + 100 c + 1000 s, unless `constant` is set.
class FakeSource final : public data::Source {
 public:
  using Reads = std::map<std::string, int>;

  FakeSource(data::Grid grid, std::vector<data::FieldInfo> fields, int steps,
             std::shared_ptr<Reads> reads = nullptr)
      : reads_(std::move(reads)) {
    info_.id = "fake";
    info_.title = "A fake";
    info_.source = "fake.nc";
    info_.format = "fake";
    info_.digest = "1";
    info_.grid = std::move(grid);
    info_.fields = std::move(fields);
    for (int s = 0; s < steps; ++s) {
      info_.steps.push_back({static_cast<double>(s), std::to_string(s)});
    }
  }

  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }

  Result<data::Volume> read(std::size_t field, std::size_t step) override {
    if (reads_) ++(*reads_)[info_.fields[field].name + "@" + std::to_string(step)];
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(info_.fields[field].components.size());
    std::vector<float> samples;
    for (int c = 0; c < volume.components; ++c) {
      for (std::size_t n = 0; n < volume.samples(); ++n) {
        if (values) {
          samples.push_back(static_cast<float>(values(info_.fields[field].name, n)));
          continue;
        }
        const double ramp = static_cast<double>(n) + 100.0 * c + 1000.0 * static_cast<double>(step);
        samples.push_back(static_cast<float>(constant ? *constant : ramp));
      }
    }
    volume.values = std::move(samples);
    data::finish_volume(volume);
    return volume;
  }

  std::unique_ptr<double> constant;
  std::function<double(const std::string& field, std::size_t n)> values;

 private:
  data::DatasetInfo info_;
  std::shared_ptr<Reads> reads_;
};

inline std::unique_ptr<data::Dataset> dataset_of(std::unique_ptr<data::Source> source) {
  return std::make_unique<data::Dataset>(std::move(source), "fake", std::uint64_t{1} << 30U);
}

inline std::unique_ptr<data::Dataset> sample_dataset(const std::string& name,
                                                     std::array<int, 3> dims = {0, 0, 0}) {
  auto source = data::open_sample(name, dims);
  return std::make_unique<data::Dataset>(std::move(*source), name, std::uint64_t{1} << 32U);
}

// A completed view and its scene; the test fails if either fails.
inline Scene built(const protocol::View& view, data::Dataset& dataset) {
  auto full = complete(view, dataset);
  EXPECT_TRUE(full) << full.error().message;
  auto scene = build_scene(*full, dataset);
  EXPECT_TRUE(scene) << scene.error().message;
  return std::move(*scene);
}

}  // namespace windsplat::scene
