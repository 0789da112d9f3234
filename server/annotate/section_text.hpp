// Where a section lies, in the coordinates of the data.
#pragma once

#include <optional>
#include <string>

#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// A layer: "section at 500 hPa", "section at 45°N", "section at y = 12 km", and where rows or
// columns of a grid have no coordinate of their own, "section at row j = 12". Between two layers it
// is at the coordinate that the axis has there.
std::string section_text(const Subject& subject, const protocol::SliceView& slice);

// A plane: as a layer where it lies across an axis; otherwise "vertical section through 10°E, 45°N"
// or "oblique section through 10°E, 45°N, 500 hPa", the place nearest to the middle of the box.
// Where the box has no coordinates of the data, as on a globe, "vertical section" or "oblique
// section".
std::string section_text(const Subject& subject, const protocol::PlaneView& plane);

// Of a view that is a section as a whole; nullopt: it is not.
std::optional<std::string> section_of_view(const Subject& subject);

}  // namespace windsplat::annotate
