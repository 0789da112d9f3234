#include "protocol/view/codec_trace.hpp"

#include "protocol/limits.hpp"
#include "protocol/view/codec_seeds.hpp"

namespace windsplat::protocol {

TraceView read_trace(const Json& json, const std::string& pointer, Faults& faults) {
  TraceView trace;
  ObjectReader reader(json, pointer, faults);
  reader.integer("segments", trace.segments, {1, limits::segments_max});
  reader.number("stepError", trace.step_error, {limits::step_error_min, limits::step_error_max});
  if (const Json* seeds = reader.child("seeds", Presence::optional, Null::is_default)) {
    trace.seeds = read_seeds(*seeds, reader.at("seeds"), faults);
  }
  reader.finish();
  return trace;
}

Json trace_to_json(const TraceView& trace) {
  return {{"segments", trace.segments},
          {"stepError", canonical_number(trace.step_error)},
          {"seeds", trace.seeds ? seeds_to_json(*trace.seeds) : Json(nullptr)}};
}

}  // namespace windsplat::protocol
