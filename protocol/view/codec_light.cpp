#include "protocol/view/codec_light.hpp"

#include "protocol/utc_time.hpp"

namespace windsplat::protocol {

namespace {

constexpr double anisotropy_max = 0.99;
constexpr double brightness_max = 10;
constexpr double shadows_max = 1000;

SunAtView read_sun_at(const Json& json, const std::string& pointer, Faults& faults) {
  SunAtView at;
  ObjectReader reader(json, pointer, faults);
  reader.text("utc", at.utc, 1, Presence::required);
  if (reader.child("longitude", Presence::required)) {
    reader.number("longitude", at.longitude, {-360, 360});
  }
  if (reader.child("latitude", Presence::required)) {
    reader.number("latitude", at.latitude, {-90, 90});
  }
  reader.finish();
  if (!days_since_2000(at.utc)) {
    faults.add(reader.at("utc"), "must be a time like \"2024-06-21T12:00:00Z\"");
  }
  return at;
}

}  // namespace

LightView read_light(const Json& json, const std::string& pointer, Faults& faults) {
  LightView light;
  ObjectReader reader(json, pointer, faults);
  reader.number("azimuth", light.azimuth, {-360, 360});
  reader.number("elevation", light.elevation, {-90, 90});
  if (const Json* at = reader.child("sunAt", Presence::optional, Null::is_default)) {
    light.sun_at = read_sun_at(*at, reader.at("sunAt"), faults);
  }
  reader.number("ambient", light.ambient, {0, 1});
  reader.number("brightness", light.brightness, {0, brightness_max});
  reader.number("shadows", light.shadows, {0, shadows_max});
  reader.number("anisotropy", light.anisotropy, {-anisotropy_max, anisotropy_max});
  reader.finish();
  return light;
}

Json light_to_json(const std::optional<LightView>& light) {
  if (!light) return nullptr;
  Json at;
  if (light->sun_at) {
    at = {{"utc", light->sun_at->utc},
          {"longitude", canonical_number(light->sun_at->longitude)},
          {"latitude", canonical_number(light->sun_at->latitude)}};
  }
  return Json{{"azimuth", canonical_number(light->azimuth)},
              {"elevation", canonical_number(light->elevation)},
              {"sunAt", std::move(at)},
              {"ambient", canonical_number(light->ambient)},
              {"brightness", canonical_number(light->brightness)},
              {"shadows", canonical_number(light->shadows)},
              {"anisotropy", canonical_number(light->anisotropy)}};
}

}  // namespace windsplat::protocol
