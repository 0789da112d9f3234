// One frame in four steps, which REST, the stream and the command line share: complete the view
// (scene/completed_view.hpp), prepare its scene, draw it, encode it.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "protocol/view.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/engine/render.hpp"
#include "server/image/encode.hpp"
#include "server/image/jpeg_encoder.hpp"
#include "server/image/ycc.hpp"
#include "server/quality/setting.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::frame {

enum class Format { jpeg, png, npy };

struct Encoding {
  Format format = Format::jpeg;
  int quality = 90;
  image::Subsampling subsampling = image::Subsampling::s444;
  bool allow_reference = false;  // see complete()
  // Whether the picture's error is measured by a second, finer run, and a JPEG's own.
  bool measure = false;
};

struct Frame {
  image::Bytes bytes;
  protocol::View view;  // what was drawn: completed, its image as large as the view asked
  int width = 0;        // as rendered
  int height = 0;
  double detail = 0;  // at the view's size (scene::detail_shown)
  engine::WorkReport work;
  std::int64_t render_us = 0;  // scene and engine, a JPEG's tone map in its tiles among it
  std::int64_t measure_us = 0;
  std::int64_t encode_us = 0;
  // Measured in linear light: of the picture against the truth of the view, and of its encoding.
  std::optional<double> error;
  std::optional<double> jpeg_error;
};

// Storage reused from frame to frame, and the frame between drawing and encoding. One frame at a
// time.
struct Workspace {
  engine::RenderSpace space;  // with the picture of every format but JPEG
  image::YccPicture planes;   // of a JPEG
  image::JpegEncoder jpeg;
  Frame drawn;  // has no bytes yet
  Encoding encoding;
  std::array<float, 3> background{};  // linear
};

// Upper bound of the memory for drawing and encoding a picture, beyond that for one of
// retained_pixels (base/trim_storage.hpp).
std::uint64_t bytes_beyond_kept(int width, int height, Format format);

// A view completed for its dataset; where memory does not suffice the error states what all fields
// of the view need. Errors: those of scene::complete(); invalid at /method/name for a reference
// that is not allowed: it takes seconds to minutes, so that only a command line that has the
// machine to itself allows it.
Result<scene::CompletedView> complete(const protocol::View& view, data::Dataset& dataset,
                                      bool allow_reference = false);

// The view as a setting draws it: its method and slabs, the size of the picture, the level of the
// data. Defaults stay those of the whole picture, so that every size frames the volume alike; radii
// follow the height that is drawn.
Result<scene::CompletedView> at_setting(const scene::CompletedView& completed,
                                        const quality::Setting& setting);

// A scene ready to be drawn: what it shows is loaded and stays resident while this lives.
struct Prepared {
  scene::CompletedView completed;  // at the setting
  protocol::ImageView asked;       // the size that the view asks for
  scene::Scene scene;
  quality::Setting setting;
  Encoding encoding;
  std::int64_t prepare_us = 0;  // of completing and preparing, counted in render_us
};
// Errors: those of the scene.
Result<Prepared> prepare(const scene::CompletedView& completed, const quality::Setting& setting,
                         data::Dataset& dataset, const Encoding& encoding);
// The setting that draws the view as it stands.
quality::Setting own_setting(const scene::CompletedView& completed);

// The report's fields and bytes are those of the volumes shown. `dataset` is read only to measure
// the error, and only as far as it is resident. Errors: those of the engine (out_of_memory,
// cancelled, ...).
Result<void> draw(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                  const CancelToken& cancel, Workspace& workspace);

// The bytes of what was drawn, once. Errors: too_large (for the format), cancelled.
Result<Frame> encode(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel = {});

// Draws and encodes.
Result<Frame> produce(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                      const CancelToken& cancel, Workspace& workspace);

// All four steps, at the view's own setting.
Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace);

// The same with a workspace of its own.
Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::frame
