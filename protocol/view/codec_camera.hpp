// Cameras and paths of cameras <-> JSON tree.
#pragma once

#include <string>

#include "protocol/camera_path.hpp"
#include "protocol/codec_json.hpp"
#include "protocol/view.hpp"

namespace windsplat::protocol {

CameraView read_camera(const Json& json, const std::string& pointer, Faults& faults);
Json camera_to_json(const CameraView& camera);

// The value is valid only without faults.
CameraPath read_camera_path(const Json& json, const std::string& pointer, Faults& faults);

}  // namespace windsplat::protocol
