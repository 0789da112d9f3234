// What the colours, lengths and opacities of a picture mean.
#pragma once

#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// A card for the lines and one for each medium and surface, in rows from the lower left corner;
// smaller where they would cover more than 0.6 of the height.
void add_legend(const Subject& subject, const Style& style, Figure& figure);

}  // namespace windsplat::annotate
