// Gaussian latitudes.
#pragma once

#include <vector>

namespace windsplat::data::grads {

// The roots of the Legendre polynomial of degree `count` as latitudes in degrees, from the south.
std::vector<double> gaussian_latitudes(int count);

}  // namespace windsplat::data::grads
