#include "server/light/kept_grid.hpp"

#include <array>
#include <cstddef>
#include <vector>

#include "server/light/curved.hpp"

namespace windsplat::light {

void append(double number, std::string& key) {
  key.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(const std::string& text, std::string& key) {
  append(static_cast<double>(text.size()), key);
  key += text;
}

void append_lattice(const protocol::GeometryView& geometry, const scene::Scene& scene,
                    std::string& key) {
  append(static_cast<double>(geometry.mapping), key);
  append(static_cast<double>(geometry.vertical), key);
  append(geometry.height_field.value_or(""), key);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto c = static_cast<glm::length_t>(a);
    append(geometry.scale[a], key);
    append(scene.level[a], key);
    append(scene.lattice.dims[a], key);
    append(scene.lattice.first[a], key);
    append(scene.lattice.box_min[c], key);
    append(scene.lattice.box_max[c], key);
  }
}

Result<scene::Lattice> kept_grid(const protocol::GeometryView& geometry, const scene::Scene& scene,
                                 data::Dataset& dataset) {
  std::string key = "sunlight grid";
  append_lattice(geometry, scene, key);
  const CancelToken cancel = dataset.cancellation();
  const auto numbers = dataset.remembered(key, [&]() -> Result<std::vector<double>> {
    const scene::Lattice grid = grid_around(scene.lattice, cancel);
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "sunlight cancelled");
    std::vector<double> out;
    for (std::size_t a = 0; a < 3; ++a) {
      out.insert(out.end(), {static_cast<double>(grid.dims[a]), grid.positions[a].front(),
                             grid.spacing[a].front()});
    }
    return out;
  });
  if (!numbers) return numbers.error();
  const std::vector<double>& n = *numbers;
  return even_grid({static_cast<int>(n[0]), static_cast<int>(n[3]), static_cast<int>(n[6])},
                   {n[1], n[4], n[7]}, {n[2], n[5], n[8]});
}

}  // namespace windsplat::light
