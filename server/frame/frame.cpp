// View -> completed view -> scene -> linear pixels -> encoded bytes, each stage timed.
#include "server/frame/frame.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/engine/reference/reference.hpp"
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

// A JPEG's pixels become codes tile by tile, while they are near; the other formats need them all.
Result<engine::WorkReport> render_scene(const scene::Scene& scene, ThreadPool& pool,
                                        const CancelToken& cancel, Drawn& drawn) {
  const bool jpeg = drawn.encoding.format == Format::jpeg;
  const int width = scene.camera.width;
  const int height = scene.camera.height;
  image::YccPicture& planes = drawn.planes;
  if (jpeg) planes.reset(width, height, drawn.encoding.subsampling, scene.background);
  if (scene.method == scene::Method::reference) {
    auto truth = engine::reference::render(scene, pool, cancel);
    if (!truth) return truth.error();
    drawn.picture = {truth->width, truth->height, {truth->rgba.begin(), truth->rgba.end()}};
    const std::size_t stride = std::size_t{4} * static_cast<std::size_t>(width);
    if (jpeg) planes.put({0, 0, width, height, drawn.picture.rgba.data(), stride});
    engine::WorkReport work;
    work.variant = "reference double";
    return work;
  }
  if (jpeg) {
    return engine::render(scene, pool, cancel, [&planes](const engine::TilePixels& tile) {
      planes.put({tile.x, tile.y, tile.width, tile.height, tile.rgba, tile.stride});
    });
  }
  engine::Image& picture = drawn.picture;
  picture.width = width;
  picture.height = height;
  picture.rgba.assign(4 * static_cast<std::size_t>(width) * height, 0.0F);
  return engine::render(scene, pool, cancel, engine::sink_into(picture));
}

Result<image::Bytes> bytes_of(const Drawn& drawn, image::JpegEncoder& jpeg, ThreadPool& pool) {
  const Encoding& encoding = drawn.encoding;
  const engine::Image& picture = drawn.picture;
  const int width = picture.width;
  const int height = picture.height;
  if (encoding.format == Format::jpeg) {
    image::Bytes bytes;
    if (auto done = jpeg.encode(drawn.planes, encoding.quality, pool, bytes); !done) {
      return done.error();
    }
    return bytes;
  }
  if (encoding.format == Format::npy) return image::encode_npy(picture.rgba, width, height);
  return image::encode_png(image::tone_map(picture.rgba, width, height, drawn.background), width,
                           height);
}

}  // namespace

Result<void> draw(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                  ThreadPool& pool, const CancelToken& cancel, Drawn& drawn) {
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
  protocol::View leveled = *completed;
  leveled.image.width = std::max(1, leveled.image.width >> encoding.level);
  leveled.image.height = std::max(1, leveled.image.height >> encoding.level);
  const Result<scene::Scene> scene = scene::build_scene(leveled, dataset);
  if (!scene) return scene.error();
  drawn.encoding = encoding;
  drawn.background = scene->background;
  Result<engine::WorkReport> work = render_scene(*scene, pool, cancel, drawn);
  if (!work) return work.error();

  drawn.frame = Frame();
  drawn.frame.width = scene->camera.width;
  drawn.frame.height = scene->camera.height;
  drawn.frame.work = std::move(*work);
  name_fields(*scene, *completed, drawn.frame.work);
  drawn.frame.view = std::move(*completed);
  drawn.frame.render_us = microseconds(start, Clock::now());
  return {};
}

Result<Frame> encode(Drawn& drawn, image::JpegEncoder& jpeg, ThreadPool& pool) {
  const Clock::time_point start = Clock::now();
  Result<image::Bytes> bytes = bytes_of(drawn, jpeg, pool);
  if (!bytes) return bytes.error();
  drawn.frame.bytes = std::move(*bytes);
  drawn.frame.encode_us = microseconds(start, Clock::now());
  return std::move(drawn.frame);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace) {
  auto drawn = draw(view, dataset, encoding, pool, cancel, workspace.drawn);
  if (!drawn) return drawn.error();
  return encode(workspace.drawn, workspace.jpeg, pool);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel) {
  Workspace workspace;
  return produce(view, dataset, encoding, pool, cancel, workspace);
}

}  // namespace windsplat::frame
