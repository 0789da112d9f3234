// The light of a ray through kernels: in the order of method `kernel`, and by depth.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "server/engine/reference/ray.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

using engine::reference::Light;
using RayKernelList = std::vector<const RayKernel*>;  // in the order of method `kernel`

// Of RGBA, mean of the squared differences.
double square_difference(const Light& a, const Light& b);

// The body of a scene on rays. Keeps the surface of each ray: trials visit the same pixels again,
// and the ground of a pixel that shows much of the Earth takes milliseconds.
class RayGround {
 public:
  // The scene must outlive it.
  explicit RayGround(const scene::Scene& scene);

  // Opacity 1 or 0: what is behind it is hidden, so that pixels that it covers in part are taken as
  // a whole. Without a body at the greatest depth.
  [[nodiscard]] engine::reference::Surface at(const PictureRay& ray);
  // Rays whose surface was computed.
  [[nodiscard]] std::size_t computed() const { return known_.size(); }

 private:
  const scene::Scene& scene_;
  engine::reference::View view_;
  std::map<std::pair<double, double>, engine::reference::Surface> known_;  // by place in pixels
};

class RayLight {
 public:
  // The scene and its ground must outlive it.
  RayLight(const scene::Scene& scene, RayGround& ground);

  // As drawn by method `kernel` with analytic compositing; without those marked as below tolerances
  // if `skips`.
  [[nodiscard]] Light by_kernels(const RayKernelList& kernels, const PictureRay& ray,
                                 bool skips = false) const;
  // Where no more than the scene's stop_transmittance is left: the number of the piece, a part of a
  // slab, counted from the middle of the volume, and what is left behind it and each of the next
  // ones, as far as it counts. Empty if the ray goes on.
  struct End {
    std::int64_t piece = 0;
    std::vector<double> left;
  };
  struct ByDepth {
    Light exact;
    Light slabs;   // of one cell, or of the least depth if cells are thinner
    Light halves;  // half as thick as these
    End end;
    bool known = true;  // false: of too many pieces
  };
  // `exact`: in pieces of a quarter of a cell along the ray.
  ByDepth by_depth(const RayKernelList& kernels, const PictureRay& ray);
  // The least depth of a slab, in cells.
  [[nodiscard]] double thinnest() const { return thinnest_; }
  // Pieces of a slab.
  [[nodiscard]] double pieces_of_slab() const { return pieces_of_slab_; }

 private:
  struct Stretch {
    SplatOnRay on;
    Vec color{};
    double half = 0;  // of its extent in view depth
  };
  // Optical depth times colour, and optical depth.
  using Piece = std::array<double, 4>;
  // Pieces from number `first` on, counted from where a slab starts.
  struct Division {
    double start = 0;  // view depth
    double step = 0;
    std::size_t first = 0;
    std::size_t slant = 1;  // pieces to each of a ray along the view
  };
  [[nodiscard]] double slant_of(const PictureRay& ray) const;
  void meet(const RayKernelList& kernels, const PictureRay& ray);
  void divide(const Stretch& one, const Division& by);
  void pass_in(const Division& by, std::size_t together, Light& to, End* end = nullptr) const;
  void pass(const Piece& piece, double begin, double whole, std::size_t& next, Light& to) const;

  const scene::Scene& scene_;
  RayGround& ground_;
  double near_ = 0;
  double slab_ = 1;  // depth of a slab of one cell, or the least one
  double thinnest_ = 0;
  double pieces_of_slab_ = 4;
  double anchor_ = 0;  // view depth of the middle of the volume
  std::vector<Stretch> stretches_;
  std::vector<engine::reference::Surface> surfaces_;
  std::vector<Piece> pieces_;
};

}  // namespace windsplat::frame
