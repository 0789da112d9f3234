#include "protocol/view/codec_trace.hpp"

#include "protocol/limits.hpp"

namespace windsplat::protocol {

TraceView read_trace(const Json& json, const std::string& pointer, Faults& faults) {
  TraceView trace;
  ObjectReader reader(json, pointer, faults);
  reader.integer("segments", trace.segments, {1, limits::segments_max});
  reader.number("stepError", trace.step_error, {limits::step_error_min, limits::step_error_max});
  reader.finish();
  return trace;
}

Json trace_to_json(const TraceView& trace) {
  return {{"segments", trace.segments}, {"stepError", canonical_number(trace.step_error)}};
}

}  // namespace windsplat::protocol
