// Frame + tables -> the errors of its report.
#include "server/tasks/error_report.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "server/frame/report/detail.hpp"

namespace windsplat::tasks {
namespace {

// From what the view shows, if that is known. It is never above the bound.
void estimate_skipped_change(const frame::Frame& drawn, const Observation& observed,
                             quality::Tables& tables, protocol::FrameInfo& info) {
  if (info.skipped_change) return;
  const auto content =
      drawn.content ? drawn.content : tables.content(observed.signature, observed.viewpoint);
  if (!content || !content->skipped_change) return;
  info.skipped_change = std::min(*content->skipped_change, drawn.work.skipped_bound);
  info.skipped_change_kind = "estimated";
}

// Of a picture from a coarser level than would suffice; empty: of any other, or not known.
std::optional<double> detail_error_of(const frame::Frame& drawn, const Observation& observed,
                                      quality::Tables& tables) {
  if (!frame::lacks_detail(drawn.data_drawn)) return std::nullopt;
  const bool own = drawn.content && drawn.content->detail;
  const auto known =
      own ? drawn.content->detail : tables.detail(observed.signature, observed.viewpoint);
  if (!known) return std::nullopt;
  return quality::error_at(*known, drawn.data_drawn->drawn.halvings);
}

// Of the method, the size of the picture and the detail that is not drawn; their errors are
// independent. Unknown if that of the detail is.
void estimate_error(const frame::Frame& drawn, const Observation& observed,
                    const quality::Setting& setting, quality::Tables& tables,
                    protocol::FrameInfo& info) {
  double error = tables.forecast(observed.signature, setting, observed.viewpoint).error;
  if (frame::lacks_detail(drawn.data_drawn)) {
    info.detail->error = detail_error_of(drawn, observed, tables);
    if (!info.detail->error) return;
    error = std::min(1.0, std::hypot(error, *info.detail->error));
  }
  info.error_value = error;
  info.error_kind = "estimated";
}

}  // namespace

Observation observed_in(const frame::Frame& drawn, const quality::Setting& setting) {
  protocol::View asked = drawn.view;
  if (asked.method.name == protocol::MethodName::slab) {
    asked.method.slab_thickness *= setting.thinner;
  }
  Observation observed{quality::signature_of(asked), quality::viewpoint_of(asked)};
  observed.viewpoint.detail = drawn.detail;
  observed.viewpoint.content = drawn.content;
  return observed;
}

void report_error(const frame::Frame& drawn, const Observation& observed,
                  const quality::Setting& setting, const frame::Encoding& encoding,
                  quality::Tables& tables, protocol::FrameInfo& info) {
  if (drawn.view.method.name == protocol::MethodName::reference) return;
  const auto index = quality::index_of(setting);
  estimate_skipped_change(drawn, observed, tables, info);
  info.error_asked = drawn.view.quality.max_error;
  // A smaller picture shows it less exactly.
  if (drawn.describe_us > 0 && drawn.width == drawn.view.image.width &&
      drawn.height == drawn.view.image.height) {
    tables.describe(observed.signature, observed.viewpoint);
  }
  if (drawn.error) {
    info.error_value = drawn.error;
    info.error_kind = "measured";
    if (index)
      tables.add(observed.signature, *index, observed.viewpoint, {drawn.error, std::nullopt});
  } else if (quality::neighbours_of(setting)) {
    estimate_error(drawn, observed, setting, tables, info);
  }
  if (encoding.format != frame::Format::jpeg) return;
  const bool full_chroma = encoding.subsampling == image::Subsampling::s444;
  if (drawn.jpeg_error) {
    tables.add_encoding(observed.signature, encoding.quality, observed.viewpoint,
                        *drawn.jpeg_error);
  }
  // The measured error does not include the loss from chroma subsampling.
  info.jpeg_error = drawn.jpeg_error && full_chroma
                        ? *drawn.jpeg_error
                        : tables.encoding_error(observed.signature, encoding.quality, full_chroma,
                                                observed.viewpoint);
}

}  // namespace windsplat::tasks
