#include "server/scene/presets.hpp"

#include <array>
#include <string_view>

#include "server/base/nearest_word.hpp"
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

namespace {

// The preset that may be meant, or all.
std::string known_presets(const std::string& name) {
  if (std::string meant = did_you_mean(name, preset_names()); !meant.empty()) return meant;
  std::string list;
  for (const std::string_view each : names) {
    list.append(list.empty() ? "; presets: " : ", ").append(each);
  }
  return list;
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
                         "unknown preset \"" + printable(preset) + "\"" + known_presets(preset));
  }
  return {};
}

}  // namespace windsplat::scene
