// Formulas -> samples -> a dataset.
#include "server/study/extremes/samples.hpp"

#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::study {

namespace {

constexpr std::uint64_t resident_max = 64ULL << 20;

data::Axis axis_of(const char* name, const char* units, data::AxisKind kind) {
  data::Axis axis;
  axis.name = name;
  axis.units = units;
  axis.kind = kind;
  return axis;
}

data::FieldInfo field_of(const char* name, std::vector<std::string> components, const char* units) {
  data::FieldInfo info;
  info.name = name;
  info.kind = components.size() > 1 ? data::FieldKind::vector : data::FieldKind::scalar;
  info.units = units;
  info.component_units.assign(components.size(), units);
  info.components = std::move(components);
  info.dtype = "float32";
  return info;
}

class SampleSource final : public data::Source {
 public:
  explicit SampleSource(Samples samples) {
    info_.id = "extremes";
    info_.title = "Extreme cases";
    info_.source = "study";
    info_.format = "sample";
    info_.digest = "study:extremes:v1";
    info_.grid = std::move(samples.grid);
    info_.fields = {field_of("density", {"density"}, "1"),
                    field_of("flow", {"u", "v", "w"}, "m s-1")};
    values_ = {std::move(samples.density), std::move(samples.flow)};
    if (!samples.height.empty()) {
      info_.fields.push_back(field_of("height", {"height"}, "m"));
      values_.push_back(std::move(samples.height));
    }
    info_.steps.push_back({0, "0"});
  }

  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }

  Result<data::Volume> read(std::size_t index, std::size_t step) override {
    WINDSPLAT_CHECK(index < values_.size() && step == 0);
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(info_.fields[index].components.size());
    std::vector<float> values = values_[index];
    volume.values = std::move(values);
    data::finish_volume(volume);
    return volume;
  }

 private:
  data::DatasetInfo info_;
  std::vector<std::vector<float>> values_;
};

}  // namespace

data::Grid box_grid(const std::array<int, 3>& dims, const std::array<double, 3>& spacing) {
  data::Grid grid;
  constexpr std::array<const char*, 3> names{"x", "y", "z"};
  for (std::size_t a = 0; a < 3; ++a) {
    grid.axes.at(a) = axis_of(names.at(a), "m", data::AxisKind::cartesian);
    for (int i = 0; i < dims.at(a); ++i) {
      grid.axes.at(a).coordinates.push_back(i * spacing.at(a));
    }
  }
  return grid;
}

data::Grid globe_grid(const std::array<int, 3>& dims, bool poles) {
  data::Grid grid;
  grid.axes = {axis_of("longitude", "degrees_east", data::AxisKind::longitude),
               axis_of("latitude", "degrees_north", data::AxisKind::latitude),
               axis_of("height", "m", data::AxisKind::height)};
  const double highest = poles ? 90 : 60;
  for (int i = 0; i < dims[0]; ++i) grid.axes[0].coordinates.push_back(i * 360.0 / dims[0]);
  for (int i = 0; i < dims[1]; ++i) {
    grid.axes[1].coordinates.push_back(-highest + i * 2 * highest / (dims[1] - 1));
  }
  for (int i = 0; i < dims[2]; ++i) grid.axes[2].coordinates.push_back(1000.0 * i);
  return grid;
}

Samples waves(data::Grid grid) {
  Samples samples;
  samples.grid = std::move(grid);
  const auto dims = samples.grid.dims();
  const auto each = [&dims](std::vector<float>& out, const auto& value) {
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) {
          out.push_back(static_cast<float>(
              value((i + 0.5) / dims[0], (j + 0.5) / dims[1], (k + 0.5) / dims[2])));
        }
      }
    }
  };
  each(samples.density, [](double x, double y, double z) {
    return 0.6 + 0.4 * std::sin(5 * x + 1) * std::cos(4 * y - 1) * std::sin(3 * z + 1);
  });
  for (int c = 0; c < 3; ++c) {
    each(samples.flow, [c](double x, double y, double z) {
      return std::cos(4 * x + 2 * c) * std::sin(3 * y + c + 1) * std::cos(2 * z - c);
    });
  }
  return samples;
}

std::shared_ptr<data::Dataset> make_dataset(Samples samples) {
  return std::make_shared<data::Dataset>(std::make_unique<SampleSource>(std::move(samples)),
                                         "extremes", resident_max);
}

}  // namespace windsplat::study
