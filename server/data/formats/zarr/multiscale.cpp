#include "server/data/formats/zarr/multiscale.hpp"

#include <cmath>
#include <string_view>
#include <utility>

namespace windsplat::data::zarr {

namespace {

const std::vector<Json>& list_of(const Json& json, std::string_view key) {
  static const std::vector<Json> none;
  const Json* found = json.find(key);
  return found == nullptr ? none : found->list;
}

// Up to version 0.3 an axis is just a name.
ImageAxis parse_axis(const Json& json) {
  ImageAxis out;
  out.name = json.kind == Json::Kind::text ? json.text : json.text_at("name");
  const std::string type = json.text_at("type");
  out.is_space =
      type == "space" || (type.empty() && (out.name == "x" || out.name == "y" || out.name == "z"));
  out.is_time = type == "time" || (type.empty() && out.name == "t");
  out.unit = json.text_at("unit");
  return out;
}

// Applies scales and translations in their order; false if one is of another kind or length.
bool transform(const Json& json, std::vector<ImageAxis>& axes) {
  for (const Json& step : list_of(json, "coordinateTransformations")) {
    const std::string type = step.text_at("type");
    if (type == "identity") continue;
    const auto& numbers = list_of(step, type);
    if ((type != "scale" && type != "translation") || numbers.size() != axes.size()) return false;
    for (std::size_t i = 0; i < axes.size(); ++i) {
      const double number = numbers[i].number;
      if (numbers[i].kind != Json::Kind::number || !std::isfinite(number)) return false;
      if (type == "translation") {
        axes[i].first += number;
      } else {
        axes[i].first *= number;
        axes[i].spacing *= number;
      }
      if (axes[i].spacing == 0) return false;
    }
  }
  return true;
}

}  // namespace

std::optional<Multiscale> multiscale_of(const Json& attributes) {
  const Json* ome = attributes.find("ome");
  const auto& images = list_of(ome == nullptr ? attributes : *ome, "multiscales");
  if (images.empty()) return {};
  const Json& image = images.front();
  Multiscale out;
  for (const Json& level : list_of(image, "datasets")) out.levels.push_back(level.text_at("path"));
  if (out.levels.empty() || out.levels.front().empty()) return {};
  out.finest = out.levels.front();
  for (const Json& axis : list_of(image, "axes")) out.axes.push_back(parse_axis(axis));
  const Json& finest = list_of(image, "datasets").front();
  auto placed = out.axes;
  out.placed = finest.find("coordinateTransformations") != nullptr && transform(finest, placed) &&
               transform(image, placed);
  if (out.placed) out.axes = std::move(placed);
  return out;
}

}  // namespace windsplat::data::zarr
