// Counts the visible samples and the pixels that each covers.
#include "server/frame/cost.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "protocol/view/shown.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/lines/mark.hpp"
#include "server/scene/section.hpp"
#include "server/scene/traced/seeds.hpp"

namespace windsplat::frame {
namespace {

constexpr double footprint = 5.9;   // area of a splat in cells: pi 1.37^2
constexpr double covered_min = 16;  // pixels: kernels are drawn into blocks of 4 x 4
// Kernels of 6 ns that take as long, fitted to what bench_estimates --parts=fitted measured: a
// pixel of a ground that shows land and sea, and of a plain one; of a surface a triangle, a sample
// that is searched for it and a pixel; the light of a sample, also of a bent lattice. They were 12
// to 15; 1 to 5; 230 to 370, 2.5 to 6 and 3 to 4; 3 to 20, and 120.
constexpr double kernels_a_painted_pixel = 12;
constexpr double kernels_a_plain_pixel = 3;
constexpr double kernels_a_triangle = 240;
constexpr double kernels_a_searched_sample = 6;
constexpr double kernels_a_surface_pixel = 3;
constexpr double kernels_a_lit_sample = 18;
constexpr double kernels_a_bent_lit_sample = 120;
// Means of the same surfaces over the number of samples to the power 2/3, that of a face of a cube:
// 2.4 to 11.5 and 2.1 to 3.1. Noise may have as many triangles as samples.
constexpr double isosurface_triangles = 5;
constexpr double section_triangles = 2.7;
// Measured with 150 and 600 lines: a piece takes 2.3 us (tornado) to 3.0 us (climate) to trace and
// draw; lines had 0.4 to 0.7 of the pieces that they may have.
constexpr double kernels_a_traced_piece = 400;
constexpr double reference_height = 720;  // pixels, for which the radii of a view are defined

// The visible part of the volume: its fraction of the volume, and the size of a world unit in it.
struct VisiblePart {
  double share = 1;
  double px = 1;   // mean number of pixels per world unit
  double px2 = 1;  // mean of its square
};

// Between the depths of the box the frustum contains V = 4 h^2 a (f^3 - n^3) / 3, with h half its
// height at depth 1 and a its aspect ratio; the means of 1 / d and 1 / d^2 over it follow.
VisiblePart visible_part(const scene::Camera& camera, const scene::Lattice& lattice) {
  const auto [near, far] = scene::view_depths(camera, lattice);
  const double depth = std::max(far - near, 1e-9);
  const double aspect = static_cast<double>(camera.width) / camera.height;
  const double scale = 0.5 * camera.height / camera.half_height;
  const double section = 4 * camera.half_height * camera.half_height * aspect;
  const glm::dvec3 box = lattice.box_max - lattice.box_min;
  const double volume = std::max(box.x * box.y * box.z, 1e-30);
  VisiblePart part;
  double seen = section * depth;
  if (camera.perspective) {
    const double cubes = far * far * far - near * near * near;
    seen = section * cubes / 3;
    part.px = scale * 1.5 * (far * far - near * near) / cubes;
    part.px2 = scale * scale * 3 * depth / cubes;
  } else {
    part.px = scale;
    part.px2 = scale * scale;
  }
  part.share = std::clamp(seen / volume, 0.0, 1.0);
  return part;
}

class Counting {
 public:
  Counting(const scene::ViewOutline& outline, const scene::DrawnPart& part, const data::Grid& grid)
      : view_(outline.view),
        lattice_(outline.lattice),
        is_of_earth_(grid.columns || (grid.axes[0].kind == data::AxisKind::longitude &&
                                      grid.axes[1].kind == data::AxisKind::latitude)),
        bent_(outline.bent),
        visible_(visible_part(outline.camera, lattice_)),
        pixels_(static_cast<double>(outline.camera.width) * outline.camera.height),
        values_(part.halvings == std::array{0, 0, 0} ? 1 : 2) {
    for (std::size_t a = 0; a < 3; ++a) data_[a] = lattice_.dims[a];
    if (protocol::is_section(view_.geometry)) {
      if (const auto section = scene::make_section(view_.geometry, lattice_)) {
        for (std::size_t a = 0; a < 3; ++a) samples_[a] = section->dims[a];
        cell_ = section->pitch;
        return;
      }
    }
    const auto slice = scene::slice_of(view_.geometry, lattice_);
    for (std::size_t a = 0; a < 3; ++a) {
      const bool one = slice && slice->axis == static_cast<int>(a);
      samples_[a] = one ? 1.0 : data::halved(lattice_.dims[a], part.halvings[a]);
      cell_[a] = scene::cell_size(lattice_, a) * std::exp2(part.halvings[a]);
      if (part.held) hold_part(a, part);
    }
    visible_.share = std::min(visible_.share, 1.0);
  }

