// The box of the data with ticks and the names of its axes.
#pragma once

#include "server/annotate/subject.hpp"

namespace windsplat::annotate {

// Adds the edges of the box: those of two sides that face the eye lie over the picture, all others
// under it. Exact for any data, which the box contains. Nothing on a globe.
void add_box(const Subject& subject, const Style& style, Figure& figure);

// Adds ticks, their values and the name of each axis along an edge of the box: of x and y the
// lowest of the floor that belongs to the outline or lies within a label's width of it, otherwise
// the lowest of the outline, and of z the leftmost one. An axis of one sample has one tick. An axis
// that appears shorter than two texts, or has no edge in the outline, is left out.
void add_axes(const Subject& subject, const Style& style, Figure& figure);

}  // namespace windsplat::annotate
