// Picks: a posted view and a pixel of its picture -> what contributes most to it. Draws
// nothing; the view is completed and its scene built as for a picture.
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/measurements.hpp"
#include "protocol/view/shown.hpp"
#include "server/api/measure/positions.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/resources.hpp"
#include "server/frame/pick/pick.hpp"
#include "server/http/problem.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/section.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"

namespace windsplat::api {
namespace {

struct PickRequest {
  protocol::View view;
  double x = 0, y = 0;  // pixels
};

Result<PickRequest> read_request(tasks::Backend& backend, const http::Request& request) {
  PickRequest out;
  http::QueryReader query(request.query);
  const auto x = read_number(query, parameters::pixel_x);
  const auto y = read_number(query, parameters::pixel_y);
  if (const auto ok = query.finish(); !ok) return ok.error();
  if (!x || !y) {
    return make_error(ErrorKind::malformed,
                      "query parameters 'x' and 'y' are required: pixels from the upper left "
                      "corner of the picture");
  }
  const auto document = protocol::ViewDocument::parse(request.body);
  if (!document) return document.error();
  out = {document->view(), *x, *y};
  if (out.view.dataset.empty()) {
    return make_error_at(ErrorKind::invalid, "/dataset", "must name a dataset");
  }
  out.view.quality = {};  // affects how a stream renders, not the content
  if (const auto drawable = backend.check(out.view); !drawable) return drawable.error();
  const protocol::ImageView& image = out.view.image;
  if (out.x >= image.width || out.y >= image.height) {
    return make_error(ErrorKind::invalid, "query parameters 'x' and 'y' must be below " +
                                              std::to_string(image.width) + " and " +
                                              std::to_string(image.height) +
                                              ", the size of the picture in pixels");
  }
  return out;
}

// The sample of the data that is nearest to a place.
std::array<int, 3> nearest_of(const scene::Lattice& lattice, const engine::reference::Vec& place) {
  std::array<int, 3> out{};
  for (std::size_t a = 0; a < 3; ++a) {
    double nearest = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < lattice.positions[a].size(); ++i) {
      const double away = std::abs(lattice.positions[a][i] - place[a]);
      if (away >= nearest) continue;
      nearest = away;
      out.at(a) = static_cast<int>(i);
    }
  }
  return out;
}

// On a bent lattice too.
std::array<int, 3> nearest_placed(const scene::Lattice& lattice,
                                  const engine::reference::Vec& place) {
  if (!lattice.places) return nearest_of(lattice, place);
  std::size_t found = 0;
  double nearest = std::numeric_limits<double>::max();
  for (std::size_t n = 0; n < lattice.places->size(); ++n) {
    const auto& at = (*lattice.places)[n];
    double away = 0;
    for (std::size_t a = 0; a < 3; ++a) away += std::pow(at.at(a) - place[a], 2);
    if (away >= nearest) continue;
    nearest = away;
    found = n;
  }
  const auto x = static_cast<std::size_t>(lattice.dims[0]);
  const auto y = static_cast<std::size_t>(lattice.dims[1]);
  return {static_cast<int>(found % x), static_cast<int>(found / x % y),
          static_cast<int>(found / x / y)};
}

// The layers of the scene correspond to those of the view, in the same order, without media of zero
// extinction.
std::string field_of(const scene::Scene& scene, const protocol::View& completed,
                     std::size_t medium) {
  std::size_t layer = 0;
  for (const protocol::ScalarView& scalar : completed.scalars.value()) {
    if (scene.scalars[layer].extinction != scalar.extinction.value()) continue;
    if (layer++ == medium) return scalar.field;
  }
  return "";
}

// Numbers count the surfaces of a scene, which are those of the view that are seen.
std::size_t surface_of(const protocol::View& view, std::size_t shown) {
  std::size_t n = 0;
  for (; n < view.surfaces.size(); ++n) {
    if (scene::is_seen(view.surfaces[n]) && shown-- == 0) break;
  }
  return n;
}

// The field that colours the surface; of one colour, the field that is constant on it.
void describe_surface(const frame::Picked& found, const protocol::View& view,
                      protocol::PickedFeature& out) {
  const std::size_t number = surface_of(view, *found.surface);
  const protocol::SurfaceView& surface = view.surfaces.at(number);
  out.layer = protocol::PickedLayer::surface;
  out.surface = static_cast<int>(number);
  out.field = scene::color_field_of(surface);
  if (out.field.empty()) {
    out.field = surface.field;
    out.value = surface.isovalue;
  } else if (!std::isnan(found.value)) {
    out.value = found.value;
  }
}

void describe_layer(const frame::Picked& found, const scene::Scene& scene,
                    const protocol::View& view, protocol::PickedFeature& out) {
  if (found.surface) return describe_surface(found, view, out);
  out.layer = found.medium ? protocol::PickedLayer::medium : protocol::PickedLayer::lines;
  out.field = found.medium ? field_of(scene, view, *found.medium) : view.vector.field.name;
  out.value = found.value;
}

using Feature = std::optional<protocol::PickedFeature>;

Result<Feature> feature_of(const PickRequest& asked, data::Dataset& dataset,
                           const CancelToken& cancel) {
  const auto completed = scene::complete(asked.view, dataset);
  if (!completed) return completed.error();
  const auto exact = completed->with(
      [](protocol::View& view) { view.method.name = protocol::MethodName::reference; });
  if (!exact) return exact.error();
  const auto scene = scene::build_scene(*exact, dataset);
  if (!scene) return scene.error();
  const auto picked = frame::pick(*scene, asked.x, asked.y, cancel);
  if (!picked) return picked.error();
  if (!*picked) return Feature();
  const frame::Picked& found = **picked;
  protocol::PickedFeature out;
  const protocol::View& view = exact->view();
  describe_layer(found, *scene, view, out);
  if (const data::FieldInfo* field = dataset.info().find(out.field)) out.units = field->units;
  out.position.index = found.surface || protocol::is_section(view.geometry)
                           ? nearest_placed(exact->lattice(), found.place)
                           : found.sample;
  const scene::Lattice& lattice = exact->lattice();
  for (std::size_t a = 0; a < 3; ++a) out.position.index.at(a) += lattice.first.at(a);
  if (lattice.turn > 0) out.position.index[0] %= lattice.turn;
  out.share = found.share;
  out.depth = found.depth;
  out.at = found.at;
  return Feature(std::move(out));
}

http::Response pick_response(tasks::Backend& backend, const PickRequest& asked,
                             data::Dataset& dataset, const CancelToken& cancel) {
  auto feature = backend.catalogue.load(
      dataset, [&](data::Dataset& loading) { return feature_of(asked, loading, cancel); }, cancel);
  if (!feature) return http::problem_response(feature.error());
  if (*feature) {
    const Position position{{}, (*feature)->position.index, asked.view.geometry.height_field};
    const auto located = locate(backend.catalogue, dataset, position, cancel);
    if (!located) return http::problem_response(located.error());
    (*feature)->position = located->position;
  }
  return json_response(protocol::encode_pick(*feature));
}

}  // namespace

void post_pick(tasks::Backend& backend, const http::Request& request, http::Reply reply) {
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  auto asked = read_request(backend, request);
  if (!asked) return reply(http::problem_response(asked.error()));
  const auto dataset = tasks::find_shown(backend.catalogue, asked->view);
  if (!dataset) return reply(http::problem_response(dataset.error()));
  run_later(backend.loads, request, std::move(reply), "a pick", dataset->get(),
            [&backend, asked = std::move(*asked), dataset = *dataset, cancel = request.cancel] {
              return pick_response(backend, asked, *dataset, cancel);
            });
}

}  // namespace windsplat::api
