// The messages of the stream and the documents of the HTTP API as typed values. Mirrors
// messages.schema.json.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/limits.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

inline constexpr const char* protocol_name = "windsplat.v1";  // the WebSocket subprotocol

// --- client to server -------------------------------------------------------------------------

struct OpenMessage {
  std::uint32_t id = 0;  // echoed by `opened` or `error`
  std::string dataset;
};
struct PatchMessage {
  std::uint32_t rev = 0;   // the client's view revision, echoed in frames
  double t = 0;            // the client's clock in ms, echoed in frames
  std::string patch_json;  // a merge patch of the view, not yet validated
};
struct StillMessage {
  std::uint32_t id = 0;
  std::optional<int> width;  // pixels; default: from the view
  std::optional<int> height;
  std::string format = "png";  // png | jpeg
  double scale = 1;            // 1..4
};
struct PlayMessage {
  int from = 0;  // greater than `to`: backward
  int to = 0;
  double fps = 10;
  bool loop = true;
  bool drop = true;  // skip steps to keep the rate
};
struct PauseMessage {};
struct AckMessage {
  std::uint32_t seq = 0;  // cumulative
  double decode_ms = 0;
};
struct VisibilityMessage {
  bool hidden = false;
};
// What the client can decode besides JPEG and PNG. Each announcement replaces the one before and
// starts a new video stream.
struct VideoMessage {
  std::vector<std::string> codecs;  // RFC 6381, for example avc1.640033; none: no video
};
using ClientMessage = std::variant<OpenMessage, PatchMessage, StillMessage, PlayMessage,
                                   PauseMessage, AckMessage, VisibilityMessage, VideoMessage>;

// --- shapes shared by REST, stream and command line --------------------------------------------

struct FieldDescription {
  std::string name;
  std::string kind;  // "scalar" | "vector"
  std::vector<std::string> components;
  std::string units;
  std::string standard_name;
  std::string long_name;
  std::optional<Range> range;  // absent until loaded; for vectors of the magnitude
  std::optional<std::int64_t> masked;
  std::string range_of;      // "step" | "all"; empty (null in JSON) while range is absent
  double storage_error = 0;  // largest packing error in units; 0: not packed
  std::string dtype;
};
struct AxisDescription {
  std::string name;
  std::string standard_name;
  std::string units;
  std::string kind;
  std::vector<double> coordinates;
  std::vector<double> world;  // position of each sample along its world axis
};
struct StepDescription {
  double value = 0;
  std::string text;
};
// A dimension besides space and time, of which one entry is shown.
struct ChoiceDescription {
  std::string name;
  std::uint64_t length = 0;
  std::vector<std::string> values;  // of the first entries
  std::string chosen;
};
// The variable of the file with the height of the ground or the sea floor of each column.
struct GroundDescription {
  std::string name;
  std::string kind;  // "land" | "seaFloor"
  Range range{};     // metres above sea level
};
// A level of the fields of a dataset; of the first one, full detail, the halvings are 0.
struct LevelDescription {
  std::array<int, 3> dims{};      // samples along x, y and z
  std::array<int, 3> halvings{};  // of these axes
  std::uint64_t bricks = 0;       // of each array at a step
  std::uint64_t bytes = 0;        // of the fields that have the level, at a step, in memory
  std::optional<std::uint64_t> stored_bytes;  // of its files, at all steps
  std::uint64_t resident_bytes = 0;           // in memory now, of all fields at all steps
};
struct DatasetDescription {
  std::string id;
  std::string title;
  std::string source;
  std::string format;
  std::string state;  // "ready" | "loading" | "failed"
  std::array<int, 3> dims{};
  std::array<AxisDescription, 3> axes;
  Vec3 world_min{};
  Vec3 world_max{};
  std::optional<double> vertical_exaggeration;  // of the default view
  std::optional<GroundDescription> ground;
  std::vector<std::string> mappings;  // values of /geometry/mapping that its grid supports
  std::vector<FieldDescription> fields;
  std::vector<std::pair<std::string, std::string>> left_out;  // variable, reason
  std::vector<std::string> notes;  // conversions of the data, problems found
  std::vector<ChoiceDescription> choices;
  std::vector<LevelDescription> levels;  // empty: no coarser levels are stored
  std::vector<StepDescription> steps;
  std::size_t step_count = 0;  // number of steps, even if `steps` is omitted
  std::string time_units;
  std::uint64_t resident_bytes = 0;
  std::uint64_t bytes_when_resident = 0;  // every field at every step
  View default_view;  // omitted while its dataset is empty, that is until data are loaded
  // The long form as JSON if encoded in advance; it is then sent instead, and steps and axes may be
  // omitted.
  std::shared_ptr<const std::string> encoded;
  std::string time_calendar;  // of CF, as in the file; empty: standard
};
// Streamlets of a view, traced once for all frames that show them.
struct StreamletCounts {
  std::int64_t lines = 0, segments = 0;
  std::int64_t evaluations = 0;  // of the field
  // Ends of lines, two each, by what ended them.
  std::int64_t by_length = 0, by_boundary = 0, by_mask = 0, by_stagnation = 0, by_steps = 0;
};
// What was computed and is held for a part that a view may add; zeros of an absent one.
struct PartReport {
  std::string part;
  bool shown = false;
  std::int64_t count = 0;
  std::int64_t bytes = 0;
};
// Boxes of equal size.
struct LevelBoxes {
  std::array<int, 3> size{1, 1, 1};  // samples along each axis
  int count = 0;
};
// Samples of a level of a dataset with stored levels.
struct LevelPart {
  std::array<int, 3> halvings{0, 0, 0};  // of the axes of the data
  // Indices of the level's first sample and numbers of samples; absent in JSON: all of them.
  std::optional<std::array<std::array<int, 3>, 2>> box;
  // Of the box these alone; absent in JSON: the whole box.
  std::optional<LevelBoxes> boxes;
};
struct DetailReport {
  LevelPart wanted, drawn;
  // Part of the picture's error that a coarser level than wanted is the cause of; absent in JSON:
  // it is not coarser, or the error is not known.
  std::optional<double> error;
  // Of what is wanted and was not in memory, so that coarser data stand in; absent in JSON: 0.
  std::uint64_t missing_bytes = 0;
};
struct FrameInfo {
  std::string method = "kernel";
  std::string compositing = "analytic";
  int stride = 1;
  std::optional<double> slab_thickness;
  int width = 0;
  int height = 0;
  std::optional<double> error_value;
  std::string error_kind = "none";    // measured | estimated | none
  std::optional<double> error_asked;  // the view's maxError; empty: none
  std::optional<double> jpeg_error;
  std::optional<double> skipped_change;      // mean change by what tolerances leave out; linear
  std::string skipped_change_kind = "none";  // measured | estimated | none
  std::int64_t samples = 0, culled = 0, skipped_vector = 0, skipped_scalar = 0, skipped_both = 0;
  std::int64_t occluded = 0, pixel_updates = 0, exponentials = 0;
  std::int64_t tiles = 0, tiles_stopped = 0;
  double skipped_bound = 0, stop_bound = 0;  // linear; null in JSON unless finite
  std::vector<std::string> fields;
  std::int64_t bytes = 0;
  std::string variant;
  std::optional<StreamletCounts> streamlets;  // absent in JSON without streamlets
  std::optional<DetailReport> detail;         // absent in JSON without stored levels
  std::vector<PartReport> parts;
  std::string empty;  // why the picture shows nothing of the data; absent in JSON if empty
};
// RFC 9457.
struct Problem {
  std::string type = "about:blank";
  std::string title;
  int status = 500;
  std::string detail;
  std::vector<FieldError> errors;
};
Problem problem_from(const Error& error);

