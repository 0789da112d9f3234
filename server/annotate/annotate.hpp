// View + scene + dataset -> the figure of its annotations. Pure.
#pragma once

#include <cstdint>

#include "server/annotate/figure.hpp"
#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// Whether a view shows any annotation.
[[nodiscard]] bool any(const protocol::AnnotationsView& annotations);

// Memory that figure_of() needs while it runs, beyond a few kilobytes.
[[nodiscard]] std::uint64_t working_bytes(const protocol::AnnotationsView& annotations,
                                          const scene::Scene& scene);

// The annotations that the view shows, in pixels of the picture of its scene's camera. Incomplete
// if subject.cancel is raised.
[[nodiscard]] Figure figure_of(const Subject& subject);

}  // namespace windsplat::annotate
