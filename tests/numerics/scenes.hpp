// Synthetic scenes for the numerical tests.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <vector>

#include "server/engine/kernels/table.hpp"
#include "server/engine/render.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::test {

inline constexpr double pi = 3.14159265358979323846;

// The footprint g(r) of a splat by its formula, r in cells, and its integral over the plane.
double footprint(double r);
inline constexpr double footprint_integral = 1.4476982547;

// Samples with the given spacings, centred on the origin.
scene::Lattice make_lattice(const std::array<std::vector<double>, 3>& spacing);
scene::Lattice even_lattice(std::array<int, 3> dims, std::array<double, 3> spacing);

// Makes the lattice curved: puts every sample at to_world(its place).
using ToWorld = std::function<glm::dvec3(const glm::dvec3&)>;
void displace(scene::Lattice& lattice, const ToWorld& to_world);

// A volume whose component c at world position (x, y, z) is value(c, x, y, z).
std::shared_ptr<const data::Volume> make_volume(
    const scene::Lattice& lattice, int components,
    const std::function<float(int, double, double, double)>& value);

// A constant scalar.
std::shared_ptr<const data::Volume> uniform(const scene::Lattice& lattice, float value);

// Looks along `forward` at `target` from `distance` away, with any up vector not parallel to it.
scene::Camera look(const glm::dvec3& target, const glm::dvec3& forward, double distance, int width,
                   int height, bool perspective, double half_height);

scene::ColorTable constant_color(std::array<float, 3> rgb);
scene::ColorTable ramp_color(double low, double high, std::array<float, 3> from,
                             std::array<float, 3> to);

// A medium of one colour with extinction(v) = v in [0, top].
scene::ScalarLayer medium(std::shared_ptr<const data::Volume> field, std::array<float, 3> rgb,
                          double top = 1e30);

// Lines of one colour: no jitter, no dimming, no heads.
scene::VectorLayer plain_lines(std::shared_ptr<const data::Volume> field, std::array<float, 3> rgb);

// All kinds of lines in a coloured medium, side^3 samples from -1 to 1, in perspective from
// outside; a picture of size x size.
scene::Scene cloudy_scene(int side, int size);

engine::Rendered render(const scene::Scene& scene, unsigned threads = 1);
// With the kernels of one instruction set, on one thread.
engine::Rendered render_with(const engine::kernels::Table& table, const scene::Scene& scene);

// Largest difference of a channel of any pixel.
float largest_difference(const engine::Rendered& a, const engine::Rendered& b);

const float* pixel(const engine::Image& image, int x, int y);

}  // namespace windsplat::test