struct ColorMapDescription {
  std::string name;
  std::string kind;
  std::vector<std::array<unsigned char, 3>> colors;  // sRGB, evenly spaced
};
// Limits that differ between servers.
struct ServerLimits {
  std::int64_t image_pixels_max = limits::image_pixels_max;
  std::uint64_t upload_bytes_max = 0;   // of an upload and of all of an address; 0: no uploads
  std::uint64_t uploads_bytes_max = 0;  // of all uploads together
};

struct ServiceDescription {
  std::string name = "windsplat";
  std::string version;
  std::vector<std::pair<std::string, std::string>> links;
  ServerLimits limits;
};

// --- server to client -------------------------------------------------------------------------

struct HelloMessage {
  std::string version;
  std::string session;
  std::vector<DatasetDescription> datasets;  // short forms
  ServerLimits limits;
};
struct OpenedMessage {
  std::uint32_t id = 0;
  DatasetDescription dataset;
};
struct ProgressMessage {
  std::optional<std::uint32_t> id;
  std::string phase;
  double done = 0;  // 0..1
  std::optional<double> eta_ms;
};
struct ChosenMessage {
  std::uint32_t seq = 0;  // number of the frame
  FrameInfo info;
  std::string view_json;  // the completed view, canonical
};
// The patch was applied and causes no new frame.
struct UnchangedMessage {
  std::uint32_t rev = 0;  // revision of the patch; includes all earlier ones
  std::uint32_t seq = 0;  // the frame that already shows the view
};
struct StatsMessage {
  std::uint64_t frames = 0;
  std::uint64_t dropped = 0;
  std::uint64_t cancelled = 0;
  std::uint64_t bytes = 0;
  std::optional<double> play_fps;  // rate of displayed steps
  std::uint64_t steps_dropped = 0;
  std::uint64_t steps_not_ready = 0;
};
struct ErrorMessage {
  std::optional<std::uint32_t> id;   // id of the invalid message, if it had one
  std::optional<std::uint32_t> rev;  // rev of the invalid patch
  Problem problem;
};
using ServerMessage = std::variant<HelloMessage, OpenedMessage, ProgressMessage, ChosenMessage,
                                   UnchangedMessage, StatsMessage, ErrorMessage>;

}  // namespace windsplat::protocol
