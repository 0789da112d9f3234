// Completes the view, measures its settings if it has limits, chooses one and draws.
#include "server/cli/limited_picture.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "server/frame/content.hpp"
#include "server/frame/frame_info.hpp"
#include "server/frame/measure.hpp"
#include "server/frame/report/detail.hpp"
#include "server/quality/pick.hpp"
#include "server/quality/setting.hpp"
#include "server/scene/surfaces/make_surfaces.hpp"
#include "server/tasks/error_report.hpp"

namespace windsplat::cli {
namespace {

bool is_reference(const protocol::View& view) {
  return view.method.name == protocol::MethodName::reference;
}

// A reference has no error to limit.
bool is_limited(const protocol::View& view) {
  return (view.quality.budget_ms || view.quality.max_error) && !is_reference(view);
}

double milliseconds(std::int64_t us) { return 1e-3 * static_cast<double>(us); }

double drawing_ms(const Picture& picture) {
  return milliseconds(picture.frame.render_us + picture.frame.encode_us);
}

// The largest ratio of a picture's time and error to their limits.
double excess(const Picture& picture) {
  const protocol::QualityView& limits = picture.frame.view.quality;
  double most = 0;
  if (limits.budget_ms) most = drawing_ms(picture) / *limits.budget_ms;
  const auto& error = picture.info.error_value;
  if (limits.max_error && error) most = std::max(most, *error / *limits.max_error);
  return most;
}

std::string short_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

Result<void> LimitedPictures::calibrate(const scene::CompletedView& completed,
                                        const CancelToken& cancel, const ShowDone& show) {
  const quality::SceneSignature signature = quality::signature_of(completed.view());
  if (!tables_.begin_study(signature, frame::viewpoint_of(completed, nullptr))) return {};
  if (auto loaded = frame::load_for_calibration(completed, dataset_, cancel); !loaded) {
    return loaded.error();
  }
  data::Dataset resident = dataset_.resident_only();
  const auto allowed = std::count_if(
      quality::settings.begin(), quality::settings.end(),
      [&](const quality::Setting& one) { return quality::is_allowed(one, completed.view()); });
  int known = 0;
  const auto keep = [&](const frame::CalibrationSample& found) {
    // Then the picture is drawn.
    if (show) show(++known / (static_cast<double>(allowed) + 1), "measuring settings");
    tables_.add(signature, found.setting, found.viewpoint, found.measured);
  };
  const auto content = frame::described(completed, resident, tables_, cancel).viewpoint.content;
  const auto done = frame::calibrate(completed, resident, pool_, cancel, workspace_, keep, content);
  tables_.end_study(signature, static_cast<bool>(done));
  // Without memory for these pictures, the setting follows from the measurements made so far and
  // from forecasts.
  const bool short_of_memory = !done && (done.error().kind == ErrorKind::not_resident ||
                                         done.error().kind == ErrorKind::out_of_memory);
  return short_of_memory ? Result<void>() : done;
}

quality::Setting LimitedPictures::setting_of(const scene::CompletedView& completed,
                                             const CancelToken& cancel) {
  const protocol::View& view = completed.view();
  if (!is_limited(view)) return frame::own_setting(completed);
  const auto viewpoint = frame::described(completed, dataset_, tables_, cancel).viewpoint;
  const auto known = quality::with_encoding(
      view, tables_.forecasts(quality::signature_of(view), viewpoint), encode_ms_a_pixel_);
  const quality::Aim aim{view.quality.budget_ms, view.quality.max_error};
  return quality::settings[quality::pick(view, known, aim).setting];
}

Result<Picture> LimitedPictures::draw_at(const scene::CompletedView& completed,
                                         const quality::Setting& setting,
                                         const CancelToken& cancel) {
  frame::Encoding encoding = encoding_;
  encoding.measure = encoding.measure || completed.view().quality.max_error.has_value();
  data::Dataset dataset = dataset_.cancelled_by(cancel);
  auto prepared = frame::prepare(completed, setting, dataset, encoding);
  if (!prepared) return prepared.error();
  // Prepared again from resident data, since a limit on the time does not include reading files.
  if (is_limited(completed.view())) {
    prepared = frame::prepare(completed, setting, dataset, encoding);
    if (!prepared) return prepared.error();
  }
  prepared->content = frame::known_viewpoint_of(completed, tables_).content;
  auto drawn = frame::produce(*prepared, dataset_, pool_, cancel, workspace_);
  if (!drawn) return drawn.error();
  encode_ms_a_pixel_ =
      milliseconds(drawn->encode_us) / (static_cast<double>(drawn->width) * drawn->height);
  Picture picture{std::move(*drawn), {}, {}};
  picture.info = frame::frame_info(picture.frame, picture.frame.view);
  tasks::report_error(picture.frame, tasks::observed_in(picture.frame, setting), setting, encoding,
                      tables_, picture.info);
  const auto& surfaces = prepared->scene.surfaces;
  const bool lacks_one =
      std::any_of(surfaces.begin(), surfaces.end(),
                  [](const surface::Shown& shown) { return shown.mesh->triangles.empty(); });
  if (lacks_one && picture.frame.empty.empty()) {
    auto reasons = scene::why_no_surfaces(prepared->completed, dataset);
    if (!reasons) return reasons.error();
    picture.empty_surfaces = std::move(*reasons);
  }
  return picture;
}

Result<Picture> LimitedPictures::draw(const protocol::View& view, const CancelToken& cancel,
                                      const ShowDone& show) {
  const auto completed = frame::complete(view, dataset_, encoding_.allow_reference);
  if (!completed) return completed.error();
  if (is_reference(view) && view.quality.budget_ms) {
    return make_error_at(ErrorKind::invalid, "/quality/budgetMs",
                         "cannot limit the time of method reference");
  }
  if (is_limited(completed->view())) {
    if (auto done = calibrate(*completed, cancel, show); !done) return done.error();
  }
  workspace_.rows_done = nullptr;
  if (show) {
    workspace_.rows_done = [&show, rows = view.image.height](int done) {
      show(static_cast<double>(done) / rows, "drawing");
    };
  }
  quality::Setting setting = setting_of(*completed, cancel);
  auto best = draw_at(*completed, setting, cancel);
  // The time of encoding and the measured error of a picture correct the forecasts.
  constexpr int attempts_max = 3;
  for (int n = 1; n < attempts_max && best && !exceeded_limits(*best).empty(); ++n) {
    const quality::Setting next = setting_of(*completed, cancel);
    if (next == setting) break;
    setting = next;
    auto picture = draw_at(*completed, setting, cancel);
    if (!picture && picture.error().kind == ErrorKind::cancelled) return picture;
    if (!picture) break;
    if (excess(*picture) < excess(*best)) best = std::move(picture);
  }
  return best;
}

std::string report_line(const Picture& picture) {
  return protocol::encode_frame_report(picture.info, milliseconds(picture.frame.render_us),
                                       milliseconds(picture.frame.encode_us)) +
         '\n';
}

std::string coarser_level_of(const Picture& picture) {
  const auto& detail = picture.frame.data_drawn;
  if (!frame::lacks_detail(detail)) return "";
  const auto& drawn = detail->drawn.halvings;
  const auto& wanted = detail->wanted.halvings;
  const auto text_of = [](const std::array<int, 3>& halvings) {
    return std::to_string(halvings[0]) + ',' + std::to_string(halvings[1]) + ',' +
           std::to_string(halvings[2]);
  };
  return "the data are drawn with their axes halved " + text_of(drawn) + " times, where " +
         text_of(wanted) + " would suffice: more does not fit into --memory-limit";
}

std::string exceeded_limits(const Picture& picture) {
  const protocol::QualityView& limits = picture.frame.view.quality;
  std::string text;
  const auto exceeds = [&](const char* what, double value, const char* unit, double limit,
                           const char* pointer) {
    if (!text.empty()) text += "; ";
    text += std::string(what) + ' ' + short_text(value) + unit + " exceeds " + pointer + ' ' +
            short_text(limit);
  };
  const double ms = drawing_ms(picture);
  if (limits.budget_ms && ms > *limits.budget_ms) {
    exceeds("time", ms, " ms", *limits.budget_ms, "/quality/budgetMs");
  }
  const auto& error = picture.info.error_value;
  if (limits.max_error && error && *error > *limits.max_error) {
    exceeds("error", *error, "", *limits.max_error, "/quality/maxError");
  }
  return text;
}

}  // namespace windsplat::cli
