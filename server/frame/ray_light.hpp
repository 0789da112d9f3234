// The light of a ray through kernels: in the order of method `kernel`, and by depth.
#pragma once

#include <vector>

#include "server/engine/reference/ray.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

using engine::reference::Light;
using RayKernelList = std::vector<const RayKernel*>;  // in the order of method `kernel`

// Of RGBA, mean of the squared differences.
double square_difference(const Light& a, const Light& b);

class RayLight {
 public:
  // The scene must outlive it.
  explicit RayLight(const scene::Scene& scene);

  // As drawn by method `kernel` with analytic compositing.
  [[nodiscard]] Light by_kernels(const RayKernelList& kernels, const PictureRay& ray) const;
  struct ByDepth {
    Light exact;
    Light slabs;        // of one cell
    Light halves;       // slabs of half a cell
    bool known = true;  // false: of too many slabs
  };
  ByDepth by_depth(const RayKernelList& kernels, const PictureRay& ray);

 private:
  struct Stretch {
    SplatOnRay on;
    Vec color{};
    double half = 0;  // of its extent in view depth
  };
  // Optical depth times colour, and optical depth.
  using Piece = std::array<double, 4>;
  [[nodiscard]] engine::reference::Surface body(const PictureRay& ray) const;
  void meet(const RayKernelList& kernels, const PictureRay& ray);
  void pass(const Piece& piece, double begin, double whole, std::size_t& next, Light& to) const;

  const scene::Scene& scene_;
  engine::reference::View view_;
  double near_ = 0;
  double slab_ = 1;    // depth of a slab of one cell
  double anchor_ = 0;  // view depth of the middle of the volume
  std::vector<Stretch> stretches_;
  std::vector<engine::reference::Surface> surfaces_;
  std::vector<Piece> pieces_;
};

}  // namespace windsplat::frame
