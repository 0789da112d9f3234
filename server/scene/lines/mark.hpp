// Widths and marks of lines in pixels; marks show their direction and their order in depth.
#pragma once

#include "protocol/view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::scene {

// Whether a completed view asks for more than lines of constant width and light.
bool is_marked(const protocol::MarkView& mark);

// The darkening of the tails of lines whose view gives none: lines that keep the hue of the map
// have dark tails if nothing else tells their heads.
double default_darkening(const protocol::VectorView& vector);

// Changes the lines of a completed view to the colours of the map.
void draw_true_colors(protocol::VectorView& completed);

// Line radii in pixels of this picture. A line thinner than the pixel filter is drawn with the
// width of the filter and less opacity: with the half width h = (r1 + r2) / 2, r1 = max(0, h -
// 1/2), r2 = max(1, h + 1/2), opacity times min(1, 2 h).
void set_radii(const protocol::VectorView& from, int height, VectorLayer& layer);

// The mark of the lines of a completed view, in a picture of this height.
LineMark mark_of(const protocol::VectorView& from, int height);

}  // namespace windsplat::scene
