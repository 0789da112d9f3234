#include "server/frame/frame.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "server/annotate/annotate.hpp"
#include "server/annotate/paint/compose.hpp"
#include "server/annotate/paint/document.hpp"
#include "server/annotate/paint/type.hpp"
#include "server/base/check.hpp"
#include "server/base/trim_storage.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/content.hpp"
#include "server/frame/empty_picture.hpp"
#include "server/frame/measure.hpp"
#include "server/frame/pick/hidden.hpp"
#include "server/frame/report/detail.hpp"
#include "server/image/decode.hpp"
#include "server/image/video_encoder.hpp"
#include "server/quality/setting.hpp"
#include "server/scene/build.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"

namespace windsplat::frame {
namespace {

using Clock = std::chrono::steady_clock;

std::int64_t microseconds(Clock::time_point from, Clock::time_point to) {
  return std::chrono::duration_cast<std::chrono::microseconds>(to - from).count();
}

// An out-of-memory error states what all fields of the view need together.
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

// The engine has volumes without names: the layers of the scene correspond to those of the view, in
// the same order, without media of zero extinction. A field drawn twice counts once.
void name_fields(const scene::Scene& scene, const scene::CompletedView& view,
                 engine::WorkReport& work) {
  const protocol::View& completed = view.view();
  work.fields.clear();
  work.bytes = 0;
  if (scene.vector) {
    if (scene.vector->streamlets) work.streamlets = scene.vector->streamlets->tally;
    name_field(*scene.vector->field, completed.vector.field.name, work);
    if (scene.vector->color_field) {
      // On a plane the colours of other quantities are computed from the vectors.
      const bool by_scalar = completed.vector.color.by == protocol::ColorBy::scalar;
      name_field(*scene.vector->color_field,
                 by_scalar ? completed.vector.color.field.value() : completed.vector.field.name,
                 work);
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
    const auto& dims = view.lattice().dims;
    const std::int64_t samples = std::int64_t{dims[0]} * dims[1] * dims[2];
    name_field(*heights, samples * static_cast<std::int64_t>(sizeof(float)), work);
  }
}

}  // namespace

Result<void> check_title(const protocol::View& view) {
  const auto& title = view.annotations.title_text;
  const std::string missing = title ? annotate::character_without_glyph(*title) : std::string();
  if (missing.empty()) return {};
  return make_error_at(ErrorKind::invalid, "/annotations/titleText",
                       "has '" + missing + "', which the font, DejaVu Sans, lacks");
}

Result<scene::CompletedView> complete(const protocol::View& view, data::Dataset& dataset,
                                      bool allow_reference) {
  if (view.method.name == protocol::MethodName::reference && !allow_reference) {
    return make_error_at(ErrorKind::invalid, "/method/name",
                         "reference takes too long for a shared renderer: use "
                         "`POST /v1/references` or `windsplat render`");
  }
  if (auto ok = check_title(view); !ok) return ok.error();
  auto completed = scene::complete(view, dataset);
  if (!completed) return with_need(completed.error(), view, dataset);
  return completed;
}

Result<scene::CompletedView> at_setting(const scene::CompletedView& completed,
                                        const quality::Setting& setting) {
  return completed.coarsened(setting.coarser).with([&](protocol::View& view) {
    view = quality::at_setting(std::move(view), setting);
    const quality::PictureSize size = quality::size_at(view, setting);
    view.image.width = size.width;
    view.image.height = size.height;
  });
}

quality::Setting own_setting(const scene::CompletedView& completed) {
  return quality::settings[quality::own_setting(completed.view())];
}

namespace {

Result<engine::WorkReport> render_reference(const scene::Scene& scene, ThreadPool& pool,
                                            const CancelToken& cancel, Workspace& workspace) {
  auto truth = engine::reference::render(scene, pool, cancel, {}, workspace.rows_done);
  if (!truth) return truth.error();
  workspace.space.image() = {truth->width, truth->height, {truth->rgba.begin(), truth->rgba.end()}};
  engine::WorkReport work;
  work.variant.reference = true;
  return work;
}

void put_part(Workspace& workspace, const image::Part& part) {
  if (workspace.overlay) {
    annotate::put(*workspace.overlay, part, workspace.planes);
  } else {
    workspace.planes.put(part);
  }
}

// Converts a picture to YCbCr, in strips of whole MCU rows. Unmeasured JPEGs are converted tile by
// tile instead, while the pixels are in the cache.
void put_in_strips(const engine::Image& picture, ThreadPool& pool, Workspace& workspace) {
  constexpr int strip_rows = 32;
  const auto stride = std::size_t{4} * static_cast<std::size_t>(picture.width);
  const int strips = (picture.height + strip_rows - 1) / strip_rows;
  pool.run(static_cast<std::size_t>(strips), [&](std::size_t n, unsigned) {
    const int y = static_cast<int>(n) * strip_rows;
    put_part(workspace, {0, y, picture.width, std::min(strip_rows, picture.height - y),
                         picture.rgba.data() + stride * static_cast<std::size_t>(y), stride});
  });
}

quality::Halvings halvings_of(const Prepared& prepared, const data::Dataset& dataset) {
  quality::Halvings out{};
  const quality::PictureSize asked{prepared.asked.width, prepared.asked.height};
  for (std::size_t n = 0; n < out.size(); ++n) {
    const quality::Setting smaller{protocol::MethodName::kernel, static_cast<int>(n)};
    const int height = quality::size_at(asked, smaller).height;
    const std::array<int, 3> level = scene::level_at(prepared.completed, height, dataset);
    out[n] = static_cast<std::int8_t>(level[0] + level[1] + level[2]);
  }
  return out;
}

Result<engine::WorkReport> render_scene(const Prepared& prepared, ThreadPool& pool,
                                        const CancelToken& cancel, Workspace& workspace) {
  const scene::Scene& scene = prepared.scene;
  engine::Image& picture = workspace.space.image();
  image::YccPicture& planes = workspace.planes;
  const bool jpeg = workspace.encoding.format == Format::jpeg;
  if (jpeg) {
    picture = {};
    planes.reset(scene.camera.width, scene.camera.height, workspace.encoding.subsampling,
                 scene.background);
    if (workspace.overlay) annotate::put_empty(*workspace.overlay, pool, planes);
  }
  if (scene.method == scene::Method::reference) {
    auto work = render_reference(scene, pool, cancel, workspace);
    if (work && jpeg) put_in_strips(picture, pool, workspace);
    return work;
  }
  // Whether the pixels are compared with those of other pictures.
  const bool kept = is_measured(prepared) || !prepared.compared.empty();
  const auto to_planes = [&workspace](const engine::TilePixels& tile) {
    put_part(workspace, {tile.x, tile.y, tile.width, tile.height, tile.rgba, tile.stride});
  };
  auto work = jpeg && !kept ? engine::render(scene, pool, cancel, workspace.space, to_planes)
                            : engine::render(scene, pool, cancel, workspace.space);
  if (work && jpeg && kept) put_in_strips(picture, pool, workspace);
  if (work) work->variant.level = scene.level;
  return work;
}

// Content is that of the view, not of coarser data.
bool needs_content(const Prepared& prepared, const Frame& drawn) {
  const Encoding& encoding = prepared.encoding;
  const bool wanted = encoding.describe || (encoding.measure && !drawn.error) ||
                      (encoding.measure_change && !drawn.skipped_change);
  return wanted && prepared.setting.coarser == 0 &&
         prepared.scene.method != scene::Method::reference;
}

// The change needs the picture and is measured first, unless whether it is depends on the error.
Result<void> measure(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                     const CancelToken& cancel, Workspace& workspace) {
  Frame& drawn = workspace.drawn;
  const std::optional<double>& limit = drawn.view.quality.max_error;
  const auto measure_change = [&]() -> Result<void> {
    const auto change = measured_skipped_change(prepared, pool, cancel, workspace);
    if (!change) return change.error();
    drawn.skipped_change = *change;
    return {};
  };
  const bool wanted = prepared.encoding.measure_change && !drawn.skipped_change &&
                      is_change_measured(prepared.scene, drawn.work);
  const bool afterwards = wanted && limit.has_value();
  if (wanted && !afterwards) {
    if (auto done = measure_change(); !done) return done.error();
  }
  const auto error = measured_error(prepared, dataset, pool, cancel, workspace, afterwards);
  if (!error) return error.error();
  drawn.error = *error;
  const bool kept = !drawn.error || !limit || *drawn.error <= *limit;
  return afterwards && kept ? measure_change() : Result<void>();
}

bool is_transparent(const engine::Image& picture) {
  for (std::size_t at = 3; at < picture.rgba.size(); at += 4) {
    if (picture.rgba[at] > 0) return false;
  }
  return true;
}

// Pixels that are not encoded are freed: they may occupy half a gigabyte.
Error given_up(Error error, Workspace& workspace) {
  workspace.overlay.reset();
  trim_storage(workspace.space.image().rgba, 0, 0);
  return error;
}

// nullopt: the encoder failed.
std::optional<image::Bytes> video_of(Workspace& workspace) {
  const Encoding& encoding = workspace.encoding;
  auto unit = encoding.video->encode(workspace.planes, encoding.quality, encoding.key);
  if (!unit) {
    workspace.drawn.coded = Coded::video_failed;
    workspace.drawn.video_fault = unit.error().message;
    return std::nullopt;
  }
  workspace.drawn.coded = unit->key ? Coded::video_key : Coded::video;
  return std::move(unit->bytes);
}

Result<image::Bytes> bytes_of(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel) {
  const Encoding& encoding = workspace.encoding;
  if (encoding.format == Format::jpeg) {
    if (encoding.video != nullptr) {
      if (auto bytes = video_of(workspace)) return std::move(*bytes);
    }
    image::Bytes bytes;
    auto done = workspace.jpeg.encode(workspace.planes, encoding.quality, pool, bytes, cancel);
    if (!done) return done.error();
    return bytes;
  }
  auto& [width, height, rgba] = workspace.space.image();
  if (encoding.format == Format::npy) return image::encode_npy(rgba, width, height, cancel);
  if (workspace.overlay) annotate::composite(*workspace.overlay, pool, rgba);
  image::Bytes rgb = image::tone_map(rgba, width, height, workspace.background, cancel);
  if (encoding.format == Format::png && encoding.raw) return rgb;
  if (encoding.format == Format::png) {
    return image::encode_png(rgb, width, height, cancel, encoding.dots_per_inch);
  }
  if (encoding.raw) {
    workspace.drawn.figure = std::move(workspace.figure);
    return rgb;
  }
  annotate::Figure plain;
  plain.width = width;
  plain.height = height;
  const annotate::Figure& figure = workspace.figure ? *workspace.figure : plain;
  const double dots_per_inch = encoding.dots_per_inch.value_or(document_dots_per_inch);
  return encoding.format == Format::pdf ? annotate::encode_pdf(rgb, figure, dots_per_inch)
                                        : annotate::encode_svg(rgb, figure, dots_per_inch);
}

// Errors: those of Overlay::of.
Result<void> set_overlay(const Prepared& prepared, Workspace& workspace) {
  workspace.overlay.reset();
  workspace.figure = prepared.figure;
  if (!workspace.figure) return {};
  const Format format = prepared.encoding.format;
  annotate::Figure drawn = *workspace.figure;
  if (format == Format::pdf || format == Format::svg) drawn.above.clear();
  auto overlay = annotate::Overlay::of(drawn);
  if (!overlay) return overlay.error();
  workspace.overlay = std::move(*overlay);
  return {};
}

// Why surfaces of the scene have no triangles, if none has any.
Result<std::vector<std::string>> missing_surfaces(const Prepared& prepared,
                                                  data::Dataset& dataset) {
  const auto& surfaces = prepared.scene.surfaces;
  const auto has_some = [](const surface::Shown& shown) { return !shown.mesh->triangles.empty(); };
  if (surfaces.empty() || std::any_of(surfaces.begin(), surfaces.end(), has_some)) {
    return std::vector<std::string>();
  }
  return scene::why_no_surfaces(prepared.completed, dataset);
}

}  // namespace

std::uint64_t bytes_beyond_kept(int width, int height, Format format, bool annotated) {
  const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  // An overlay is not kept between frames, so all of it counts.
  const std::uint64_t overlay = annotated ? annotate::overlay_bytes(width, height) : 0;
  if (pixels <= retained_pixels) return overlay;
  constexpr std::uint64_t linear = 4 * sizeof(float);
  constexpr std::uint64_t codes = 4;  // 8 bits each, and as many for the encoded form
  std::uint64_t bytes_a_pixel = linear + 2 * codes;  // png
  if (format == Format::jpeg) bytes_a_pixel = 2 * codes;
  if (format == Format::npy) bytes_a_pixel = 2 * linear;
  // Another copy of the codes, and the encoded form within the document.
  if (format == Format::pdf || format == Format::svg) bytes_a_pixel += 3 * codes;
  return (pixels - retained_pixels) * bytes_a_pixel + overlay;
}

std::uint64_t surface_bytes(const scene::Scene& scene) { return engine::surface_bytes(scene); }

namespace {

// Errors: out_of_memory, cancelled.
Result<annotate::Figure> make_figure(const scene::CompletedView& drawn, const scene::Scene& scene,
                                     data::Dataset& dataset) {
  std::shared_ptr<const void> held;
  if (const std::uint64_t bytes = annotate::working_bytes(drawn.view().annotations, scene);
      bytes > 0) {
    auto reserved = dataset.reserve(bytes);
    if (!reserved) return reserved.error();
    held = std::move(*reserved);
  }
  const auto minus = dataset.subtrahend();
  const CancelToken cancel = dataset.cancellation();
  annotate::Figure figure = annotate::figure_of(
      {drawn, scene, dataset.info(), minus ? minus->info.get() : nullptr,
       [&](const std::vector<glm::dvec3>& at) { return hidden_places(scene, at, cancel); },
       cancel});
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "annotations cancelled");
  return figure;
}

// Whether the error of a coarser level than would suffice is found by comparing pictures.
bool compares_levels(const quality::Setting& setting, const scene::Scene& scene,
                     const Encoding& encoding) {
  const bool wanted = encoding.measure || encoding.describe || encoding.compare_levels;
  const double pixels = static_cast<double>(scene.camera.width) * scene.camera.height;
  return wanted && setting.half_level == 0 && setting.coarser == 0 &&
         pixels <= static_cast<double>(retained_pixels) && lacks_detail(data_drawn(scene));
}

}  // namespace

Result<Prepared> prepare(const scene::CompletedView& completed, const quality::Setting& setting,
                         data::Dataset& dataset, const Encoding& encoding,
                         scene::StandIn stand_in) {
  const Clock::time_point start = Clock::now();
  auto drawn = at_setting(completed, setting);
  if (!drawn) return drawn.error();
  auto scene = scene::build_scene(*drawn, dataset, stand_in);
  if (!scene) return with_need(scene.error(), completed.view(), dataset);
  std::optional<annotate::Figure> figure;
  if (encoding.format != Format::npy && annotate::any(drawn->view().annotations)) {
    auto made = make_figure(*drawn, *scene, dataset);
    if (!made) return made.error();
    figure = std::move(*made);
  }
  std::vector<scene::Scene> compared;
  if (compares_levels(setting, *scene, encoding)) {
    auto scenes = scenes_to_compare(*drawn, *scene, dataset);
    if (!scenes) return with_need(scenes.error(), completed.view(), dataset);
    compared = std::move(*scenes);
  }
  return Prepared{std::move(*drawn),
                  completed.view().image,
                  std::move(*scene),
                  setting,
                  encoding,
                  std::move(figure),
                  microseconds(start, Clock::now()),
                  {},
                  std::move(compared)};
}

Result<void> draw(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                  const CancelToken& cancel, Workspace& workspace) {
  const Clock::time_point start = Clock::now();
  const scene::Scene& scene = prepared.scene;
  workspace.encoding = prepared.encoding;
  workspace.background = scene.background;
  if (auto ok = set_overlay(prepared, workspace); !ok) return ok.error();
  Result<engine::WorkReport> work = render_scene(prepared, pool, cancel, workspace);
  if (!work) return given_up(work.error(), workspace);

  Frame& drawn = workspace.drawn;
  drawn = Frame();
  drawn.width = scene.camera.width;
  drawn.height = scene.camera.height;
  drawn.work = std::move(*work);
  name_fields(scene, prepared.completed, drawn.work);
  drawn.parts = parts_of(prepared.completed, scene, workspace.figure ? &*workspace.figure : nullptr,
                         workspace.space.ground_bytes());
  drawn.data_drawn = data_drawn(scene);
  drawn.view = prepared.completed.view();
  const bool transparent = drawn.work.variant.reference && is_transparent(workspace.space.image());
  auto missing = missing_surfaces(prepared, dataset);
  if (!missing) return given_up(missing.error(), workspace);
  drawn.empty = why_empty(scene, drawn.view, dataset, *missing, drawn.work, transparent);
  drawn.view.image = prepared.asked;
  drawn.detail = scene::detail_shown(prepared.completed) * prepared.asked.height / drawn.height;
  drawn.halvings = halvings_of(prepared, dataset);
  drawn.render_us = prepared.prepare_us + microseconds(start, Clock::now());
  const Clock::time_point measured_from = Clock::now();
  if (!drawn.work.variant.reference && drawn.work.skipped_bound == 0) drawn.skipped_change = 0;
  if (is_measured(prepared)) {
    auto done = measure(prepared, dataset, pool, cancel, workspace);
    if (!done) return given_up(done.error(), workspace);
  }
  drawn.content = prepared.content;
  if (!drawn.content && needs_content(prepared, drawn)) {
    const Clock::time_point described_from = Clock::now();
    drawn.content = content_of(scene, cancel);
    if (!drawn.content) {
      return given_up(make_error(ErrorKind::cancelled, "description cancelled"), workspace);
    }
    drawn.describe_us = std::max<std::int64_t>(microseconds(described_from, Clock::now()), 1);
  }
  if (!drawn.error && drawn.content && !drawn.content->detail) {
    const Clock::time_point compared_from = Clock::now();
    auto error = detail_error(prepared, dataset, pool, cancel, workspace);
    if (!error) return given_up(error.error(), workspace);
    drawn.content->detail = *error;
    if (*error) drawn.describe_us += microseconds(compared_from, Clock::now());
  }
  drawn.measure_us = microseconds(measured_from, Clock::now());
  return {};
}

Result<Frame> encode(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel) {
  const Clock::time_point start = Clock::now();
  Result<image::Bytes> bytes = bytes_of(workspace, pool, cancel);
  // The pixels are no longer needed: those of a JPEG, which only served to measure it, are freed,
  // others beyond retained_pixels.
  const bool jpeg = workspace.encoding.format == Format::jpeg;
  workspace.overlay.reset();
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

Result<Frame> produce(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                      const CancelToken& cancel, Workspace& workspace) {
  if (auto drawn = draw(prepared, dataset, pool, cancel, workspace); !drawn) return drawn.error();
  return encode(workspace, pool, cancel);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace) {
  const Clock::time_point start = Clock::now();
  const auto completed = complete(view, dataset, encoding.allow_reference);
  if (!completed) return completed.error();
  auto prepared = prepare(*completed, own_setting(*completed), dataset, encoding);
  if (!prepared) return prepared.error();
  prepared->prepare_us = microseconds(start, Clock::now());
  return produce(*prepared, dataset, pool, cancel, workspace);
}

Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel) {
  Workspace workspace;
  return produce(view, dataset, encoding, pool, cancel, workspace);
}

}  // namespace windsplat::frame
