// Formulas -> density and flow of the blobs.
#include "server/study/blobs.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::study {

namespace {

struct Blob {
  double x, y, z, radius, height;
};

// Wide enough for the grid: a radius is at least three samples.
constexpr std::array<Blob, 5> blobs{{{-0.35, -0.3, -0.2, 0.42, 0.9},
                                     {0.4, 0.1, 0.25, 0.36, 1.0},
                                     {-0.1, 0.5, 0.4, 0.3, 0.7},
                                     {0.2, -0.45, 0.45, 0.28, 0.8},
                                     {0.05, 0.2, -0.5, 0.38, 0.6}}};

double density(double x, double y, double z) {
  double sum = 0;
  for (const Blob& b : blobs) {
    const double dx = x - b.x;
    const double dy = y - b.y;
    const double dz = z - b.z;
    sum += b.height * std::exp(-(dx * dx + dy * dy + dz * dz) / (b.radius * b.radius));
  }
  return std::min(sum, 1.0);
}

std::array<double, 3> flow(double x, double y, double z) {
  const double cx = x - 0.25 * std::sin(2 * z);  // the axis tilts
  const double cy = y - 0.25 * std::cos(2 * z);
  const double r2 = cx * cx + cy * cy;
  // Modulated, so that the fastest samples are spread over the volume.
  const double wave = std::sin(6 * x + 1) * std::sin(6 * y + 2) * std::sin(6 * z + 3);
  const double gust = 0.25 + 0.75 * wave * wave;
  const double swirl = 1.6 * gust * std::exp(-1.2 * r2);
  return {-swirl * cy, swirl * cx, 0.7 * gust * std::exp(-2 * r2)};
}

data::Axis edge(std::string name) {
  data::Axis axis;
  axis.name = std::move(name);
  axis.units = std::string(1, 'm');
  axis.kind = data::AxisKind::cartesian;
  for (int i = 0; i < blob_samples; ++i) {
    axis.coordinates.push_back((2.0 * i + 1) / blob_samples - 1);
  }
  return axis;
}

data::FieldInfo field(std::string name, data::FieldKind kind, std::vector<std::string> components,
                      const std::string& units) {
  data::FieldInfo info;
  info.name = std::move(name);
  info.kind = kind;
  info.units = units;
  info.component_units.assign(components.size(), units);
  info.components = std::move(components);
  info.dtype = "float32";
  return info;
}

class Blobs final : public data::Source {
 public:
  Blobs() {
    info_.id = "blobs";
    info_.title = "Blobs in a swirl";
    info_.source = "study";
    info_.format = "sample";
    info_.digest = "study:blobs:v1";  // increment the version when a formula changes
    info_.grid.axes = {edge("x"), edge("y"), edge("z")};
    info_.fields = {field("density", data::FieldKind::scalar, {"density"}, "1"),
                    field("flow", data::FieldKind::vector, {"u", "v", "w"}, "m s-1")};
    info_.steps.push_back({0, "0"});
  }

  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }

  Result<data::Volume> read(std::size_t index, std::size_t step) override {
    WINDSPLAT_CHECK(index < info_.fields.size() && step == 0);
    data::Volume volume;
    volume.dims = info_.grid.dims();
    volume.components = static_cast<int>(info_.fields[index].components.size());
    std::vector<float> samples;
    for (int c = 0; c < volume.components; ++c) {
      for (const double z : info_.grid.axes[2].coordinates) {
        for (const double y : info_.grid.axes[1].coordinates) {
          for (const double x : info_.grid.axes[0].coordinates) {
            const double value =
                index == 0 ? density(x, y, z) : flow(x, y, z)[static_cast<std::size_t>(c)];
            samples.push_back(static_cast<float>(value));
          }
        }
      }
    }
    volume.values = std::move(samples);
    data::finish_volume(volume);
    return volume;
  }

 private:
  data::DatasetInfo info_;
};

}  // namespace

std::unique_ptr<data::Source> make_blobs() { return std::make_unique<Blobs>(); }

}  // namespace windsplat::study
