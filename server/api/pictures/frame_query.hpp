// The query of an address of a picture -> the picture that it asks for.
#pragma once

#include <optional>
#include <string>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/frame/cost.hpp"
#include "server/frame/frame.hpp"
#include "server/http/exchange.hpp"
#include "server/http/request_target.hpp"
#include "server/scene/camera.hpp"

namespace windsplat::api {

inline constexpr int jpeg_quality_default = 90;

// Angles in degrees; the factor of the default distance is 1 / zoom.
struct Orbit {
  double azimuth = scene::default_azimuth;
  double elevation = scene::default_elevation;
  double zoom = 1;
};

// The request, validated as far as possible without loading data.
struct Picture {
  protocol::View view;
  frame::Encoding encoding;
  std::string preset;  // empty: none
  std::optional<Orbit> orbit;
  std::string if_none_match;
  std::string accept_encoding;
  frame::Cost cost;  // cost of the view before preset and orbit, which change only the camera
};

// The picture of `base`, a view of that dataset, changed by the parameters of the query. Errors:
// malformed or invalid, also those of parameters that are unknown.
Result<Picture> read_picture(const http::Request& request, frame::Format format,
                             const protocol::ViewDocument& base, const data::DatasetInfo& info);

// The size on paper. Errors: invalid (a format that tells none).
Result<std::optional<double>> read_dots_per_inch(http::QueryReader& query, frame::Format format);

}  // namespace windsplat::api
