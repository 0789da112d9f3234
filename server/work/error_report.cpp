// Frame + tables -> the errors of its report.
#include "server/work/error_report.hpp"

namespace windsplat::net {

Seen seen_in(const frame::Frame& drawn, const quality::Setting& setting) {
  protocol::View asked = drawn.view;
  if (asked.method.name == protocol::MethodName::slab) {
    asked.method.slab_thickness *= setting.thinner;
  }
  Seen seen{quality::style_of(asked), quality::sight_of(asked)};
  seen.sight.detail = drawn.detail;
  return seen;
}

void tell_error(const frame::Frame& drawn, const Seen& seen, const quality::Setting& setting,
                const frame::Encoding& encoding, quality::Tables& tables,
                protocol::FrameInfo& info) {
  if (drawn.view.method.name == protocol::MethodName::reference) return;
  const auto index = quality::index_of(setting);
  if (drawn.error) {
    info.error_value = drawn.error;
    info.error_kind = "measured";
    if (index) tables.add(seen.style, *index, seen.sight, {drawn.error, std::nullopt});
  } else if (index) {
    info.error_value = tables.forecast(seen.style, *index, seen.sight).error;
    info.error_kind = "estimated";
  }
  if (encoding.format != frame::Format::jpeg) return;
  const bool full_chroma = encoding.subsampling == image::Subsampling::s444;
  if (drawn.jpeg_error) {
    tables.add_encoding(seen.style, encoding.quality, seen.sight, *drawn.jpeg_error);
  }
  // What was measured leaves out what half the chroma lost.
  info.jpeg_error =
      drawn.jpeg_error && full_chroma
          ? *drawn.jpeg_error
          : tables.encoding_error(seen.style, encoding.quality, full_chroma, seen.sight);
}

}  // namespace windsplat::net
