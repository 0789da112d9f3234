// Lattice and fields of a scene -> its samples.
#include "server/frame/drawn_samples.hpp"

#include <glm/geometric.hpp>

#include "server/data/model/coarsen.hpp"
#include "server/data/model/volume.hpp"
#include "server/light/shade.hpp"

namespace windsplat::frame {

DrawnSamples::DrawnSamples(const scene::Scene& scene) : scene_(scene) {
  const data::Box held = scene.lattice.held();
  low_ = held.first;
  for (std::size_t a = 0; a < 3; ++a) high_[a] = held.first[a] + held.count[a];
  if (scene.slice) {
    const auto axis = static_cast<std::size_t>(scene.slice->axis);
    low_[axis] = scene.slice->sample;
    high_[axis] = scene.slice->sample + 1;
  }
  if (scene.lattice.part && scene.lattice.part->grid) {
    const data::BoxGrid& grid = *scene.lattice.part->grid;
    boxes_ = grid.boxes();
    count_ = static_cast<std::int64_t>(boxes_.size());
    for (const int n : grid.size) count_ *= n;
    return;
  }
  for (std::size_t a = 0; a < 3; ++a) count_ *= high_[a] - low_[a];
}

std::optional<Index> DrawnSamples::at(std::int64_t n) const {
  Index i{};
  if (boxes_.empty()) {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::int64_t wide = high_[a] - low_[a];
      i[a] = low_[a] + static_cast<int>(n % wide);
      n /= wide;
    }
    return i;
  }
  const auto& size = scene_.lattice.part->grid->size;
  for (std::size_t a = 0; a < 3; ++a) {
    i[a] = static_cast<int>(n % size[a]);
    n /= size[a];
  }
  const data::Box& box = boxes_[static_cast<std::size_t>(n)];
  for (std::size_t a = 0; a < 3; ++a) {
    if (i[a] >= box.count[a]) return std::nullopt;
    i[a] += box.first[a];
  }
  return i;
}

std::size_t DrawnSamples::number(const Index& i) const { return scene_.lattice.number_of(i); }

std::size_t DrawnSamples::vector_number(const Index& i) const {
  return scene::vector_number(*scene_.vector, scene_.lattice, i);
}

glm::dvec3 DrawnSamples::place(const Index& i) const {
  const scene::Lattice& lattice = scene_.lattice;
  if (lattice.places) {
    const auto& p = (*lattice.places)[number(i)];
    return {p[0], p[1], p[2]};
  }
  return {lattice.positions[0][static_cast<std::size_t>(i[0])],
          lattice.positions[1][static_cast<std::size_t>(i[1])],
          lattice.positions[2][static_cast<std::size_t>(i[2])]};
}

std::optional<Index> DrawnSamples::neighbour(const Index& i, std::size_t a, int step) const {
  Index next = i;
  next[a] += step;
  if (next[a] < low_[a] || next[a] >= high_[a]) return std::nullopt;
  const auto& part = scene_.lattice.part;
  if (part && part->grid && part->grid->places[part->grid->index_of(next)] == 0) {
    return std::nullopt;
  }
  return next;
}

std::optional<Index> DrawnSamples::neighbour_line(const Index& i, std::size_t a) const {
  const scene::VectorLayer& layer = *scene_.vector;
  const int halvings = layer.halvings[a];
  const int stride = layer.data_stride;
  if (stride == 1 || layer.drawn_places[a] > 1) {
    const auto next = neighbour(i, a, layer.stride);
    return next ? next : neighbour(i, a, -layer.stride);
  }
  const int samples = layer.data_dims[a];
  const int own = ((i[a] << halvings) + stride / 2) / stride;
  const int next = (own + 1) * stride < samples ? own + 1 : own - 1;
  if (next < 0) return std::nullopt;
  return neighbour(i, a, (data::strided_sample(next, stride, samples) >> halvings) - i[a]);
}

Index DrawnSamples::line_of(const Index& i) const {
  const scene::VectorLayer& layer = *scene_.vector;
  const bool whole = layer.halvings == std::array{0, 0, 0};
  const int stride = layer.stride * layer.data_stride;
  Index out = i;
  for (std::size_t a = 0; a < 3; ++a) {
    if (scene_.slice && scene_.slice->axis == static_cast<int>(a)) continue;
    const int samples = whole ? scene_.lattice.drawn(static_cast<int>(a)) : layer.data_dims[a];
    const int kernel = (i[a] << layer.halvings[a]) / stride;
    out[a] = data::strided_sample(kernel, stride, samples) >> layer.halvings[a];
  }
  return out;
}

double DrawnSamples::edge(const Index& i, std::size_t a) const {
  auto next = neighbour(i, a, 1);
  if (!next) next = neighbour(i, a, -1);
  if (!scene_.lattice.places || !next) {
    return scene_.lattice.spacing[a][static_cast<std::size_t>(i[a])];
  }
  return glm::length(place(*next) - place(i));
}

double DrawnSamples::brightness(const scene::ScalarLayer& layer, const Index& i) const {
  if (!scene_.light) return 1;
  const glm::dvec3 from_eye = place(i) - scene_.camera.eye;
  const double sun = light::sun_seen(scene_, {from_eye.x, from_eye.y, from_eye.z});
  return light::medium_light(*scene_.light, layer, number(i), sun);
}

double DrawnSamples::line_brightness(const Index& i) const {
  return scene_.light ? light::line_light(*scene_.light, number(i)) : 1;
}

Medium DrawnSamples::medium(const Index& i) const {
  using Two = data::TwoValues;
  Medium out;
  const std::size_t n = number(i);
  for (const scene::ScalarLayer& layer : scene_.scalars) {
    const data::Volume& field = *layer.field;
    const double bright = brightness(layer, i);
    if (field.components == 1) {
      out.add(layer, field.values[n], 1, bright);
      continue;
    }
    const double low = field.component(Two::low_share)[n];
    const double high = field.component(Two::high_share)[n];
    if (low > 0) out.add(layer, field.component(Two::low)[n], low, bright);
    if (high > 0) out.add(layer, field.component(Two::high)[n], high, bright);
  }
  return out;
}

bool DrawnSamples::contains(const Index& i) const {
  for (std::size_t a = 0; a < 3; ++a) {
    if (i[a] < low_[a] || i[a] >= high_[a]) return false;
  }
  return true;
}

}  // namespace windsplat::frame
