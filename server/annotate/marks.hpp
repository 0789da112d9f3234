// North arrow, scale bar, title and time.
#pragma once

#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// Each adds nothing where it has nothing to say: north without longitudes and latitudes, a scale
// bar without a length on the ground.
// North at the centre of the picture, foreshortened as it is seen.
void add_north(const Subject& subject, const Style& style, Figure& figure);
// A round length across the line of sight at the centre of the box.
void add_scale_bar(const Subject& subject, const Style& style, Figure& figure);
// Title of the view or of the dataset, and below it the time of the step with its number of all
// steps, and what a difference subtracts.
void add_heading(const Subject& subject, const Style& title, const Style& time, Figure& figure);

}  // namespace windsplat::annotate
