// The properties of a view that determine its error and time: scene signature and viewpoint.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/view.hpp"
#include "server/quality/content.hpp"

namespace windsplat::quality {

struct Viewpoint {
  double height = 1;                  // height of the picture at the centre of the volume, world
                                      // units
  protocol::Vec3 direction{0, 1, 0};  // view direction from the eye, unit length
  int width = 1;                      // width of the picture, pixels
  int pixels_high = 1;
  // Size of the finest cells relative to that below which samples are merged; 0: never merged,
  // or unknown.
  double detail = 0;
  std::optional<Content> content = std::nullopt;  // empty: unknown
  // Hash of everything in the view beside its scene signature that changes what it shows: camera,
  // step, phase of motion and size of the picture. 0: unknown.
  std::uint64_t identity = 0;
};

// Whether both are of the same view, if they are of the same scene signature.
inline bool is_same_view(const Viewpoint& a, const Viewpoint& b) {
  return a.identity != 0 && a.identity == b.identity;
}

// The viewpoint of a view; values that the view leaves to defaults are taken from `otherwise`. The
// detail is that of `otherwise`, scaled by the size of the volume in the picture. The content is
// that of `otherwise` if this is of the same view, and else unknown.
Viewpoint viewpoint_of(const protocol::View& view, const Viewpoint& otherwise = {});

// Stop transmittance of reference pictures. Of pixels that all end there, less is lost than the
// least error that is reported (quality/laws.hpp).
inline constexpr double stop_of_the_truth = 1e-5;

// The properties of a scene that the prior depends on.
struct Kind {
  bool lines = true;
  bool medium = true;
  double radius = 1.4;   // radius of the lines, pixels at a picture height of 720
  double thickness = 1;  // thickness of slabs, cells
  double rule = 0;       // error of approximate compositing, at the slab thickness of the view
  double stop = 0;       // error of early termination where the content is unknown
  int lines_stride = 1;  // of lines, in samples
};

// Everything in a completed view that affects errors except camera, picture size and step, as a
// key. An empty key disables measurements.
struct SceneSignature {
  std::string key;
  std::string dataset;  // id of its dataset
  Kind kind;
};
SceneSignature signature_of(const protocol::View& completed);

// Share of the variance of unknown content that is left where the content of a view is that of
// another one: 0 for the same view, 1 far away.
double unknown_share(const Viewpoint& a, const Viewpoint& b);

// Distance of two viewpoints; at about 1, measurements at one are hardly informative about the
// other.
double distance(const Viewpoint& a, const Viewpoint& b);

}  // namespace windsplat::quality
