// View -> completed view -> scene -> linear pixels -> encoded bytes, each stage timed.
#include "server/frame/frame.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/kept.hpp"
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

Result<engine::WorkReport> render_reference(const scene::Scene& scene, ThreadPool& pool,
                                            const CancelToken& cancel, engine::Image& picture) {
  auto truth = engine::reference::render(scene, pool, cancel);
  if (!truth) return truth.error();
  picture = {truth->width, truth->height, {truth->rgba.begin(), truth->rgba.end()}};
  engine::WorkReport work;
  work.variant.reference = true;
  return work;
}

// A JPEG's pixels become codes tile by tile, while they are near; the other formats need them all.
Result<engine::WorkReport> render_scene(const scene::Scene& scene, ThreadPool& pool,
                                        const CancelToken& cancel, Workspace& workspace) {
  engine::Image& picture = workspace.space.image();
  image::YccPicture& planes = workspace.planes;
  const bool jpeg = workspace.encoding.format == Format::jpeg;
  if (jpeg) {
    picture = {};
    planes.reset(scene.camera.width, scene.camera.height, workspace.encoding.subsampling,
                 scene.background);
  }
  if (scene.method == scene::Method::reference) {
    auto work = render_reference(scene, pool, cancel, picture);
    const std::size_t stride = std::size_t{4} * static_cast<std::size_t>(picture.width);
    if (work && jpeg) {
      planes.put({0, 0, picture.width, picture.height, picture.rgba.data(), stride});
    }
    return work;
  }
  const auto to_planes = [&planes](const engine::TilePixels& tile) {
    planes.put({tile.x, tile.y, tile.width, tile.height, tile.rgba, tile.stride});
  };
  auto work = jpeg ? engine::render(scene, pool, cancel, workspace.space, to_planes)
                   : engine::render(scene, pool, cancel, workspace.space);
  if (work) work->variant.level = scene.level;
  return work;
}

Result<image::Bytes> bytes_of(Workspace& workspace, ThreadPool& pool) {
  const Encoding& encoding = workspace.encoding;
  if (encoding.format == Format::jpeg) {
    image::Bytes bytes;
    auto done = workspace.jpeg.encode(workspace.planes, encoding.quality, pool, bytes);
    if (!done) return done.error();
    return bytes;
  }
  const auto& [width, height, rgba] = workspace.space.image();
  if (encoding.format == Format::npy) return image::encode_npy(rgba, width, height);
  return image::encode_png(image::tone_map(rgba, width, height, workspace.background), width,
                           height);
}

}  // namespace

Result<void> draw(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                  ThreadPool& pool, const CancelToken& cancel, Workspace& workspace) {
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
  Result<scene::Completed> completed = scene::complete_and_place(view, dataset);
  if (!completed) return completed.error();

  // Defaults come from the whole picture, so that every level frames the volume alike; radii follow
  // the height that is drawn.
  protocol::ImageView& image = completed->view.image;
  image.width = std::max(1, view.image.width >> encoding.level);
  image.height = std::max(1, view.image.height >> encoding.level);
  const Result<scene::Scene> scene = scene::build_scene(*completed, dataset);
  if (!scene) return scene.error();
  workspace.encoding = encoding;
  workspace.background = scene->background;
  Result<engine::WorkReport> work = render_scene(*scene, pool, cancel, workspace);
  if (!work) return work.error();

  Frame& drawn = workspace.drawn;
  drawn = Frame();
  drawn.width = scene->camera.width;
  drawn.height = scene->camera.height;
  drawn.work = std::move(*work);
  name_fields(*scene, completed->view, drawn.work);
  drawn.view = std::move(completed->view);
  drawn.view.image = view.image;
  drawn.render_us = microseconds(start, Clock::now());
  return {};
}

Result<Frame> encode(Workspace& workspace, ThreadPool& pool) {
  const Clock::time_point start = Clock::now();
  Result<image::Bytes> bytes = bytes_of(workspace, pool);
  // Nobody needs the pixels any more, and many of them are not kept.
  give_back(workspace.space.image().rgba, 0, 4 * kept_pixels);
  if (!bytes) return bytes.error();
  Frame frame = std::move(workspace.drawn);
  frame.bytes = std::move(*bytes);
  frame.encode_us = microseconds(start, Clock::now());
  return frame;
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace) {
  if (auto drawn = draw(view, dataset, encoding, pool, cancel, workspace); !drawn) {
    return drawn.error();
  }
  return encode(workspace, pool);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel) {
  Workspace workspace;
  return produce(view, dataset, encoding, pool, cancel, workspace);
}

}  // namespace windsplat::frame
