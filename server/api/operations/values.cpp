// Values of the fields of a dataset.
#include "server/api/operations/operations.hpp"
#include "server/api/operations/parameters.hpp"

namespace windsplat::api::operations {
namespace {

constexpr std::string_view values_group = "Values";

Operation values_in_box() {
  return {
      .group = values_group,
      .query = {parameters::box, parameters::levels, parameters::stride, parameters::step,
                parameters::time, parameters::nearest, parameters::minus, parameters::minus_step},
      .problems = {404, 422, 507}};
}

}  // namespace

Operation probe_fields() {
  return {.id = "probeFields",
          .group = values_group,
          .summary = "The value of every field at the nearest sample",
          .description = "Of derived fields those in memory, and those in `fields`.",
          .query = {parameters::x, parameters::y, parameters::z, parameters::longitude,
                    parameters::latitude, parameters::level, parameters::height_field,
                    parameters::index, parameters::step, parameters::time, parameters::nearest,
                    parameters::fields, parameters::minus, parameters::minus_step},
          .answers = {json_answer("The sample and its values.", "probe")},
          .problems = {404, 422, 507}};
}

Operation count_values() {
  return {.id = "countValues",
          .group = values_group,
          .summary = "Histogram of a field",
          .query = {parameters::bins, parameters::range, parameters::clip, parameters::log,
                    parameters::step, parameters::time, parameters::nearest, parameters::minus,
                    parameters::minus_step},
          .answers = {json_answer("The counts.", "histogram")},
          .problems = {404, 422, 507}};
}

Operation read_series() {
  return {.id = "readSeries",
          .group = values_group,
          .summary = "A field at one position over all steps",
          .query = {parameters::x, parameters::y, parameters::z, parameters::longitude,
                    parameters::latitude, parameters::level, parameters::height_field,
                    parameters::index, parameters::minus, parameters::minus_step},
          .answers = {json_answer("One value a step.", "series")},
          .problems = {404, 413, 422, 507}};
}

Operation read_values() {
  Operation out = values_in_box();
  out.id = "readValues";
  out.summary = "Samples of a field in a box, as an array of float32";
  out.description =
      "NPY 1.0, dimensions component (of a vector), z, y, x, of which x is fastest; masked samples "
      "are NaN. Windsplat-Values describes the array as values.json does, without coordinates.";
  out.answers = {{200, "The array.", {}, {"application/x-npy"}, {"ETag", "Windsplat-Values"}},
                 not_modified()};
  return out;
}

Operation describe_values() {
  Operation out = values_in_box();
  out.id = "describeValues";
  out.summary = "Axes and coordinates of the samples of a field in a box";
  out.description = "No values are read.";
  out.answers = {json_answer("Dimensions and axes of the array.", "values"), not_modified()};
  return out;
}

Operation read_range() {
  return {
      .id = "readRange",
      .group = values_group,
      .summary = "Range of a field at a step, or at all steps",
      .query = {parameters::range_of, parameters::step, parameters::time, parameters::nearest,
                parameters::minus, parameters::minus_step},
      .answers = {json_answer("The range; of a step with the samples of its ends.", "fieldRange")},
      .problems = {404, 413, 422, 507}};
}

Operation read_range_in_view() {
  return {.id = "readRangeInView",
          .group = values_group,
          .summary = "Range of a field at the step and in the region of a view",
          .body = view_body("The view; its dataset is that of the path."),
          .answers = {json_answer("The range with the samples of its ends.", "fieldRange")},
          .problems = {404, 422, 507}};
}

}  // namespace windsplat::api::operations
