#include "protocol/view/codec_camera.hpp"

#include <cstddef>
#include <utility>

#include "protocol/codec_names.hpp"
#include "protocol/limits.hpp"
#include "protocol/view/codec_planes.hpp"

namespace windsplat::protocol {

namespace {

constexpr NumberRange camera_places{-limits::world_max, limits::world_max};
constexpr NumberRange keyframe_times{0, keyframe_at_max};

// What a keyframe needs of its camera: nothing is taken from the dataset or the view.
void check_complete(CameraView& camera, const std::string& pointer, Faults& faults) {
  if (!camera.projection) camera.projection = Projection::perspective;
  const auto need = [&](bool given, const char* key, const char* reason) {
    if (!given) faults.add(join_pointer(pointer, key), reason);
  };
  need(camera.eye.has_value(), "eye", "is required");
  need(camera.target.has_value(), "target", "is required");
  if (*camera.projection == Projection::orthographic) {
    need(camera.height.has_value(), "height", "is required with projection orthographic");
  }
}

class PathReader {
 public:
  explicit PathReader(Faults& faults) : faults_(faults) {}

  CameraPath read(const Json& json, const std::string& pointer) {
    ObjectReader reader(json, pointer, faults_);
    const Json* keyframes = reader.child("keyframes", Presence::required);
    reader.finish();
    if (keyframes == nullptr) return {};
    const std::string at = reader.at("keyframes");
    if (!keyframes->is_array() || keyframes->size() < keyframes_min ||
        keyframes->size() > keyframes_max) {
      faults_.add(at, "must be an array of " + std::to_string(keyframes_min) + " to " +
                          std::to_string(keyframes_max) + " keyframes, not " +
                          (keyframes->is_array() ? "of " + std::to_string(keyframes->size())
                                                 : described(*keyframes)));
      return {};
    }
    for (std::size_t n = 0; n < keyframes->size(); ++n) {
      add((*keyframes)[n], join_pointer(at, n));
    }
    return std::move(path_);
  }

 private:
  void add(const Json& json, const std::string& pointer) {
    const bool first = path_.keyframes.empty();
    const bool by_step = json.is_object() && json.contains("step");
    if (first && by_step) path_.unit = CameraPath::Unit::steps;
    const char* const key = path_.unit == CameraPath::Unit::steps ? "step" : "time";
    const char* const other = path_.unit == CameraPath::Unit::steps ? "time" : "step";
    CameraKeyframe keyframe;
    ObjectReader reader(json, pointer, faults_);
    reader.child(key, Presence::required);
    reader.number(key, keyframe.at, keyframe_times);
    if (reader.child(other) != nullptr) {
      faults_.add(reader.at(other), std::string("cannot be combined with ") + key +
                                        ": all keyframes have a time, or all have a step");
    }
    if (const Json* camera = reader.child("camera", Presence::required)) {
      keyframe.camera = read_camera(*camera, reader.at("camera"), faults_);
      check_complete(keyframe.camera, reader.at("camera"), faults_);
    }
    reader.finish();
    if (!first) check_order(keyframe, path_.keyframes.back(), key, pointer);
    path_.keyframes.push_back(keyframe);
  }

  void check_order(const CameraKeyframe& keyframe, const CameraKeyframe& last, const char* key,
                   const std::string& pointer) {
    if (!faults_.empty()) return;
    if (!(keyframe.at > last.at)) {
      faults_.add(join_pointer(pointer, key),
                  "must be above that of the keyframe before, " + number_text(last.at));
    }
    if (keyframe.camera.projection != last.camera.projection) {
      faults_.add(join_pointer(join_pointer(pointer, "camera"), "projection"),
                  "must be that of the first keyframe: a path cannot change it");
    }
  }

  Faults& faults_;
  CameraPath path_;
};

}  // namespace

CameraView read_camera(const Json& json, const std::string& pointer, Faults& faults) {
  CameraView camera;
  ObjectReader reader(json, pointer, faults);
  reader.choice("projection", camera.projection, projection_names);
  reader.numbers("eye", camera.eye, camera_places);
  reader.numbers("target", camera.target, camera_places);
  reader.numbers("up", camera.up, camera_places);
  reader.number("fovY", camera.fov_y, {limits::fov_min, limits::fov_max});
  reader.number("height", camera.height, {limits::view_height_min, limits::world_max});
  reader.finish();
  check_direction(camera.up, reader.at("up"), faults);
  return camera;
}

Json camera_to_json(const CameraView& camera) {
  Json out{{"projection", nullptr},
           {"eye", numbers_or_null(camera.eye)},
           {"target", numbers_or_null(camera.target)},
           {"up", numbers_to_json(camera.up)},
           {"fovY", canonical_number(camera.fov_y)},
           {"height", number_or_null(camera.height)}};
  if (camera.projection) out["projection"] = name_of(*camera.projection, projection_names);
  return out;
}

CameraPath read_camera_path(const Json& json, const std::string& pointer, Faults& faults) {
  return PathReader(faults).read(json, pointer);
}

Result<CameraPath> parse_camera_path(std::string_view json) {
  const auto tree = parse_json(json);
  if (!tree) return tree.error();
  Faults faults;
  CameraPath path = read_camera_path(*tree, "", faults);
  if (!faults.empty()) return faults.error();
  return path;
}

}  // namespace windsplat::protocol
