// Sizes of a grid; fields by name or kind.
#include "server/data/model/dataset_info.hpp"

#include <algorithm>

namespace windsplat::data {

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

}  // namespace windsplat::data
