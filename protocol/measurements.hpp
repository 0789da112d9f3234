// Responses of the HTTP API about values, forecasts and jobs, as typed values. Mirrors
// messages.schema.json.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

// Histogram of a field at a step; for vectors, of their magnitudes.
struct HistogramDescription {
  std::optional<Range> range;  // absent if there are no values
  std::vector<std::int64_t> counts;
  std::int64_t below = 0;
  std::int64_t above = 0;
  std::int64_t masked = 0;
  bool log = false;
  std::vector<double> edges;  // logarithmic bins only
};

// A sample of the grid.
struct PositionDescription {
  std::array<int, 3> index{};
  std::array<double, 3> coordinates{};
  std::array<std::string, 3> units;
};

// A field at one position: one number of a scalar, the components of a vector; empty if masked.
using ProbedValue = std::optional<std::vector<double>>;

struct ProbedField {
  std::string name;
  bool is_vector = false;
  std::string units;
  std::vector<std::string> component_units;  // only if they differ
};

struct ProbeDescription {
  PositionDescription position;
  int step = 0;
  std::vector<ProbedField> fields;
  std::vector<ProbedValue> values;  // one per field
};

struct SeriesDescription {
  PositionDescription position;
  ProbedField field;
  std::vector<StepDescription> times;
  std::vector<ProbedValue> values;  // one per time
};

// The samples along an axis that an array of values has.
struct ValuesAxis {
  std::string name;  // as in the file
  std::string units;
  int index = 0;   // of the first one in the axis
  int stride = 1;  // samples from one to the next
  std::vector<double> coordinates;
};

// An array of values of a field, last dimension fastest.
struct ValuesDescription {
  ProbedField field;
  int step = 0;
  StepDescription time;
  std::vector<std::string> dims;  // "component", "z", "y", "x"
  std::vector<std::size_t> shape;
  std::array<ValuesAxis, 3> axes;  // x, y, z
  int turn = 0;                    // samples along x around the globe, if the array passes the seam
  // Degrees of every column, y and x; empty: the axes determine them.
  std::vector<double> longitudes;
  std::vector<double> latitudes;
};

struct UploadDescription {
  std::string id;
  std::uint64_t bytes = 0;
  std::string digest;   // as in Content-Digest
  std::string expires;  // UTC
};

struct RangeDescription {
  std::optional<Range> range;  // absent if all samples are masked
  std::int64_t masked = 0;
  std::string range_of;  // "step" | "all"
  // Samples with the least and the greatest value, of a step only; absent if all are masked.
  std::optional<std::array<PositionDescription, 2>> places;
};

// A line, a part of a medium or a surface.
enum class PickedLayer { lines, medium, surface };

// What contributes most to a pixel.
struct PickedFeature {
  PickedLayer layer = PickedLayer::lines;
  std::optional<int> surface;  // its number in /surfaces of the view
  std::string field;
  std::optional<double> value;  // of a vector the magnitude; empty: masked there
  std::string units;
  PositionDescription position;
  double share = 0;            // of the pixel's opacity
  double depth = 0;            // view depth, world units
  std::array<double, 2> at{};  // in the picture, pixels
};

// The finished reference picture of a view, and the error of the rendered view.
struct ReferenceDescription {
  std::string id;
  std::string picture;  // path
  int width = 0;
  int height = 0;
  // Errors are in linear premultiplied RGBA; psnr is in dB for a peak of 1, infinite for identical
  // pictures.
  double rmse = 0;
  double max = 0;
  double psnr = 0;
  friend bool operator==(const ReferenceDescription&, const ReferenceDescription&) = default;
};

// A finished animation.
struct AnimationDescription {
  std::string id;
  std::string movie;   // path
  std::string format;  // "mp4" | "webm" | "zip"
  int width = 0;
  int height = 0;
  int frames = 0;
  double fps = 0;
  std::int64_t bytes = 0;
  std::string expires;  // UTC
  friend bool operator==(const AnimationDescription&, const AnimationDescription&) = default;
};

// A string is the id of an opened dataset.
using JobResult = std::variant<std::string, ReferenceDescription, AnimationDescription>;

// Expected time and error of a picture at one of the settings that the server may choose. Names as
// in FrameInfo.
struct ForecastPoint {
  std::string method;
  std::optional<double> slab_thickness;  // grid cells along the view direction; method slab only
  int width = 0;                         // pixels, as it would be rendered
  int height = 0;
  int coarser = 0;       // additional halvings of the axes of the data
  double ms = 0;         // rendering time
  bool timed = false;    // false: `ms` is only relative to other settings
  double error = 0;      // expected linear RMSE
  double error_low = 0;  // 5 % and 95 % quantiles
  double error_high = 0;
  bool measured = false;  // at nearly the same view; otherwise estimated
  bool pareto = false;    // on the Pareto front of time and error
};
struct ForecastDescription {
  int width = 0;  // size of the view, pixels
  int height = 0;
  std::vector<ForecastPoint> points;  // fastest first
  std::optional<std::size_t> chosen;  // index of `points`, if the view has a budget or error limit
};

// Asynchronous work requested by a client.
struct JobDescription {
  std::string id;
  std::string kind;   // "dataset" | "reference" | "animation"
  std::string state;  // "queued" | "running" | "done" | "failed" | "cancelled"
  double progress = 0;
  std::optional<double> eta_ms;
  std::optional<JobResult> result;
  std::optional<Problem> problem;
};

std::string encode_histogram(const HistogramDescription& histogram);
std::string encode_probe(const ProbeDescription& probe);
enum class ValuesDetail { ends, all };  // coordinates: of the first and last sample, of all
std::string encode_values(const ValuesDescription& values, ValuesDetail detail);
std::string encode_upload(const UploadDescription& upload);
std::string encode_series(const SeriesDescription& series);
std::string encode_range(const RangeDescription& range);
std::string encode_pick(const std::optional<PickedFeature>& feature);
std::string encode_forecast(const ForecastDescription& forecast);
std::string encode_job(const JobDescription& job);
std::string encode_jobs(const std::vector<JobDescription>& jobs);

// The body of POST /v1/datasets: a path below the data root, a listed dataset and other entries of
// its choices, or a list of files below the data root.
struct DatasetRequest {
  std::string path;
  std::string upload;
  std::string list;   // the text of the list, whose content is checked when it is opened
  std::string first;  // its first name or pattern
  std::string from;
  std::vector<std::pair<std::string, std::string>> selection;  // dimension, entry
};
// Errors of parsers: see codec.hpp.
Result<DatasetRequest> parse_dataset_request(std::string_view json);

}  // namespace windsplat::protocol
