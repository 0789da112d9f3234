// One frame from a view to encoded bytes with its times and report: what REST, the stream and the
// command line share.
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

namespace windsplat::frame {

enum class Format { jpeg, png, npy };

struct Encoding {
  Format format = Format::jpeg;
  int quality = 90;
  image::Subsampling subsampling = image::Subsampling::s444;
  // Whether the reference may be drawn, which takes seconds to minutes: by a command line that has
  // the machine to itself, not where others wait for the renderer.
  bool allow_reference = false;
  // Rendered at the view's width and height times 2^(-half_level / 2), at least one pixel.
  int half_level = 0;
  int coarser = 0;  // of the data (scene::Completed)
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
  // Measured, of linear light: of the picture against the view's own truth, of its encoding.
  std::optional<double> error;
  std::optional<double> jpeg_error;
};

// What a loop of frames keeps from one to the next, and the frame between its two steps. One frame
// at a time.
struct Workspace {
  engine::RenderSpace space;  // with the picture of every format but JPEG
  image::YccPicture planes;   // of a JPEG
  image::JpegEncoder jpeg;
  Frame drawn;  // has no bytes yet
  Encoding encoding;
  std::array<float, 3> background{};  // linear
};

// What drawing and encoding a picture take beyond one of retained_pixels (base/trim_storage.hpp),
// at most.
std::uint64_t bytes_beyond_kept(int width, int height, Format format);

// What draw() will need of the dataset, loaded; it stays resident as long as the answer is held.
// Errors: those of the scene.
Result<std::shared_ptr<const void>> load(const protocol::View& view, data::Dataset& dataset,
                                         const Encoding& encoding);

// `view` need not be completed. The report's fields and bytes are those of the volumes shown.
// Errors: those of the scene and the engine (invalid, out_of_memory, cancelled, ...); invalid for a
// half level outside 0..31, and at /method/name for a reference that is not allowed.
Result<void> draw(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                  ThreadPool& pool, const CancelToken& cancel, Workspace& workspace);

// The bytes of what was drawn, once. Errors: too_large (for the format), cancelled.
Result<Frame> encode(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel = {});

// Both, one after the other.
Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace);

// One frame by itself.
Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::frame
