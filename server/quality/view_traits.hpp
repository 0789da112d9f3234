// What of a view its error and its time depend on: how it looks, and where it is seen from.
#pragma once

#include <string>

#include "protocol/view.hpp"

namespace windsplat::quality {

struct Viewpoint {
  double height = 1;                  // of the picture at the volume's middle, world units
  protocol::Vec3 direction{0, 1, 0};  // from the eye, unit
  int width = 1;                      // of the view's picture, pixels
  int pixels_high = 1;
  // How many times larger the finest cells are than those that the picture averages; 0: it averages
  // none, or it is not known.
  double detail = 0;
};

// Of a view whose camera says where it is; what it leaves to its default is taken from `otherwise`.
// Its detail is scaled from that one's by how large the volume is in the picture.
Viewpoint viewpoint_of(const protocol::View& view, const Viewpoint& otherwise = {});

// Truths are drawn until no more light than this gets through: nothing is left that 8 bits show.
inline constexpr double stop_of_the_truth = 1.5e-4;

// What a view shows, as far as it decides how errors behave before anything was measured.
struct Kind {
  bool lines = true;
  bool medium = true;
  double length = 0;     // of the lines, world units; by default 5 cells; 0: not known
  double radius = 1.4;   // of their heads, pixels at a picture height of 720
  double depth = 1;      // optical, of a line's length of the densest medium
  double thickness = 1;  // of slabs, cells
  double rule = 0;       // what another compositing than the exact one errs, at a slab's thickness
  double stop = 0;       // and an early stop, however thin slabs are
};

// What a completed view's errors depend on but for where it is looked at from and at which step:
// equal keys for views of one style. An empty key is of no style.
struct SceneSignature {
  std::string key;
  std::string dataset;  // its id
  Kind kind;
};
SceneSignature signature_of(const protocol::View& completed);

// How far two sights are apart: about 1 where what was measured at one says little of the other.
double distance(const Viewpoint& a, const Viewpoint& b);

}  // namespace windsplat::quality
