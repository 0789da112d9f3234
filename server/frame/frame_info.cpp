// Converts the report of a frame to the terms of the protocol.
#include "server/frame/frame_info.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace windsplat::frame {
namespace {

const char* method_text(protocol::MethodName name) {
  switch (name) {
    case protocol::MethodName::kernel:
      return "kernel";
    case protocol::MethodName::slab:
      return "slab";
    case protocol::MethodName::reference:
      return "reference";
  }
  return "";
}

const char* compositing_text(protocol::Compositing compositing) {
  switch (compositing) {
    case protocol::Compositing::simple:
      return "simple";
    case protocol::Compositing::cd_naive:
      return "cd-naive";
    case protocol::Compositing::cd:
      return "cd";
    case protocol::Compositing::analytic:
      return "analytic";
    case protocol::Compositing::cd_euler:
      return "cd-euler";
  }
  return "";
}

// The stride of the lines, or of the medium if no lines are drawn.
int stride_of(const protocol::View& view) {
  const bool lines = view.vector.field.kind != protocol::FieldChoice::Kind::none;
  const bool medium = view.scalars && !view.scalars->empty();
  return !lines && medium ? view.scalars->front().stride : view.vector.stride.value_or(1);
}

protocol::StreamletCounts counts_of(const trace::Tally& tally) {
  using trace::End;
  const auto ended = [&](End by) { return tally.ends.at(static_cast<std::size_t>(by)); };
  return {tally.lines,          tally.segments,     tally.evaluations,      ended(End::length),
          ended(End::boundary), ended(End::masked), ended(End::stagnation), ended(End::steps)};
}

constexpr std::array<const char*, parts_count> part_names{
    "ground", "surfaces", "streamlets", "seeds", "light", "region", "difference", "annotations"};

std::vector<protocol::PartReport> reports_of(const PartCounts& parts) {
  std::vector<protocol::PartReport> out;
  for (std::size_t n = 0; n < parts_count; ++n) {
    out.push_back({part_names.at(n), parts.at(n).shown, parts.at(n).count, parts.at(n).bytes});
  }
  return out;
}

}  // namespace

protocol::FrameInfo frame_info(const Frame& frame, const protocol::View& view) {
  protocol::FrameInfo info;
  info.method = method_text(view.method.name);
  info.compositing = compositing_text(view.method.compositing);
  info.stride = stride_of(view);
  if (view.method.name == protocol::MethodName::slab) {
    info.slab_thickness = view.method.slab_thickness;
  }
  info.width = frame.width;
  info.height = frame.height;
  if (frame.skipped_change) {
    info.skipped_change = frame.skipped_change;
    info.skipped_change_kind = "measured";
  }
  const engine::WorkReport& work = frame.work;
  info.samples = work.samples;
  info.culled = work.culled;
  info.skipped_vector = work.skipped_vector;
  info.skipped_scalar = work.skipped_scalar;
  info.skipped_both = work.skipped_both;
  info.occluded = work.occluded;
  info.pixel_updates = work.pixel_updates;
  info.exponentials = work.exponentials;
  info.tiles = work.tiles;
  info.tiles_stopped = work.tiles_stopped;
  info.skipped_bound = work.skipped_bound;
  info.stop_bound = work.stop_bound;
  info.fields = work.fields;
  info.bytes = work.bytes;
  info.variant = engine::text_of(work.variant);
  info.detail = frame.data_drawn;
  if (work.streamlets) info.streamlets = counts_of(*work.streamlets);
  info.parts = reports_of(frame.parts);
  info.empty = frame.empty;
  return info;
}

}  // namespace windsplat::frame
