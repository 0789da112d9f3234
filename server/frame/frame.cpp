// View -> completed view -> scene -> linear image -> encoded bytes, each stage timed.
#include "server/frame/frame.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/engine/render.hpp"
#include "server/scene/build.hpp"

namespace windsplat::frame {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int level_max = 15;

std::int64_t microseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration_cast<std::chrono::microseconds>(to - from).count();
}

void name_field(const std::string& name, std::int64_t bytes, engine::WorkReport& work) {
  if (std::find(work.fields.begin(), work.fields.end(), name) != work.fields.end()) return;
  work.fields.push_back(name);
  work.bytes += bytes;
}

void name_field(const data::Volume& volume, const std::string& name, engine::WorkReport& work) {
  name_field(name, static_cast<std::int64_t>(volume.bytes()), work);
}

// The engine knows volumes, not names: the scene's layers are the view's, in its order, without
// those that absorb nothing. A field drawn twice counts once.
void name_fields(const scene::Scene& scene, const protocol::View& completed,
                 engine::WorkReport& work) {
  work.fields.clear();
  work.bytes = 0;
  if (scene.vector) {
    name_field(*scene.vector->field, completed.vector.field.name, work);
    if (scene.vector->color_field) {
      name_field(*scene.vector->color_field, completed.vector.color.field.value(), work);
    }
  }
  auto layer = scene.scalars.begin();
  for (const protocol::ScalarView& scalar : completed.scalars.value()) {
    if (layer == scene.scalars.end()) break;
    if (layer->extinction != scalar.extinction.value()) continue;
    name_field(*layer->field, scalar.field, work);
    ++layer;
  }
  WINDSPLAT_CHECK(layer == scene.scalars.end());
  if (const auto& heights = completed.geometry.height_field) {
    const auto& dims = scene.lattice.dims;
    const std::int64_t samples = std::int64_t{dims[0]} * dims[1] * dims[2];
    name_field(*heights, samples * static_cast<std::int64_t>(sizeof(float)), work);
  }
}

// " level=1,1,0": how often each axis was halved; nothing where none was.
void name_level(const std::array<int, 3>& level, engine::WorkReport& work) {
  if (level == std::array{0, 0, 0}) return;
  work.variant += " level=";
  for (std::size_t a = 0; a < 3; ++a) {
    if (a > 0) work.variant += ',';
    work.variant += std::to_string(level.at(a));
  }
}

// The picture is space.image().
Result<engine::WorkReport> render_scene(const scene::Scene& scene, ThreadPool& pool,
                                        const CancelToken& cancel, engine::RenderSpace& space) {
  if (scene.method != scene::Method::reference) {
    auto work = engine::render(scene, pool, cancel, space);
    if (work) name_level(scene.level, *work);
    return work;
  }
  auto truth = engine::reference::render(scene, pool, cancel);
  if (!truth) return truth.error();
  space.image() = {truth->width, truth->height, {truth->rgba.begin(), truth->rgba.end()}};
  engine::WorkReport work;
  work.variant = "reference double";
  return work;
}

Result<image::Bytes> encode(const engine::Image& picture, const std::array<float, 3>& background,
                            const Encoding& encoding) {
  const int width = picture.width;
  const int height = picture.height;
  if (encoding.format == Format::npy) return image::encode_npy(picture.rgba, width, height);
  const image::Bytes rgb = image::tone_map(picture.rgba, width, height, background);
  if (encoding.format == Format::png) return image::encode_png(rgb, width, height);
  return image::encode_jpeg(rgb, width, height, encoding.quality, encoding.subsampling);
}

}  // namespace

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel) {
  engine::RenderSpace space;
  return produce(view, dataset, encoding, pool, cancel, space);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, engine::RenderSpace& space) {
  if (encoding.level < 0 || encoding.level > level_max) {
    return make_error(ErrorKind::invalid, "a frame's level is 0 to " + std::to_string(level_max) +
                                              ", not " + std::to_string(encoding.level));
  }
  if (view.method.name == protocol::MethodName::reference && !encoding.allow_reference) {
    return make_error_at(ErrorKind::invalid, "/method/name",
                         "reference takes too long to share a server: draw it with "
                         "`windsplat render`");
  }
  const Clock::time_point start = Clock::now();
  Result<protocol::View> completed = scene::complete_view(view, dataset);
  if (!completed) return completed.error();

  // Defaults come from the whole picture, so that every level frames the volume alike; radii follow
  // the height that is drawn.
  protocol::View drawn = *completed;
  drawn.image.width = std::max(1, drawn.image.width >> encoding.level);
  drawn.image.height = std::max(1, drawn.image.height >> encoding.level);
  const Result<scene::Scene> scene = scene::build_scene(drawn, dataset);
  if (!scene) return scene.error();
  Result<engine::WorkReport> work = render_scene(*scene, pool, cancel, space);
  if (!work) return work.error();
  const engine::Image& picture = space.image();
  const Clock::time_point rendered_at = Clock::now();

  Result<image::Bytes> bytes = encode(picture, scene->background, encoding);
  if (!bytes) return bytes.error();
  const Clock::time_point encoded_at = Clock::now();

  Frame frame;
  frame.bytes = std::move(*bytes);
  frame.width = picture.width;
  frame.height = picture.height;
  frame.work = std::move(*work);
  name_fields(*scene, *completed, frame.work);
  frame.view = std::move(*completed);
  frame.render_us = microseconds(start, rendered_at);
  frame.encode_us = microseconds(rendered_at, encoded_at);
  return frame;
}

}  // namespace windsplat::frame