  Cost count() {
    cost_.pixels = static_cast<std::int64_t>(pixels_);
    add("/image", pixels_ / Cost::pixels_a_kernel);
    const bool lines = view_.vector.field.kind == protocol::FieldChoice::Kind::named;
    if (lines && view_.vector.opacity > 0) add_lines(view_.vector);
    for (std::size_t n = 0; n < view_.scalars->size(); ++n) {
      add_medium((*view_.scalars)[n], "/scalars/" + std::to_string(n));
    }
    if (may_show_ground()) {
      add("/ground", (is_of_earth_ ? kernels_a_painted_pixel : kernels_a_plain_pixel) * pixels_);
    }
    for (std::size_t n = 0; n < view_.surfaces.size(); ++n) {
      add_surface(view_.surfaces[n], "/surfaces/" + std::to_string(n));
    }
    // Every column is compared with every edge, a sixteenth of a kernel each.
    double points = 0;
    for (const auto& rings : view_.region.polygon) {
      for (const auto& ring : rings) points += static_cast<double>(ring.size());
    }
    if (points > 0) add("/region/polygon", points * lattice_.dims[0] * lattice_.dims[1] / 16);
    // Once for each sun; slices are drawn unlit.
    const bool sliced = view_.geometry.slice || protocol::is_section(view_.geometry);
    if (view_.light && !view_.scalars->empty() && !sliced) {
      const double one = bent_ ? kernels_a_bent_lit_sample : kernels_a_lit_sample;
      add("/light", one * samples_[0] * samples_[1] * samples_[2]);
    }
    if (view_.method.name == protocol::MethodName::slab) {
      const double deep = std::hypot(samples_[0], samples_[1], samples_[2]);
      const double slabs = deep / view_.method.slab_thickness;
      add("/method/slabThickness", pixels_ * slabs / Cost::pixels_a_kernel);
    }
    return cost_;
  }

 private:
  // Of a part a larger share is visible.
  void hold_part(std::size_t a, const scene::DrawnPart& part) {
    const double whole = samples_[a];
    samples_[a] = part.held->box.count[a];
    data_[a] = std::min<double>(data_[a], std::ldexp(samples_[a], part.halvings[a]));
    visible_.share *= whole / samples_[a];
  }

  [[nodiscard]] bool may_show_ground() const {
    if (view_.ground.show == protocol::GroundShow::off) return false;
    return view_.ground.show == protocol::GroundShow::on || is_of_earth_ ||
           view_.geometry.mapping == protocol::GeometryMapping::sphere;
  }

  void add(std::string pointer, double kernels) {
    cost_.kernels += kernels;
    if (kernels <= most_) return;
    most_ = kernels;
    cost_.dominant = std::move(pointer);
  }

  [[nodiscard]] double stops(int stride) const {
    double count = 1;
    for (const double samples : samples_) count *= std::ceil(samples / stride);
    return count;
  }

  // Of a level, no more than its samples.
  [[nodiscard]] double lines(int stride) const {
    double count = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      count *= std::min(samples_[a], std::ceil(data_[a] / stride));
    }
    return count;
  }

  [[nodiscard]] double drawn(double covered) const {
    return visible_.share * std::clamp(covered, covered_min, std::max(pixels_, covered_min)) /
           Cost::pixels_a_kernel;
  }

