// The report of a frame as a JSON tree.
#include <cmath>
#include <vector>

#include "protocol/codec_shapes.hpp"

namespace windsplat::protocol {

namespace {

// With the error that was asked for, and whether it is kept.
Json frame_error_json(const FrameInfo& info) {
  Json out{{"value", number_or_null(info.error_value)}, {"kind", info.error_kind}};
  if (info.error_asked && std::isfinite(info.error_value.value_or(NAN))) {
    out["asked"] = *info.error_asked;
    out["kept"] = *info.error_value <= *info.error_asked;
  }
  return out;
}

Json streamlets_json(const StreamletCounts& counts) {
  return {{"lines", counts.lines},
          {"segments", counts.segments},
          {"evaluations", counts.evaluations},
          {"ends",
           {{"length", counts.by_length},
            {"boundary", counts.by_boundary},
            {"mask", counts.by_mask},
            {"stagnation", counts.by_stagnation},
            {"steps", counts.by_steps}}}};
}

Json parts_json(const std::vector<PartReport>& rows) {
  Json out = Json::array();
  for (const PartReport& row : rows) {
    out.push_back(
        {{"part", row.part}, {"shown", row.shown}, {"count", row.count}, {"bytes", row.bytes}});
  }
  return out;
}

Json level_part_json(const LevelPart& part) {
  Json out{{"halvings", part.halvings}};
  if (part.box) {
    out["first"] = (*part.box)[0];
    out["count"] = (*part.box)[1];
  }
  if (part.boxes) out["boxes"] = {{"size", part.boxes->size}, {"count", part.boxes->count}};
  return out;
}

}  // namespace

Json frame_info_json(const FrameInfo& info) {
  Json out{{"method", info.method},
           {"compositing", info.compositing},
           {"stride", info.stride},
           {"slabThickness", number_or_null(info.slab_thickness)},
           {"width", info.width},
           {"height", info.height},
           {"error", frame_error_json(info)},
           {"jpegError", number_or_null(info.jpeg_error)},
           {"skippedChange",
            {{"value", number_or_null(info.skipped_change)}, {"kind", info.skipped_change_kind}}},
           {"work",
            {{"samples", info.samples},
             {"culled", info.culled},
             {"skippedVector", info.skipped_vector},
             {"skippedScalar", info.skipped_scalar},
             {"skippedBoth", info.skipped_both},
             {"occluded", info.occluded},
             {"pixelUpdates", info.pixel_updates},
             {"exponentials", info.exponentials},
             {"tiles", info.tiles},
             {"tilesStopped", info.tiles_stopped},
             {"skippedBound", number_or_null(info.skipped_bound)},
             {"stopBound", number_or_null(info.stop_bound)},
             {"fields", info.fields},
             {"bytes", info.bytes},
             {"variant", info.variant},
             {"parts", parts_json(info.parts)}}}};
  if (info.streamlets) out["work"]["streamlets"] = streamlets_json(*info.streamlets);
  if (info.detail) {
    out["detail"] = {{"wanted", level_part_json(info.detail->wanted)},
                     {"drawn", level_part_json(info.detail->drawn)}};
    if (info.detail->error) out["detail"]["error"] = *info.detail->error;
    if (const auto bytes = info.detail->missing_bytes; bytes > 0) {
      out["detail"]["missingBytes"] = bytes;
    }
  }
  if (!info.empty.empty()) out["empty"] = info.empty;
  return out;
}

}  // namespace windsplat::protocol
