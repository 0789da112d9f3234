#include "server/scene/presets.hpp"

#include <array>
#include <string_view>

#include "server/scene/camera.hpp"
#include "server/scene/lines/mark.hpp"

namespace windsplat::scene {

namespace {

constexpr std::array<std::string_view, 6> names = {"default", "winds", "clouds",
                                                   "top",     "south", "figure"};

void look_by_default(protocol::View& completed, const Lattice& lattice) {
  protocol::CameraView& camera = completed.camera;
  camera.eye.reset();
  camera.target.reset();
  camera.height.reset();
  camera.up = protocol::CameraView{}.up;
  complete_camera(completed, lattice);
}

}  // namespace

std::vector<std::string> preset_names() { return {names.begin(), names.end()}; }

Result<void> apply_preset(protocol::View& completed, const Lattice& lattice,
                          const std::string& preset) {
  if (preset == "default") {
    look_by_default(completed, lattice);
  } else if (preset == "figure") {
    protocol::AnnotationsView& shown = completed.annotations;
    shown.box = shown.axes = shown.north = shown.scale_bar = true;
    shown.legend = shown.title = shown.step_time = shown.contour_labels = true;
    draw_true_colors(completed.vector);
    look_by_default(completed, lattice);  // with room for texts
  } else if (preset == "winds") {
    completed.scalars.emplace();
  } else if (preset == "clouds") {
    completed.vector.field = {protocol::FieldChoice::Kind::none, ""};
  } else if (preset == "top") {
    orbit(completed, lattice, 0, 90, 1);
  } else if (preset == "south") {
    orbit(completed, lattice, 0, 0, 1);
  } else {
    return make_error_at(ErrorKind::invalid, "/preset",
                         "unknown preset \"" + printable(preset) + "\"");
  }
  return {};
}

}  // namespace windsplat::scene
