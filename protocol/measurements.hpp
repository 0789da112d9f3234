// What REST answers about values and about work that takes a while, as typed values. Mirrors
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

// Of a field at a step; of a vector its magnitude.
struct HistogramDescription {
  std::optional<Range> range;  // absent where there is no value to take it from
  std::vector<std::int64_t> counts;
  std::int64_t below = 0;
  std::int64_t above = 0;
  std::int64_t masked = 0;
  bool log = false;
  std::vector<double> edges;  // told of logarithmic bins; even ones follow from the range
};

// A sample of the grid.
struct PositionDescription {
  std::array<int, 3> index{};
  std::array<double, 3> coordinates{};
  std::array<std::string, 3> units;
};

// A field at a place; one number of a scalar, the components of a vector; none where masked.
using ProbedValue = std::optional<std::vector<double>>;

struct ProbedField {
  std::string name;
  bool is_vector = false;
  std::string units;
  std::vector<std::string> component_units;  // told where they differ
};

struct ProbeDescription {
  PositionDescription position;
  int step = 0;
  std::vector<ProbedField> fields;
  std::vector<ProbedValue> values;  // one a field
};

struct SeriesDescription {
  PositionDescription position;
  ProbedField field;
  std::vector<StepDescription> times;
  std::vector<ProbedValue> values;  // one a time
};

struct RangeDescription {
  std::optional<Range> range;  // absent where every sample is masked
  std::int64_t masked = 0;
  std::string range_of;  // "step" | "all"
};

// A view's truth, once it is drawn, and what the view's own picture errs against it.
struct ReferenceDescription {
  std::string id;
  std::string picture;  // where it is
  int width = 0;
  int height = 0;
  // Of linear premultiplied light; psnr in dB against a peak of 1, infinite when nothing differs.
  double rmse = 0;
  double max = 0;
  double psnr = 0;
  friend bool operator==(const ReferenceDescription&, const ReferenceDescription&) = default;
};

// Of kind dataset: its id.
using JobResult = std::variant<std::string, ReferenceDescription>;

// What a picture of a view is expected to take and to err at one of the settings that the server
// may choose. Names as in FrameInfo.
struct ForecastPoint {
  std::string method;
  std::optional<double> slab_thickness;  // grid cells along the line of sight; none without slabs
  int width = 0;                         // pixels, as it would be rendered
  int height = 0;
  int coarser = 0;       // how often an axis of the data is halved more than the picture asks for
  double ms = 0;         // of drawing
  bool timed = false;    // else nothing of the kind was timed, and `ms` tells proportions only
  double error = 0;      // linear RMSE, the expected one
  double error_low = 0;  // 90 of 100 pictures err between these two
  double error_high = 0;
  bool measured = false;  // from nearly the same view, else estimated
  bool pareto = false;    // no other point is as good in both
};
struct ForecastDescription {
  int width = 0;  // of the view, pixels
  int height = 0;
  std::vector<ForecastPoint> points;  // the fastest first
  std::optional<std::size_t> chosen;  // of `points`, where the view has a budget or an error
};

// Work that a client asked for and does not wait for.
struct JobDescription {
  std::string id;
  std::string kind;   // "dataset" | "reference"
  std::string state;  // "queued" | "running" | "done" | "failed" | "cancelled"
  double progress = 0;
  std::optional<double> eta_ms;
  std::optional<JobResult> result;
  std::optional<Problem> problem;
};

std::string encode_histogram(const HistogramDescription& histogram);
std::string encode_probe(const ProbeDescription& probe);
std::string encode_series(const SeriesDescription& series);
std::string encode_range(const RangeDescription& range);
std::string encode_forecast(const ForecastDescription& forecast);
std::string encode_job(const JobDescription& job);
std::string encode_jobs(const std::vector<JobDescription>& jobs);

// The body of POST /v1/datasets: its path. Errors as for every parser, see codec.hpp.
Result<std::string> parse_dataset_request(std::string_view json);

}  // namespace windsplat::protocol
