// The plain data types' few operations: sizes, look-up by name, and the last pass over a volume.
#include "server/data/dataset.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/base/check.hpp"

namespace windsplat::data {

namespace {

constexpr float masked_value = std::numeric_limits<float>::quiet_NaN();

// |V| in double, where the square of no float overflows; clamped to what a float can say.
float magnitude(const float* const* components, int count, std::size_t i) {
  double sum = 0;
  for (int c = 0; c < count; ++c) {
    const auto v = static_cast<double>(components[c][i]);
    sum += v * v;
  }
  return static_cast<float>(
      std::min(std::sqrt(sum), static_cast<double>(std::numeric_limits<float>::max())));
}

}  // namespace

std::array<int, 3> Grid::dims() const {
  std::array<int, 3> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    out[a] = static_cast<int>(axes[a].coordinates.size());
  }
  return out;
}

std::size_t Grid::samples() const {
  return axes[0].coordinates.size() * axes[1].coordinates.size() * axes[2].coordinates.size();
}

const FieldInfo* DatasetInfo::find(const std::string& name) const {
  const auto at = std::find_if(fields.begin(), fields.end(),
                               [&](const FieldInfo& field) { return field.name == name; });
  return at == fields.end() ? nullptr : &*at;
}

const FieldInfo* DatasetInfo::first(FieldKind kind) const {
  const auto at = std::find_if(fields.begin(), fields.end(),
                               [&](const FieldInfo& field) { return field.kind == kind; });
  return at == fields.end() ? nullptr : &*at;
}

void finish_volume(Volume& volume) {
  const std::size_t samples = volume.samples();
  WINDSPLAT_CHECK(volume.components >= 1 && volume.components <= 3);
  WINDSPLAT_CHECK(volume.values.size() == samples * static_cast<std::size_t>(volume.components));

  const int count = volume.components;
  std::array<float*, 3> component{};
  for (int c = 0; c < count; ++c) {
    component[static_cast<std::size_t>(c)] =
        volume.values.data() + static_cast<std::size_t>(c) * samples;
  }

  volume.masked = 0;
  float low = std::numeric_limits<float>::infinity();
  float high = -std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < samples; ++i) {
    bool finite = true;
    for (int c = 0; c < count; ++c) {
      finite = finite && std::isfinite(component[static_cast<std::size_t>(c)][i]);
    }
    if (!finite) {
      ++volume.masked;
      for (int c = 0; c < count; ++c) {
        component[static_cast<std::size_t>(c)][i] = masked_value;
      }
      continue;
    }
    const float value = count == 1 ? component[0][i] : magnitude(component.data(), count, i);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  volume.range = low <= high ? std::array<float, 2>{low, high} : std::array<float, 2>{0, 0};
}

}  // namespace windsplat::data
