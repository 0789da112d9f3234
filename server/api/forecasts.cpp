// Forecasts: error and time of the settings that the server may choose for a posted view. Draws and
// loads nothing.
#include <memory>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/measurements.hpp"
#include "server/api/resources.hpp"
#include "server/http/problem.hpp"
#include "server/quality/curve.hpp"
#include "server/scene/completed_view.hpp"
#include "server/tasks/calibration_job.hpp"

namespace windsplat::api {
namespace {

Result<protocol::View> read_view(tasks::Backend& backend, const std::string& body) {
  const auto document = protocol::ViewDocument::parse(body);
  if (!document) return document.error();
  protocol::View view = document->view();
  if (view.dataset.empty()) {
    return make_error_at(ErrorKind::invalid, "/dataset", "must name a dataset");
  }
  if (view.method.name == protocol::MethodName::reference) {
    return make_error_at(
        ErrorKind::invalid, "/method/name",
        "the method reference has a single setting; forecasts apply to kernel and slab");
  }
  if (const auto drawable = backend.check(view); !drawable) return drawable.error();
  return view;
}

// Defaults of a view may depend on the ranges of its fields.
Error naming_the_way_out(Error error) {
  if (error.kind == ErrorKind::not_resident) error.message += "; POST /v1/frames loads it";
  return error;
}

Result<protocol::ForecastDescription> forecast(tasks::Backend& backend, const protocol::View& view,
                                               data::Dataset resident, const CancelToken& cancel) {
  const auto completed = scene::complete(view, resident);
  if (!completed) return naming_the_way_out(completed.error());
  const auto described = tasks::describe_view(backend, *completed, resident, cancel);
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "forecast cancelled");
  const quality::Forecasts known =
      backend.quality.forecasts(quality::signature_of(completed->view()), described.viewpoint);
  // That of a JPEG: the format is not known before the picture is requested.
  const double encoding_ms = backend.request_times.encoding_ms(frame::Format::jpeg, 1);
  return quality::curve(completed->view(), known, encoding_ms);
}

}  // namespace

void post_forecast(tasks::Backend& backend, const http::Request& request, http::Reply reply) {
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  auto view = read_view(backend, request.body);
  if (!view) {
    reply(http::problem_response(view.error()));
    return;
  }
  const auto dataset = tasks::find_shown(backend.catalogue, *view);
  if (!dataset) {
    reply(http::problem_response(dataset.error()));
    return;
  }
  // No dataset id: the job reads no data, so it waits only while all loading threads are busy.
  run_later(backend.loads, request, std::move(reply), "a forecast", nullptr,
            [&backend, view = std::move(*view), dataset = *dataset,
             cancel = request.cancel]() -> http::Response {
              const auto made = forecast(backend, view, dataset->resident_only(), cancel);
              return made ? json_response(protocol::encode_forecast(*made))
                          : http::problem_response(made.error());
            });
}

}  // namespace windsplat::api
