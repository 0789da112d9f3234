// A frame in four steps, common to REST, stream and command line: complete the view
// (scene/completed_view.hpp), prepare its scene, draw it, encode it.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/annotate/figure.hpp"
#include "server/annotate/paint/overlay.hpp"
#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/base/thread_pool.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/engine/render.hpp"
#include "server/frame/report/parts.hpp"
#include "server/image/encode.hpp"
#include "server/image/jpeg_encoder.hpp"
#include "server/image/ycc.hpp"
#include "server/quality/content.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/sizes.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/level/stand_in.hpp"
#include "server/scene/scene.hpp"

namespace windsplat::image {
class VideoEncoder;
}

namespace windsplat::frame {

// pdf, svg: the picture with its annotations as texts and lines.
enum class Format { jpeg, png, npy, pdf, svg };

inline constexpr double document_dots_per_inch = 300;  // of pdf and svg without a value
inline constexpr double dots_per_inch_min = 10;
inline constexpr double dots_per_inch_max = 2400;

struct Encoding {
  Format format = Format::jpeg;
  int quality = 90;
  image::Subsampling subsampling = image::Subsampling::s444;
  bool allow_reference = false;  // see complete()
  // Whether the error of the picture is measured by a second, finer rendering, that of a JPEG by
  // decoding it.
  bool measure = false;
  // Whether the change by what tolerances leave out is measured by drawing that too, if that takes
  // no longer than is_change_measured() allows, and the error is within the view's maxError: other
  // pictures are drawn again. Where it is not measured the view is described.
  bool measure_change = false;
  // Whether what the view shows is described, which its estimated errors follow from. It takes some
  // 50 ms, so pictures with a measured error, which do not need it, are described only if this is
  // set. One of which the error should be measured and cannot be is described in any case.
  bool describe = false;
  // Whether the error of a coarser level than would suffice is found (report/detail.hpp), as for
  // pictures that are measured or described, of a view that was described before it is drawn.
  bool compare_levels = false;
  // Encodes a JPEG of 4:2:0 that is not measured as the next picture of this stream instead, a key
  // one if `key` is set; if that fails, as JPEG.
  image::VideoEncoder* video = nullptr;
  bool key = false;
  std::optional<double> dots_per_inch =
      std::nullopt;  // of pdf and svg (300 without it) and png (none without it)
  // Whether the bytes of a png, pdf or svg are its pixels, for encode_pair() (pair/pair.hpp): 8-bit
  // sRGB, and of pdf and svg what lies over them in Frame::figure.
  bool raw = false;
};

// How a picture was encoded.
enum class Coded { as_asked, video, video_key, video_failed };

struct Frame {
  image::Bytes bytes;
  protocol::View view;  // the completed view that was drawn, with the requested size of the picture
  int width = 0;        // rendered width
  int height = 0;
  double detail = 0;                        // at the size of the view (scene::detail_shown)
  std::optional<quality::Content> content;  // if it was described
  quality::Halvings halvings{};             // of the data, by the size of the picture
  engine::WorkReport work;
  PartCounts parts{};
  std::optional<protocol::DetailReport> data_drawn;  // of data with stored levels
  std::string empty;           // why the picture shows nothing of the data; empty if it shows some
  std::int64_t render_us = 0;  // time of scene and engine, including the tone mapping of JPEG tiles
  std::int64_t measure_us = 0;
  std::int64_t describe_us = 0;  // of measure_us; 0: its content was known, or not needed
  std::int64_t encode_us = 0;
  // Measured in linear light: the error of the picture relative to the reference of the view, and
  // that of its encoding.
  std::optional<double> error;
  std::optional<double> jpeg_error;
  // measured_skipped_change, or 0 if it is certain that nothing is left out; empty: not measured.
  std::optional<double> skipped_change;
  std::optional<annotate::Figure> figure;  // only if raw
  Coded coded = Coded::as_asked;
  std::string video_fault;  // if video failed
};

// Storage reused between frames, which also holds the frame between drawing and encoding. Used for
// one frame at a time.
struct Workspace {
  engine::RenderSpace space;  // contains the picture of every format except JPEG
  image::YccPicture planes;   // contains the picture of a JPEG
  image::JpegEncoder jpeg;
  Frame drawn;  // the frame, without bytes until it is encoded
  Encoding encoding;
  std::array<float, 3> background{};  // linear
  // Called with the number of finished rows of method reference, from any thread; may be empty.
  std::function<void(int)> rows_done;
  std::optional<annotate::Figure> figure;    // of the frame; empty: no annotations
  std::optional<annotate::Overlay> overlay;  // its pixels; of pdf and svg those below the data
};

// Upper bound on the memory for drawing and encoding a picture, beyond that for one of
// retained_pixels (base/trim_storage.hpp) without annotations.
std::uint64_t bytes_beyond_kept(int width, int height, Format format, bool annotated = false);

// Memory for the lists of the triangles of a scene while it is drawn.
std::uint64_t surface_bytes(const scene::Scene& scene);

// Whether the font can write the title of one's own. Errors: invalid at /annotations/titleText.
Result<void> check_title(const protocol::View& view);

// Completes a view for its dataset; if memory does not suffice, the error states what all fields of
// the view need. Errors: those of scene::complete(); invalid at /method/name for a reference that
// is not allowed: it takes seconds to minutes, so only a command line that does not share the
// machine allows it; those of check_title().
Result<scene::CompletedView> complete(const protocol::View& view, data::Dataset& dataset,
                                      bool allow_reference = false);

// The view as drawn at a setting: its method and slabs, the size of the picture, the level of the
// data. Defaults remain those of the full size, so that the volume is framed equally at every size;
// radii follow the height that is drawn.
Result<scene::CompletedView> at_setting(const scene::CompletedView& completed,
                                        const quality::Setting& setting);

// A scene ready to be drawn: its data are loaded and stay resident during its lifetime.
struct Prepared {
  scene::CompletedView completed;  // at the size of the setting
  protocol::ImageView asked;       // at the size of the view
  scene::Scene scene;
  quality::Setting setting;
  Encoding encoding;
  std::optional<annotate::Figure> figure;  // empty: the picture shows no annotations
  std::int64_t prepare_us = 0;             // time of completing and preparing, counted in render_us
  std::optional<quality::Content> content;  // of the view, if it is known already
  std::vector<scene::Scene> compared;       // for detail_error() (report/detail.hpp)
};
// The search for places of numbers on contours ends with dataset.cancellation(). Errors: those of
// the scene; out_of_memory, cancelled.
Result<Prepared> prepare(const scene::CompletedView& completed, const quality::Setting& setting,
                         data::Dataset& dataset, const Encoding& encoding,
                         scene::StandIn stand_in = scene::StandIn::none);
// The setting at which the view is drawn unchanged.
quality::Setting own_setting(const scene::CompletedView& completed);

// The fields and bytes of the report are those of the volumes shown. `dataset` is read only to
// measure the error, and only its resident data. Errors: those of the engine (out_of_memory,
// cancelled, ...).
Result<void> draw(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                  const CancelToken& cancel, Workspace& workspace);

// Encodes what was drawn; call it once. Errors: too_large (for the format), cancelled.
Result<Frame> encode(Workspace& workspace, ThreadPool& pool, const CancelToken& cancel = {});

// Draws and encodes.
Result<Frame> produce(const Prepared& prepared, data::Dataset& dataset, ThreadPool& pool,
                      const CancelToken& cancel, Workspace& workspace);

// All four steps, at the setting of the view itself.
Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel, Workspace& workspace);

// The same with a temporary workspace.
Result<Frame> produce(const protocol::View& view, data::Dataset& dataset, const Encoding& encoding,
                      ThreadPool& pool, const CancelToken& cancel);

}  // namespace windsplat::frame
