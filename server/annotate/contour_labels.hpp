// The values of contours, written along their lines.
#pragma once

#include <cstdint>
#include <vector>

#include "server/annotate/subject.hpp"
#include "server/scene/scene.hpp"
#include "server/surface/shown.hpp"

namespace windsplat::annotate {

// The values of lines within [least, most] that are numbered: the levels, and of the multiples of
// the interval all, or where there are more than `most_lines` of them every 2nd, 5th, 10th and so
// on. Ascending, each once.
std::vector<double> numbered_levels(const surface::Contours& contours, double least, double most,
                                    int most_lines);

// The decimals of a value: as many as the interval has of which it is a multiple, or as the level
// has, at most 6 digits.
std::string level_text(const surface::Contours& contours, double level);

// Adds the numbers: of each line one for each 24 em of its length in the picture, where it is
// nearly straight for the width of the text and the surface not seen edge-on, upright, in the
// colour of the line with a rim that contrasts. None where the place is hidden (Subject::hidden),
// and none over another text. Levels whose lines have too many segments, as those of noise, are
// left out: of more than 2^19 in one, or 2^21 in all, the levels with the most. Incomplete if
// cancelled.
void add_contour_labels(const Subject& subject, const Style& style, Figure& figure);

// Memory that they need while they are made.
std::uint64_t contour_label_bytes(const scene::Scene& scene);

}  // namespace windsplat::annotate
