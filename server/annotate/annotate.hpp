// View + scene + dataset -> the figure of its annotations. Pure.
#pragma once

#include "server/annotate/figure.hpp"
#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// Whether a view shows any annotation.
[[nodiscard]] bool any(const protocol::AnnotationsView& annotations);

// The annotations that the view shows, in pixels of the picture of its scene's camera.
[[nodiscard]] Figure figure_of(const Subject& subject);

}  // namespace windsplat::annotate
