// The surfaces of a scene at the pixels of a tile: layers before the body.
#pragma once

#include <array>

#include "server/base/aligned_vector.hpp"
#include "server/engine/kernels/frame_data.hpp"
#include "server/scene/scene.hpp"
#include "server/surface/pixels.hpp"

namespace windsplat::engine {

// Storage of one worker, reused for every tile.
struct SurfaceSpace {
  surface::Cell cell;
  AlignedVector<kernels::BodyBlock> blocks;
  std::array<kernels::TileBody, kernels::layers_max> layers;
};

terrain::View surface_view(const scene::Camera& camera);

// Sets the layers of the tile, and adds the surfaces that are opaque to its body. tile.body holds
// the body, or is null, and then becomes `body` if the tile sees a surface; body.blocks must have
// room for the blocks of a whole tile.
void add_surfaces(const surface::Pixels& pixels, const kernels::Camera& camera, SurfaceSpace& space,
                  kernels::TileBody& body, kernels::Tile& tile);

}  // namespace windsplat::engine
