// Counts from the scene of a picture.
#include "server/frame/report/parts.hpp"

#include <algorithm>
#include <memory>
#include <set>

#include "server/annotate/paint/overlay.hpp"
#include "server/ground/atlas.hpp"
#include "server/light/ground_light.hpp"
#include "server/scene/place.hpp"
#include "server/scene/region/select.hpp"

namespace windsplat::frame {

namespace {

std::int64_t samples_in(const scene::Lattice& lattice) {
  return std::int64_t{lattice.dims[0]} * lattice.dims[1] * lattice.dims[2];
}

PartCount ground(const scene::Scene& scene, std::size_t kept) {
  if (!scene.body) return {};
  const std::size_t lines = scene.body->paint ? ground::atlas_bytes() : 0;
  return {true, std::int64_t{scene.camera.width} * scene.camera.height,
          static_cast<std::int64_t>(kept + lines)};
}

// The triangles of a mesh that several surfaces share are drawn for each of them, and held once.
PartCount surfaces(const scene::Scene& scene) {
  PartCount part;
  part.shown = !scene.surfaces.empty();
  std::set<const surface::Mesh*> held;
  for (const surface::Shown& shown : scene.surfaces) {
    part.count += static_cast<std::int64_t>(shown.mesh->triangles.size());
    if (held.insert(shown.mesh.get()).second) {
      part.bytes += static_cast<std::int64_t>(shown.mesh->bytes());
    }
  }
  return part;
}

PartCount lines(const scene::Scene& scene, bool shown) {
  if (!shown || !scene.vector || !scene.vector->streamlets) return {};
  const trace::Segments& segments = *scene.vector->streamlets;
  return {true, segments.tally.segments,
          static_cast<std::int64_t>(segments.vertices() * trace::Segments::vertex_bytes)};
}

// Surfaces, the ground and the samples may share factors.
PartCount light(const scene::Scene& scene) {
  PartCount part;
  part.shown = scene.light.has_value();
  if (!part.shown) return part;
  std::set<const scene::SampleFactors*> held;
  const auto add = [&](const scene::SampleFactors* factors) {
    if (factors == nullptr || !held.insert(factors).second) return;
    part.count += static_cast<std::int64_t>(factors->size());
    part.bytes += static_cast<std::int64_t>(factors->size() * sizeof(factors->front()));
  };
  const auto add_places = [&](const surface::Transmittances* places) {
    if (places != nullptr) add(places->factors.get());
  };
  add(scene.light->sunlight.get());
  for (const scene::ScalarLayer& layer : scene.scalars) add(layer.relief.get());
  for (const surface::Shown& shown : scene.surfaces) {
    if (shown.sun) add_places(shown.sun->media.get());
  }
  if (scene.body && scene.body->light) add_places(scene.body->light->transmittances());
  return part;
}

struct Held {
  std::int64_t values = 0, bytes = 0;
};

// The fields that are drawn, each once.
Held fields_of(const scene::Scene& scene) {
  Held out;
  std::set<const data::Volume*> held;
  const auto add = [&](const std::shared_ptr<const data::Volume>& field) {
    if (!field || !held.insert(field.get()).second) return;
    out.values += static_cast<std::int64_t>(field->values.size());
    out.bytes += static_cast<std::int64_t>(field->bytes());
  };
  if (scene.vector) {
    add(scene.vector->field);
    add(scene.vector->color_field);
  }
  for (const scene::ScalarLayer& layer : scene.scalars) add(layer.field);
  return out;
}

// Columns outside of a polygon are masked, those outside of the box are left out.
PartCount region(const scene::CompletedView& completed, const scene::Scene& scene) {
  const protocol::RegionView& asked = completed.view().region;
  if (!scene::is_cropped(asked) && asked.where.empty()) return {};
  PartCount part{true, 0, fields_of(scene).bytes};
  const scene::Placed& placed = *completed.placed();
  if (!placed.whole) return part;
  part.count = samples_in(placed.whole->lattice) - samples_in(placed.lattice);
  if (placed.crop && placed.crop->columns) {
    const auto& columns = *placed.crop->columns;
    part.count += std::count(columns.begin(), columns.end(), 0) * placed.lattice.dims[2];
  }
  return part;
}

PartCount difference(const scene::CompletedView& completed, const scene::Scene& scene) {
  if (!completed.view().difference) return {};
  const Held held = fields_of(scene);
  return {true, held.values, held.bytes};
}

PartCount annotations(const annotate::Figure* figure) {
  if (figure == nullptr) return {};
  return {true, static_cast<std::int64_t>(figure->below.size() + figure->above.size()),
          static_cast<std::int64_t>(annotate::overlay_bytes(figure->width, figure->height))};
}

}  // namespace

PartCounts parts_of(const scene::CompletedView& completed, const scene::Scene& scene,
                    const annotate::Figure* figure, std::size_t ground_bytes) {
  const auto& trace = completed.view().vector.trace;
  const bool seeded = trace && trace->seeds;
  return {ground(scene, ground_bytes),  surfaces(scene),    lines(scene, !seeded),
          lines(scene, seeded),         light(scene),       region(completed, scene),
          difference(completed, scene), annotations(figure)};
}

}  // namespace windsplat::frame
