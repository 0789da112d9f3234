// The kernels that a few neighbouring rays of a picture meet, found from the lattice.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/engine/reference/kernels.hpp"
#include "server/frame/drawn_samples.hpp"
#include "server/frame/kernel_order.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

using engine::reference::Vec;

// The ray of a place of the picture, in pixels; its parameter is the view depth.
struct PictureRay {
  double x = 0, y = 0;
  Vec origin{};     // from the eye
  Vec direction{};  // its part along the view is 1
  double length = 1;
};
PictureRay picture_ray(const engine::reference::View& view, double x, double y);

// The splat of a kernel on a ray: squared distance of the ray least2 + cells2 (depth - middle)^2.
struct SplatOnRay {
  double middle = 0;  // view depth at which the ray is nearest to the sample
  double least2 = 0;  // in cells
  double cells2 = 0;  // cells passed for each unit of view depth, squared
  double rho = 0;     // extinction for each unit of view depth over the integral of the footprint
  double tau = 0;     // optical depth
};
SplatOnRay splat_on_ray(const engine::reference::Splat& splat, const PictureRay& ray);
// Half of its extent in view depth; 0: the ray passes beside it.
double half_extent(const SplatOnRay& on);
// The part of its optical depth that lies before a view depth.
double part_before(const SplatOnRay& on, double depth);

// Tolerances of a scene; what is below them is marked instead of left out.
struct Tolerances {
  double magnitude = 0;
  double optical_depth = 0;
};

struct RayKernel {
  OrderKey key{};
  bool thin = false;               // the splat is below the tolerance
  bool weak = false;               // the line is below the tolerance
  engine::reference::Splat splat;  // rho 0: none
  bool near = false;               // the splat lies within twice its depth of the near plane
  std::optional<engine::reference::Ribbon> line;
  engine::reference::ScreenBox box;  // of the line
};

class RayKernels {
 public:
  // The scene must outlive it. What is below `marked` hides nothing where it is decided how far a
  // ray goes.
  explicit RayKernels(const scene::Scene& scene, const Tolerances& marked = {});

  [[nodiscard]] const engine::reference::View& view() const { return view_; }
  [[nodiscard]] const DrawnSamples& samples() const { return samples_; }
  // Kernel positions visited so far, a measure of the time.
  [[nodiscard]] double visited() const { return visited_; }

  // Whether anything is drawn beside the cells that a ray near a sample passes.
  [[nodiscard]] bool meets(const Index& near, const PictureRay& ray);
  // What the first ray, which is near a sample, and all between it and the others may meet, in the
  // order of method `kernel`. Lines are taken to be at least `wide` pixels to either side. Null if
  // they are too many to visit. Valid until the next call.
  const std::vector<const RayKernel*>* around(const Index& near,
                                              const std::vector<PictureRay>& rays, double wide);

 private:
  // Kernel positions of layers of one stride.
  struct Group {
    const engine::reference::LayerGroup* layers = nullptr;
    const scene::VectorLayer* lines = nullptr;
    KernelOrder order;
    [[nodiscard]] int count(std::size_t a) const {
      return static_cast<int>(layers->axis[a].size());
    }
  };
  // Where a ray passes the middle of a layer of cells across an axis.
  struct Place {
    std::size_t axis = 0;
    Index at{};
    Vec offset{};     // from the centre of that cell, cells
    Vec direction{};  // cells for each unit of view depth
    Vec edges{};      // of the cell, world units
    double depth = 0;
  };
  struct Bundle {
    const std::vector<PictureRay>* rays = nullptr;
    std::vector<double> passed;   // by some of the rays so far
    double wide = 0;              // of the bundle and the lines, pixels
    double apart = 0;             // of the rays from the first one, pixels
    std::array<double, 2> low{};  // places of the rays, pixels
    std::array<double, 2> high{};
    double cells = 0;  // reach of kernels beyond a layer
  };

  [[nodiscard]] engine::reference::KernelPosition position(const Group& group,
                                                           const Index& i) const;
  [[nodiscard]] std::optional<Place> place_at(const Group& group, std::size_t axis, int layer,
                                              Vec guess, const PictureRay& ray) const;
  [[nodiscard]] bool is_drawn_beside(const Group& group, const Place& place);
  void find_path(const Group& group, const Index& near, const PictureRay& ray);
  // False: too many positions.
  [[nodiscard]] bool add_layer(const Group& group, const Place& place, Bundle& bundle);
  void add(const Group& group, const Index& i, const Place& place, double away, Bundle& bundle);
  void pass(const RayKernel& kernel, Bundle& bundle) const;
  [[nodiscard]] Medium medium(const Group& group, const Index& i) const;
  // Half of its length as drawn, at most, in world units; 0: no line.
  [[nodiscard]] double half_line(const Group& group, const Index& i) const;

  const scene::Scene& scene_;
  Tolerances marked_;
  engine::reference::View view_;
  DrawnSamples samples_;
  std::vector<engine::reference::LayerGroup> layers_;
  std::optional<scene::VectorLayer> lines_;
  std::vector<Group> groups_;
  std::vector<Place> path_;
  std::vector<RayKernel> found_;
  std::vector<const RayKernel*> ordered_;
  double visited_ = 0;
};

}  // namespace windsplat::frame
