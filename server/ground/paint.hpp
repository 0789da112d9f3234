// The colour of the ground at a pixel: land and sea, coastlines, borders and a graticule, by what
// the pixel shows of the Earth. The same for every rendering method.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <memory>

#include "server/ground/map.hpp"
#include "server/terrain/terrain_pixel.hpp"

namespace windsplat::ground {

using Color = std::array<double, 3>;  // linear

struct Style {
  Color land{}, sea{};
  Color line{};  // of all lines
  bool coastlines = true;
  bool borders = false;
  double graticule = 0;  // degrees between its lines; 0: none
  double scale = 1;      // height of the picture over 720 pixels, at which widths are given
};

// The point of the ground in the middle of a pixel. right, down: by how much it moves from one
// pixel to the next, world units, along the surface there.
struct Seen {
  glm::dvec3 point{0};
  glm::dvec3 right{0}, down{0};
  double cosine = 1;  // between ray and normal
};

// The lines near a square of pixels, and whether its middle is land. Only the first `count` lines
// are set.
struct Near {
  struct Line {
    const Segment* segment;
    Ends ends;
    double crossing;  // longitude at which a coast crosses the parallel of the middle; NaN: nowhere
    bool is_coast;
    bool divides;  // a coast that may lie between the middle and another pixel
  };
  static constexpr std::size_t most = 96;
  std::array<Line, most> lines;
  std::size_t count = 0;
  std::size_t level_number = 0;
  const Level* level = nullptr;
  Place middle;
  bool is_land = false;
  bool is_even = false;                  // no line of any kind is near
  double longitudes = 0, latitudes = 0;  // half the extent for which this holds, degrees
};

class Paint {
 public:
  Paint(std::shared_ptr<const Map> map, const Style& style);

  // Adds what distinguishes it from other paints.
  void identify(Identity& to) const;

  // x, y: pixels to the right of and below the middle of the picture. `normal` of the surface; 0:
  // it is level.
  [[nodiscard]] Seen seen(const terrain::View& view, double x, double y, double depth,
                          const glm::dvec3& normal) const;
  // Without the shade of the surface.
  [[nodiscard]] Color color(const Seen& at) const;
  // What is near the pixels whose middles are at most that many pixels away along x and y, if their
  // places lie about as those of a plane. False at limbs, at poles and where there are too many
  // lines.
  bool find_near(const Seen& middle, double pixels, Near& near) const;
  // The same colour as without `near`, faster.
  [[nodiscard]] Color color(const Seen& at, const Near& near) const;
  // That of all these pixels if `is_even`.
  [[nodiscard]] Color even_color(const Near& near) const {
    return near.is_land ? style_.land : style_.sea;
  }

 private:
  struct Distances;
  [[nodiscard]] double reach() const;
  [[nodiscard]] double graticule_at(const Located& at, const Seen& seen) const;
  [[nodiscard]] bool is_near_graticule(const Place& place, double east, double north) const;
  [[nodiscard]] Color blend(const Located& at, const Seen& seen, const Distances& distances) const;

  std::shared_ptr<const Map> map_;
  Style style_;
};

}  // namespace windsplat::ground
