#include "server/light/lit_scene.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "protocol/utc_time.hpp"
#include "server/light/curved.hpp"
#include "server/light/ground_light.hpp"
#include "server/light/ground_rays.hpp"
#include "server/light/kept_grid.hpp"
#include "server/light/relief.hpp"
#include "server/light/sun.hpp"
#include "server/light/sunlight.hpp"

namespace windsplat::light {

namespace {

using light::append;
using protocol::LightView;
using scene::SampleFactors;
using scene::Scene;

struct Sun {
  glm::dvec3 direction{0, 0, 1};
  bool risen = true;
};

// On a globe the sun shines from one direction on all of it. Elsewhere the ground is level.
Result<Sun> sun_of(const LightView& view, bool globe) {
  SunDirection direction{view.azimuth, view.elevation};
  if (view.sun_at) {
    const auto days = protocol::days_since_2000(view.sun_at->utc);
    if (!days) {
      return make_error_at(ErrorKind::invalid, "/light/sunAt/utc",
                           "is not a time like \"2024-06-21T12:00:00Z\"");
    }
    if (globe) {
      const SubsolarPoint point = subsolar_point(*days);
      // Longitude 0 faces south (-y): 180 - longitude clockwise from north.
      return Sun{sun_vector({180 - point.longitude, point.latitude}), true};
    }
    direction = sun_direction(*days, view.sun_at->longitude, view.sun_at->latitude);
  }
  return Sun{sun_vector(direction), globe || direction.elevation >= 0};
}

void append(const std::optional<protocol::Range>& range, std::string& key) {
  append(range ? 1.0 : 0.0, key);
  if (!range) return;
  for (const double end : *range) append(end, key);
}

// What masks samples besides the box of the lattice.
void append(const protocol::RegionView& region, std::string& key) {
  append(region.longitudes, key);
  append(region.latitudes, key);
  for (const protocol::FilterView& filter : region.where) {
    append(filter.field, key);
    append(std::optional(filter.range), key);
    append(static_cast<double>(filter.of), key);
  }
  for (const auto& polygon : region.polygon) {
    for (const auto& ring : polygon) {
      append(static_cast<double>(ring.size()), key);
      for (const auto& [x, y] : ring) {
        append(x, key);
        append(y, key);
      }
    }
  }
}

// Identifies the places of the samples and the direction of the sun.
std::string key_of(const char* what, const protocol::View& view, const Scene& scene,
                   const glm::dvec3& sun) {
  std::string key = what;
  append_lattice(view.geometry, scene, key);
  append(view.region, key);
  for (glm::length_t c = 0; c < 3; ++c) append(sun[c], key);
  return key;
}

using Factors = std::shared_ptr<const SampleFactors>;

// working_bytes: of memory while they are computed.
Result<Factors> kept_factors(data::Dataset& dataset, const std::string& key, std::size_t samples,
                             std::uint64_t working_bytes,
                             const std::function<SampleFactors()>& make) {
  const std::uint64_t bytes = samples * sizeof(SampleFactors::value_type);
  const CancelToken cancel = dataset.cancellation();
  const auto made = [&]() -> Result<data::Resident> {
    auto factors = std::make_shared<const SampleFactors>(make());
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "sunlight cancelled");
    return data::Resident(std::move(factors));
  };
  const auto typed = [](data::Resident resident) {
    return std::static_pointer_cast<const SampleFactors>(std::move(resident));
  };
  data::Dataset resident = dataset.resident_only();
  if (auto there = resident.auxiliary(key, bytes, made)) return typed(std::move(*there));
  const auto working = dataset.reserve(working_bytes);
  if (!working) return working.error();
  auto kept = dataset.auxiliary(key, bytes, made);
  if (!kept) return kept.error();
  return typed(std::move(*kept));
}

// Identifies what the transmittance of the media depends on.
std::string media_key(const char* what, const protocol::View& view,
                      const std::vector<std::string>& media, const Scene& scene) {
  std::string key = key_of(what, view, scene, scene.light->sun);
  append(scene.light->shadows, key);
  for (std::size_t n = 0; n < scene.scalars.size(); ++n) {
    const scene::ScalarLayer& layer = scene.scalars[n];
    append(media[n], key);
    append(layer.stride, key);
    append(static_cast<double>(layer.extinction.size()), key);
    for (const auto& [value, extinction] : layer.extinction) {
      append(value, key);
      append(extinction, key);
    }
  }
  return key;
}

// What computes and keeps sunlight.
struct Kept {
  const protocol::View& view;
  const std::vector<std::string>& media;
  data::Dataset& dataset;
  const Scene& scene;

