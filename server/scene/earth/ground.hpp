// The ground of a view + placement of a dataset -> the opaque body of a scene.
#pragma once

#include <memory>
#include <optional>

#include "protocol/view.hpp"
#include "server/base/error.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/ground/map.hpp"
#include "server/scene/place.hpp"

namespace windsplat::scene {

// Where points of the ground lie on the Earth; null: the placement does not tell.
std::shared_ptr<const ground::Map> map_of(const protocol::GeometryView& geometry,
                                          const Placed& placed);

// Empty if none is drawn. Errors: those of terrain_of().
Result<std::optional<Body>> make_body(const protocol::View& view, const Camera& camera,
                                      const Placed& placed, data::Dataset& dataset);

// Errors: invalid at the colour that is none.
Result<void> check_ground(const protocol::GroundView& ground);

}  // namespace windsplat::scene
