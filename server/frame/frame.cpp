// View -> completed view -> scene -> linear pixels -> encoded bytes, each stage timed.
#include "server/frame/frame.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/trim_storage.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/measure.hpp"
#include "server/image/decode.hpp"
#include "server/quality/setting.hpp"
#include "server/scene/build.hpp"

namespace windsplat::frame {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int half_level_max = 31;

std::int64_t microseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration_cast<std::chrono::microseconds>(to - from).count();
}

// Where memory is wanting it is said at once what all fields of the view need, not one by one.
Error with_need(Error error, const protocol::View& view, const data::Dataset& dataset) {
  return dataset.with_need(std::move(error), scene::fields_of(view, dataset.info()));
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

}  // namespace

// Defaults come from the whole picture, so that every level frames the volume alike; radii follow
// the height that is drawn.
Result<scene::Completed> complete_at(const protocol::View& view, data::Dataset& dataset,
                                     const Encoding& encoding) {
  if (encoding.half_level < 0 || encoding.half_level > half_level_max) {
    return make_error(ErrorKind::invalid, "a frame's half level is 0 to " +
                                              std::to_string(half_level_max) + ", not " +
                                              std::to_string(encoding.half_level));
  }
  Result<scene::Completed> completed = scene::complete_and_place(view, dataset);
  if (!completed) return completed;
  protocol::ImageView& image = completed->view.image;
  image.width = quality::edge_at(view.image.width, encoding.half_level);
  image.height = quality::edge_at(view.image.height, encoding.half_level);
  completed->coarser = encoding.coarser;
  return completed;
}

namespace {

Result<engine::WorkReport> render_reference(const scene::Scene& scene, ThreadPool& pool,
                                            const CancelToken& cancel, engine::Image& picture) {
  auto truth = engine::reference::render(scene, pool, cancel);
  if (!truth) return truth.error();
  picture = {truth->width, truth->height, {truth->rgba.begin(), truth->rgba.end()}};
  engine::WorkReport work;
  work.variant.reference = true;
  return work;
}

// A JPEG's pixels become codes tile by tile, while they are near; the other formats need them all,
// and so does what is measured.
// Whole MCU rows at a time.
void put_in_strips(const engine::Image& picture, ThreadPool& pool, image::YccPicture& planes) {
  constexpr int strip_rows = 32;
  const auto stride = std::size_t{4} * static_cast<std::size_t>(picture.width);
  const int strips = (picture.height + strip_rows - 1) / strip_rows;
  pool.run(static_cast<std::size_t>(strips), [&](std::size_t n, unsigned) {
    const int y = static_cast<int>(n) * strip_rows;
    planes.put({0, y, picture.width, std::min(strip_rows, picture.height - y),
                picture.rgba.data() + stride * static_cast<std::size_t>(y), stride});
  });
}

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
  const bool measured = is_measured(scene, workspace.encoding);
  const auto to_planes = [&planes](const engine::TilePixels& tile) {
    planes.put({tile.x, tile.y, tile.width, tile.height, tile.rgba, tile.stride});
  };
  auto work = jpeg && !measured ? engine::render(scene, pool, cancel, workspace.space, to_planes)
                                : engine::render(scene, pool, cancel, workspace.space);
  if (work && jpeg && measured) {
    put_in_strips(picture, pool, planes);
  }
  if (work) work->variant.level = scene.level;
  return work;
}

// Of pixels that nobody will encode nothing is kept: they may be half a gigabyte.
Error given_up(Error error, Workspace& workspace) {
  trim_storage(workspace.space.image().rgba, 0, 0);
  return error;
}

Result<image::Bytes> bytes_of(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel) {
  const Encoding& encoding = workspace.encoding;
  if (encoding.format == Format::jpeg) {
    image::Bytes bytes;
    auto done = workspace.jpeg.encode(workspace.planes, encoding.quality, pool, bytes, cancel);
    if (!done) return done.error();
    return bytes;
  }
  const auto& [width, height, rgba] = workspace.space.image();
  if (encoding.format == Format::npy) return image::encode_npy(rgba, width, height, cancel);
  return image::encode_png(image::tone_map(rgba, width, height, workspace.background, cancel),
                           width, height, cancel);
}

}  // namespace