  // Pixels across a line with all that its mark reaches.
  [[nodiscard]] double width_of(const protocol::VectorView& vector) const {
    const double scale = view_.image.height / reference_height;
    return 2 * std::max(1.0, scene::outer_radius(scene::mark_of(vector, view_.image.height),
                                                 vector.r1 * scale, vector.r2 * scale));
  }

  // Lines are assumed to have the largest length that the view allows, clipped to the box of a
  // kernel, which is that of a sample of the data at any level.
  void add_lines(const protocol::VectorView& vector) {
    if (vector.trace && vector.trace->seeds) {
      add_seeds(vector, *vector.trace->seeds);
      return;
    }
    double widest = 0;
    for (std::size_t a = 0; a < 3; ++a) widest = std::max(widest, scene::cell_size(lattice_, a));
    const double box = std::max(vector.span, 1.0) * *vector.stride * widest * 2;
    const double length = vector.trace ? *vector.length : std::min(*vector.length, box);
    const double parts = vector.trace ? vector.trace->segments : 1;  // each is drawn as a line
    const double wide = width_of(vector);
    const double longish = length * visible_.px / parts;
    const double count = parts * lines(*vector.stride);
    const double covering = count * drawn((longish + wide) * wide);
    add("/vector/stride", count);
    add(wide > longish ? "/vector/r2" : "/vector/length", covering);
  }

  // Both halves of a line have the largest length, in as many pieces as it may have.
  void add_seeds(const protocol::VectorView& vector, const protocol::SeedsView& seeds) {
    const double length = 2 * seeds.length.value_or(diagonal());
    const double pieces = static_cast<double>(scene::seeds_in(seeds)) * seeds.pieces;
    const double wide = width_of(vector);
    const double covered = (length / seeds.pieces * visible_.px + wide) * wide;
    add("/vector/trace/seeds", pieces * (kernels_a_traced_piece + 1 + drawn(covered)));
  }

  [[nodiscard]] double diagonal() const {
    const glm::dvec3 box = lattice_.box_max - lattice_.box_min;
    return std::hypot(box.x, box.y, box.z);
  }

  // Every sample is searched for the surface; its triangles may lie anywhere in the picture.
  void add_surface(const protocol::SurfaceView& surface, const std::string& pointer) {
    double samples = 1;
    for (const int count : lattice_.dims) samples *= count;
    const double square = std::pow(samples, 2.0 / 3);
    double triangles = (surface.isovalue ? isosurface_triangles : section_triangles) * square;
    if (surface.slice) {
      const auto axis = static_cast<std::size_t>(surface.slice->axis);
      triangles = 2 * samples / lattice_.dims.at(axis);
    }
    add(pointer, kernels_a_searched_sample * samples + kernels_a_triangle * triangles +
                     kernels_a_surface_pixel * pixels_);
  }

  void add_medium(const protocol::ScalarView& scalar, const std::string& pointer) {
    if (!protocol::absorbs(scalar)) return;
    const double face = (cell_[0] * cell_[1] + cell_[1] * cell_[2] + cell_[2] * cell_[0]) / 3;
    const double covered = footprint * face * scalar.stride * scalar.stride * visible_.px2;
    const double count = stops(scalar.stride);
    add(pointer + "/stride", count * (values_ + drawn(covered)));
  }

  const protocol::View& view_;
  const scene::Lattice& lattice_;
  const bool is_of_earth_;
  const bool bent_;
  VisiblePart visible_;
  const double pixels_;
  const double values_;              // of a medium at each sample
  std::array<double, 3> samples_{};  // drawn, of the level
  std::array<double, 3> data_{};     // of the data that these represent
  std::array<double, 3> cell_{};
  Cost cost_;
  double most_ = -1;
};

}  // namespace

Cost cost_of(const scene::ViewOutline& outline, const data::Dataset& dataset) {
  return Counting(outline, scene::part_of(outline, dataset), dataset.info().grid).count();
}

}  // namespace windsplat::frame
