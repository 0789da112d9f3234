// Places of a picture where its pixels are tried, spread evenly over what it shows.
#pragma once

#include <cstdint>
#include <vector>

#include "server/frame/light_changes.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

inline constexpr std::uint32_t places_count = 1024;

struct Place {
  Index near{};         // a sample beside the ray
  double x = 0, y = 0;  // corner of a pixel
  bool inside = false;  // the picture
};

struct Spread {
  std::vector<Place> places;
  double area = 0;     // square pixels, for which the places stand
  bool empty = false;  // certainly: no ray passes what kernels reach

  // In an order in which the first ones, however many, are spread evenly; n < places_count.
  [[nodiscard]] const Place& nth(std::uint32_t n) const;
};

// `through`: samples that the picture shows. Of a picture of up to 64 pixels each one. No places if
// it is not known where something is shown.
Spread spread_places(const RayKernels& kernels, const std::vector<RayThrough>& through);

// Pixels of a block about a place, within the picture: all of them, or one of each row and column.
void take_block(const scene::Camera& camera, const engine::reference::View& view,
                const Place& place, bool all, std::vector<PictureRay>& rays);

}  // namespace windsplat::frame
