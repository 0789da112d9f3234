// Upper bound on the work of a picture, from its view and the description of its dataset, before
// any data are read or the picture is queued; of grounds, surfaces and light the work expected of
// the first picture that shows them.
#pragma once

#include <cstdint>
#include <string>

#include "server/base/error.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::frame {

// Work is counted in kernels: one for each kernel position of the lines and each value of a medium
// (merged samples have two), and one per pixels_a_kernel pixels that a kernel covers, that slabs
// cross, or that the picture has. The fixed work of a kernel is about that of pixels_a_kernel
// pixels.
struct Cost {
  static constexpr double pixels_a_kernel = 16;

  std::int64_t pixels = 0;
  double kernels = 0;
  std::string dominant;  // JSON pointer to the setting with the largest share
};

// At the level of detail at which the dataset is drawn. The part outside the picture counts by its
// fraction of the volume.
Cost cost_of(const scene::ViewOutline& outline, const data::Dataset& dataset);

}  // namespace windsplat::frame
