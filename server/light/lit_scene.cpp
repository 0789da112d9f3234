#include "server/light/lit_scene.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "protocol/utc_time.hpp"
#include "server/light/curved.hpp"
#include "server/light/ground_light.hpp"
#include "server/light/ground_rays.hpp"
#include "server/light/relief.hpp"
#include "server/light/sun.hpp"
#include "server/light/sunlight.hpp"

namespace windsplat::light {

namespace {

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

// All bytes of the numbers, which clients choose: two views with the same digest could be found.
void append(double number, std::string& key) {
  key.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(const std::string& text, std::string& key) {
  append(static_cast<double>(text.size()), key);
  key += text;
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
  const protocol::GeometryView& geometry = view.geometry;
  append(static_cast<double>(geometry.mapping), key);
  append(static_cast<double>(geometry.vertical), key);
  append(geometry.height_field.value_or(""), key);
  append(view.region, key);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto c = static_cast<glm::length_t>(a);
    append(geometry.scale[a], key);
    append(scene.level[a], key);
    append(scene.lattice.dims[a], key);
    append(scene.lattice.box_min[c], key);
    append(scene.lattice.box_max[c], key);
    append(sun[c], key);
  }
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

Result<void> add_sunlight(const protocol::View& view, const std::vector<std::string>& media,
                          data::Dataset& dataset, Scene& scene) {
  const glm::dvec3& sun = scene.light->sun;
  const std::string key = media_key("sunlight", view, media, scene);
  const std::size_t samples = scene.scalars.front().field->samples();
  const bool curved = scene.lattice.places != nullptr;
  const std::uint64_t working =
      samples * sizeof(float) + (curved ? curved_working_bytes(samples) : 0);
  const CancelToken cancel = dataset.cancellation();
  auto factors = kept_factors(dataset, key, samples, working, [&scene, &sun, curved, &cancel] {
    const std::vector<float> media =
        extinctions(scene.lattice, scene.scalars, scene.light->shadows, cancel);
    return curved ? curved_sunlight(scene.lattice, media, sun, cancel)
                  : sunlight(scene.lattice, media, sun, cancel);
  });
  if (!factors) return factors.error();
  scene.light->sunlight = std::move(*factors);
  return {};
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
    light_ground(scene);
    return {};
  }
  if (scene.scalars.empty()) {
    light_ground(scene);
    return {};
  }
  for (std::size_t n = 0; n < scene.scalars.size(); ++n) {
    if (scene.scalars[n].shading != scene::Shading::gradient) continue;
    if (auto ok = add_relief(view, media[n], dataset, scene, scene.scalars[n]); !ok) return ok;
  }
  if (auto ok = add_sunlight(view, media, dataset, scene); !ok) return ok;
  auto ground = ground_factors(view, media, dataset, scene);
  if (!ground) return ground.error();
  light_ground(scene, std::move(*ground));
  return {};
}

}  // namespace windsplat::light