std::uint64_t bytes_beyond_kept(int width, int height, Format format) {
  const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  if (pixels <= retained_pixels) return 0;
  constexpr std::uint64_t linear = 4 * sizeof(float);
  constexpr std::uint64_t codes = 4;  // 8 bits each, and as many of what is encoded
  const std::uint64_t bytes_a_pixel = format == Format::jpeg  ? 2 * codes
                                      : format == Format::png ? linear + 2 * codes
                                                              : 2 * linear;
  return (pixels - retained_pixels) * bytes_a_pixel;
}

Result<std::shared_ptr<const void>> load(const protocol::View& view, data::Dataset& dataset,
                                         const Encoding& encoding) {
  auto completed = complete_at(view, dataset, encoding);
  if (!completed) return with_need(completed.error(), view, dataset);
  auto scene = scene::build_scene(*completed, dataset);
  if (!scene) return with_need(scene.error(), view, dataset);
  return std::shared_ptr<const void>(std::make_shared<const scene::Scene>(std::move(*scene)));
}

Result<void> draw(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                  ThreadPool& pool, const CancelToken& cancel, Workspace& workspace) {
  if (view.method.name == protocol::MethodName::reference && !encoding.allow_reference) {
    return make_error_at(ErrorKind::invalid, "/method/name",
                         "reference takes too long to share a server: draw it with "
                         "`windsplat render`");
  }
  const Clock::time_point start = Clock::now();
  Result<scene::Completed> completed = complete_at(view, dataset, encoding);
  if (!completed) return with_need(completed.error(), view, dataset);
  const Result<scene::Scene> scene = scene::build_scene(*completed, dataset);
  if (!scene) return with_need(scene.error(), view, dataset);
  workspace.encoding = encoding;
  workspace.background = scene->background;
  Result<engine::WorkReport> work = render_scene(*scene, pool, cancel, workspace);
  if (!work) return given_up(work.error(), workspace);

  Frame& drawn = workspace.drawn;
  drawn = Frame();
  drawn.width = scene->camera.width;
  drawn.height = scene->camera.height;
  drawn.work = std::move(*work);
  name_fields(*scene, completed->view, drawn.work);
  drawn.view = completed->view;
  drawn.view.image = view.image;
  const Result<double> detail = scene::detail_shown(*completed);
  if (!detail) return given_up(detail.error(), workspace);
  drawn.detail = *detail * view.image.height / drawn.height;
  drawn.render_us = microseconds(start, Clock::now());
  if (is_measured(*scene, encoding)) {
    auto error = measured_error(*completed, *scene, dataset, pool, cancel, workspace);
    if (!error) return given_up(error.error(), workspace);
    drawn.error = *error;
    drawn.measure_us = microseconds(start, Clock::now()) - drawn.render_us;
  }
  return {};
}

Result<Frame> encode(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel) {
  const Clock::time_point start = Clock::now();
  Result<image::Bytes> bytes = bytes_of(workspace, pool, cancel);
  // Nobody needs the pixels any more, and many of them are not kept; those of a JPEG, which only
  // its measurement needed, are not at all.
  const bool jpeg = workspace.encoding.format == Format::jpeg;
  trim_storage(workspace.space.image().rgba, 0, jpeg ? 0 : 4 * retained_pixels);
  if (!bytes) return bytes.error();
  Frame frame = std::move(workspace.drawn);
  frame.bytes = std::move(*bytes);
  frame.encode_us = microseconds(start, Clock::now());
  if (workspace.encoding.measure && workspace.encoding.format == Format::jpeg) {
    const auto error = image::encoding_error(workspace.planes, frame.bytes);
    if (!error) return error.error();
    frame.jpeg_error = *error;
  }
  return frame;
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace) {
  if (auto drawn = draw(view, dataset, encoding, pool, cancel, workspace); !drawn) {
    return drawn.error();
  }
  return encode(workspace, pool, cancel);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel) {
  Workspace workspace;
  return produce(view, dataset, encoding, pool, cancel, workspace);
}

}  // namespace windsplat::frame
