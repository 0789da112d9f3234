// Where a camera turns about the vertical so that the data stay in the picture.
#pragma once

#include "protocol/view.hpp"
#include "server/scene/completed_view.hpp"

namespace windsplat::scene {

// A camera and the point of the vertical axis about which it turns (movie::turned).
struct Turn {
  protocol::CameraView camera;
  protocol::Vec3 centre{};
};

// `asked`: the view before it was completed. If it states eye or target, its camera turns about the
// target. The default camera turns about the centre of the box, so far away that every camera of
// the turn shows the whole box with the margins that the default one has; the height of the picture
// of a parallel projection grows likewise.
Turn turn_of(const protocol::View& asked, const CompletedView& completed, double degrees);

}  // namespace windsplat::scene
