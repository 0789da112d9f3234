#include "server/scene/presets.hpp"

#include <array>
#include <string_view>

#include "server/scene/camera.hpp"

namespace windsplat::scene {

namespace {

constexpr std::array<std::string_view, 5> names = {"default", "winds", "clouds", "top", "south"};

}  // namespace

std::vector<std::string> preset_names() { return {names.begin(), names.end()}; }

Result<void> apply_preset(protocol::View& completed, const Lattice& lattice,
                          const std::string& preset) {
  if (preset == "default") {
    protocol::CameraView& camera = completed.camera;
    camera.eye.reset();
    camera.target.reset();
    camera.height.reset();
    camera.up = protocol::CameraView{}.up;
    complete_camera(completed, lattice);
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
