// The data of the study's standard scenes: smooth blobs in a swirl, 24 samples per edge.
#pragma once

#include <memory>

#include "server/data/model/source.hpp"

namespace windsplat::study {

inline constexpr int blob_samples = 24;  // along each axis

// Scalar "density" in [0, 1] (Gaussian blobs) and vector "flow" (a turbulent helix about an axis
// that tilts with height, magnitude up to about 0.8) on the cube [-1, 1]^3.
std::unique_ptr<data::Source> make_blobs();

}  // namespace windsplat::study