  [[nodiscard]] std::vector<float> extinctions_of(const CancelToken& cancel) const {
    return extinctions(scene.lattice, scene.scalars, scene.light->shadows, cancel);
  }
};

using Places = std::shared_ptr<const surface::Transmittances>;

Places at_points(const scene::Lattice& lattice, Factors factors) {
  return std::make_shared<const surface::Transmittances>(
      surface::Transmittances{lattice.positions, std::move(factors)});
}

// Whether sunlight falls on what lies between samples: the body and isosurfaces.
bool lights_places(const Scene& scene) {
  const auto lit = [](const surface::Shown& shown) { return shown.ambient < 1; };
  return scene.body || std::any_of(scene.surfaces.begin(), scene.surfaces.end(), lit);
}

// The transmittances at the points of the grid, and then at the samples from them.
Result<Places> curved_places(const Kept& kept, const scene::Lattice& grid) {
  const std::size_t samples = kept.scene.scalars.front().field->samples();
  const std::size_t points =
      grid.positions[0].size() * grid.positions[1].size() * grid.positions[2].size();
  const CancelToken cancel = kept.dataset.cancellation();
  const std::string key = media_key("sunlight at points", kept.view, kept.media, kept.scene);
  auto factors = kept_factors(
      kept.dataset, key, points, samples * sizeof(float) + curved_working_bytes(samples), [&] {
        return grid_sunlight(kept.scene.lattice, kept.extinctions_of(cancel), grid,
                             kept.scene.light->sun, cancel);
      });
  if (!factors) return factors.error();
  return at_points(grid, std::move(*factors));
}

// The sunlight of samples, and of places if it falls on any.
Result<SunAtPlaces> add_sunlight(const Kept& kept, Scene& scene) {
  const glm::dvec3& sun = scene.light->sun;
  const std::string key = media_key("sunlight", kept.view, kept.media, scene);
  const std::size_t samples = scene.scalars.front().field->samples();
  const bool curved = scene.lattice.places != nullptr;
  const CancelToken cancel = kept.dataset.cancellation();
  SunAtPlaces at_places;
  std::optional<scene::Lattice> grid;
  if (curved && lights_places(scene)) {
    auto around = kept_grid(kept.view.geometry, scene, kept.dataset);
    if (!around) return around.error();
    grid = std::move(*around);
    auto places = curved_places(kept, *grid);
    if (!places) return places.error();
    at_places.media = std::move(*places);
    at_places.below = below_ground(scene.lattice, *grid, sun);
  }
  const std::uint64_t working =
      grid ? 0 : samples * sizeof(float) + (curved ? curved_working_bytes(samples) : 0);
  auto factors = kept_factors(kept.dataset, key, samples, working, [&] {
    if (grid) return sunlight_at_samples(scene.lattice, *grid, *at_places.media->factors);
    const std::vector<float> media = kept.extinctions_of(cancel);
    return curved ? curved_sunlight(scene.lattice, media, sun, cancel)
                  : sunlight(scene.lattice, media, sun, cancel);
  });
  if (!factors) return factors.error();
  if (!curved && lights_places(scene)) at_places.media = at_points(scene.lattice, *factors);
  scene.light->sunlight = std::move(*factors);
  return at_places;
}

// Of level ground below a rectilinear lattice; null: of another body, or none.
Result<Factors> ground_factors(const protocol::View& view, const std::vector<std::string>& media,
                               data::Dataset& dataset, const Scene& scene) {
  const scene::Lattice& lattice = scene.lattice;
  const bool level = scene.body && scene.body->shape == scene::BodyShape::ground;
  if (!level || lattice.places) return Factors();
  const std::size_t columns = lattice.positions[0].size() * lattice.positions[1].size();
  const std::size_t samples = columns * lattice.positions[2].size();
  const CancelToken cancel = dataset.cancellation();
  return kept_factors(dataset, media_key("ground", view, media, scene), columns,
                      samples * sizeof(float), [&scene, &lattice, &cancel] {
                        return ground_sunlight(
                            lattice,
                            extinctions(lattice, scene.scalars, scene.light->shadows, cancel),
                            scene.light->sun, cancel);
                      });
}

Result<void> add_relief(const protocol::View& view, const std::string& medium,
                        data::Dataset& dataset, const Scene& scene, scene::ScalarLayer& layer) {
  const glm::dvec3& sun = scene.light->sun;
  std::string key = key_of("relief", view, scene, sun);
  append(medium, key);
  append(layer.color.range[0], key);
  append(layer.color.range[1], key);
  auto factors = kept_factors(dataset, key, layer.field->samples(), 0,
                              [&scene, &layer, &sun] { return relief(scene.lattice, layer, sun); });
  if (!factors) return factors.error();
  layer.relief = std::move(*factors);
  return {};
}

}  // namespace

Result<void> light_scene(const protocol::View& view, const std::vector<std::string>& media,
                         data::Dataset& dataset, Scene& scene) {
  if (!view.light || scene.slice) return {};
  const bool globe = view.geometry.mapping == protocol::GeometryMapping::sphere;
  const auto sun = sun_of(*view.light, globe);
  if (!sun) return sun.error();
  scene.light = scene::Light{
      sun->direction,         view.light->ambient, sun->risen ? view.light->brightness : 0,
      view.light->anisotropy, view.light->shadows, {}};
  if (!sun->risen) {
    // The sun adds nothing, whatever the gradients.
    for (scene::ScalarLayer& layer : scene.scalars) {
      if (layer.shading == scene::Shading::gradient) layer.shading = scene::Shading::scatter;
    }
  }
  if (!sun->risen || scene.scalars.empty()) {
    light_ground(scene, {});
    light_surfaces(scene, {});
    return {};
  }
  for (std::size_t n = 0; n < scene.scalars.size(); ++n) {
    if (scene.scalars[n].shading != scene::Shading::gradient) continue;
    if (auto ok = add_relief(view, media[n], dataset, scene, scene.scalars[n]); !ok) return ok;
  }
  auto at_places = add_sunlight({view, media, dataset, scene}, scene);
  if (!at_places) return at_places.error();
  auto ground = ground_factors(view, media, dataset, scene);
  if (!ground) return ground.error();
  if (*ground) {
    const auto& [x, y, z] = scene.lattice.positions;
    at_places->ground = std::make_shared<const surface::Transmittances>(
        surface::Transmittances{{x, y, {scene.lattice.box_min.z}}, std::move(*ground)});
  }
  light_ground(scene, *at_places);
  light_surfaces(scene, *at_places);
  return {};
}

}  // namespace windsplat::light
