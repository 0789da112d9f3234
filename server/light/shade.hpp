// The factors by which light multiplies colours, in double precision (scene::Light has the
// formula).
#pragma once

#include <array>
#include <cstddef>

#include "server/scene/scene.hpp"

namespace windsplat::light {

// The phase function of Henyey and Greenstein (Diffuse radiation in the galaxy, 1941) times 4 pi,
// whose mean over the sphere is 1: (1 - g^2) / (1 + g^2 - 2 g cosine)^(3/2), -1 < g < 1. It is at
// most (1 + |g|) / (1 - |g|)^2.
double phase(double anisotropy, double cosine);

// The strength of the sun times the phase function towards the eye, at a place relative to the eye.
// The scene must have a light.
double sun_seen(const scene::Scene& scene, const std::array<double, 3>& from_eye);

// Factor of the colour of a medium at a sample, at most 1. sun: sun_seen() there.
double medium_light(const scene::Light& light, const scene::ScalarLayer& layer, std::size_t sample,
                    double sun);
// Factor of the colour of a line at a sample.
double line_light(const scene::Light& light, std::size_t sample);

}  // namespace windsplat::light
