// Pictures: a query, a saved or a posted view becomes a render job; the response has the encoded
// picture and its report.
#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include "protocol/codec.hpp"
#include "server/api/ascii_json.hpp"
#include "server/api/pictures/frame_query.hpp"
#include "server/api/resources.hpp"
#include "server/frame/frame_info.hpp"
#include "server/http/cors.hpp"
#include "server/http/gzip.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"
#include "server/quality/pick.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/presets.hpp"
#include "server/tasks/calibration_job.hpp"
#include "server/tasks/drawing.hpp"
#include "server/tasks/error_report.hpp"
#include "server/tasks/run_guarded.hpp"
#include "server/tasks/view_completion.hpp"

namespace windsplat::api {
namespace {

std::string_view media_type(frame::Format format) {
  switch (format) {
    case frame::Format::jpeg:
      return "image/jpeg";
    case frame::Format::png:
      return "image/png";
    case frame::Format::npy:
      return "application/x-npy";
    case frame::Format::pdf:
      return "application/pdf";
    case frame::Format::svg:
      return "image/svg+xml";
  }
  return "";
}

std::string milliseconds(std::int64_t us) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.3f", static_cast<double>(us) / 1000);
  return text.data();
}

// All inputs that determine the bytes of a picture.
std::string picture_etag(const protocol::View& view, const data::Dataset& dataset,
                         const frame::Encoding& encoding) {
  return etag_of(protocol::encode_view(view) + '\n' + dataset.digest() + '\n' + WINDSPLAT_VERSION +
                 '\n' + std::string(media_type(encoding.format)) + ' ' +
                 std::to_string(encoding.quality) + ' ' +
                 std::to_string(encoding.dots_per_inch.value_or(0)));
}

// The view of the request, with its preset and orbit.
Result<scene::CompletedView> complete(const Picture& picture, tasks::ViewCompletion& completion,
                                      data::Dataset& dataset) {
  const auto completed = completion.of(picture.view, dataset);
  if (!completed) return completed.error();
  const scene::Lattice& lattice = completed->lattice();
  Result<void> preset;
  auto framed = completed->with([&](protocol::View& view) {
    if (!picture.preset.empty()) preset = scene::apply_preset(view, lattice, picture.preset);
    if (picture.orbit) {
      const Orbit& orbit = *picture.orbit;
      scene::orbit(view, lattice, orbit.azimuth, orbit.elevation, orbit.zoom);
    }
  });
  if (!preset) return preset.error();
  return framed;
}

// With a budget or an error limit the server chooses settings, and the picture depends on more than
// the view.
bool is_chosen(const protocol::View& view) {
  return view.quality.budget_ms || view.quality.max_error;
}

// Whether a picture is described for its limits: not if this is expected to take more than a
// quarter of the budget. The tables' guess of what it shows decides then, as for moving frames.
bool is_worth_describing(tasks::Backend& backend, const protocol::View& view) {
  constexpr double share = 0.25;
  return !view.quality.budget_ms ||
         backend.request_times.describing_ms(view.dataset) <= share * *view.quality.budget_ms;
}

// The viewpoint of a picture with limits, described from its scene if there is one and the budget
// allows it.
frame::Described viewpoint_for_limits(tasks::Backend& backend,
                                      const scene::CompletedView& completed,
                                      const scene::Scene* scene, const CancelToken& cancel) {
  if (scene == nullptr || !is_worth_describing(backend, completed.view())) {
    return {frame::known_viewpoint_of(completed, backend.quality)};
  }
  return tasks::describe_view(backend, completed, *scene, cancel);
}

// At the setting that its limits need. What the view shows decides, so its data become resident
// first; a picture at the view's own setting is drawn from that scene. Errors: not_resident if
// nothing may be loaded; cancelled.
Result<tasks::PreparedPtr> prepare_limited(tasks::Backend& backend,
                                           const scene::CompletedView& completed,
                                           frame::Encoding encoding, data::Dataset& dataset,
                                           tasks::Loading loading, const CancelToken& cancel) {
  const protocol::View& view = completed.view();
  // Not after drawing: the budget does not allow it, or it was done before.
  encoding.describe = false;
  encoding.compare_levels = !view.quality.budget_ms;
  std::optional<frame::Prepared> own;
  {
    auto prepared = frame::prepare(completed, frame::own_setting(completed), dataset, encoding);
    // Where memory does not suffice for this scene, it may for that of a coarser setting.
    if (prepared) {
      own = std::move(*prepared);
    } else if (prepared.error().kind == ErrorKind::not_resident &&
               loading == tasks::Loading::none) {
      return prepared.error();
    }
  }
  const auto [viewpoint, describe_us] =
      viewpoint_for_limits(backend, completed, own ? &own->scene : nullptr, cancel);
  if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "request cancelled");
  const auto known = quality::with_encoding(
      view, backend.quality.forecasts(quality::signature_of(view), viewpoint),
      backend.request_times.encoding_ms(encoding.format, 1));
  quality::Aim aim{view.quality.budget_ms, view.quality.max_error};
  if (aim.budget_ms) {
    *aim.budget_ms = std::max(0.0, *aim.budget_ms - 1e-3 * static_cast<double>(describe_us));
  }
  const quality::Setting& setting = quality::settings[quality::pick(view, known, aim).setting];
  if (own && setting == own->setting) {
    own->content = viewpoint.content;
    return tasks::with_memory(std::move(*own), dataset, loading);
  }
  const std::int64_t sampling_us = own ? own->scene.sampling_us : 0;
  own.reset();  // its data may have to make room
  auto picture = tasks::prepare_picture(completed, setting, encoding, dataset, loading);
  if (picture) {
    (*picture)->frame.content = viewpoint.content;
    (*picture)->frame.scene.sampling_us += sampling_us;
  }
  return picture;
}

// Of pictures and of 304, whose headers replace those of the picture that the client has.
void add_picture_headers(frame::Format format, http::Response& response) {
  response.headers.emplace_back("Vary", "Accept");
  if (format == frame::Format::svg) http::add_vary(response, "Accept-Encoding");
  // Other sites may embed a picture by <img>, but cannot read its pixels.
  response.headers.emplace_back("Cross-Origin-Resource-Policy", "cross-origin");
}

http::Response unchanged_response(const std::string& etag, frame::Format format) {
  http::Response response{304, "", {{"Cache-Control", "no-cache"}, {"ETag", etag}}, {}};
  add_picture_headers(format, response);
  return response;
}

// Null if the client has the picture already: `reply` is called with 304. Its tag identifies the
// completed view, which may require reading data, so it is not known earlier.
Result<tasks::PreparedPtr> prepare(tasks::Backend& backend, const Picture& picture,
                                   tasks::ViewCompletion& completion, data::Dataset& dataset,
                                   tasks::Loading loading, const http::Reply& reply,
                                   const CancelToken& cancel) {
  const auto completed = complete(picture, completion, dataset);
  if (!completed) {
    if (loading == tasks::Loading::none) return completed.error();
    return tasks::with_dataset_name(completed.error(), dataset.info().id);
  }
  const protocol::View& view = completed->view();
  if (!is_chosen(view)) {
    const std::string etag = picture_etag(view, dataset, picture.encoding);
    if (const auto known = http::known_etag(picture.if_none_match, picture.accept_encoding, etag)) {
      reply(unchanged_response(*known, picture.encoding.format));
      return tasks::PreparedPtr();
    }
  }
  if (is_chosen(view) && view.method.name != protocol::MethodName::reference) {
    return prepare_limited(backend, *completed, picture.encoding, dataset, loading, cancel);
  }
  auto own = tasks::prepare_picture(*completed, frame::own_setting(*completed), picture.encoding,
                                    dataset, loading);
  if (own) (*own)->frame.content = frame::known_viewpoint_of(*completed, backend.quality).content;
  return own;
}

Result<http::Response> draw(tasks::Backend& backend, const Picture& picture,
                            const tasks::PreparedPicture& prepared, data::Dataset& dataset,
                            std::int64_t queue_us, tasks::Loading loading,
                            const CancelToken& cancel) {
  auto drawn = frame::produce(prepared.frame, dataset, *backend.pool, cancel, backend.frames);
  if (!drawn) return drawn.error();
  protocol::FrameInfo info = frame::frame_info(*drawn, drawn->view);
  tasks::report_error(*drawn, tasks::observed_in(*drawn, prepared.frame.setting),
                      prepared.frame.setting, prepared.frame.encoding, backend.quality, info);
  tasks::learn_describing(backend, drawn->view.dataset, drawn->describe_us);
  backend.metrics.stage_took(metrics::Metrics::Stage::queue, queue_us);
  backend.metrics.stage_took(metrics::Metrics::Stage::render, drawn->render_us);
  backend.metrics.stage_took(metrics::Metrics::Stage::encode, drawn->encode_us);
  backend.request_times.learn_encoding(
      picture.encoding.format, static_cast<double>(drawn->width) * drawn->height, drawn->encode_us);
  http::Response response;
  if (is_chosen(drawn->view)) {
    response.headers = {{"Cache-Control", "no-store"}};
  } else {
    response.headers = {{"Cache-Control", "no-cache"},
                        {"ETag", picture_etag(drawn->view, dataset, picture.encoding)}};
    // Settings chosen by the server reduce the work below the estimate; the scene of a picture that
    // waited for data was prepared elsewhere.
    if (loading == tasks::Loading::none) {
      backend.request_times.learn(drawn->view.dataset, drawn->view.method.name,
                                  picture.cost.kernels, drawn->render_us + drawn->encode_us);
    }
  }
  response.content_type = media_type(picture.encoding.format);
  response.headers.emplace_back("Server-Timing",
                                "queue;dur=" + milliseconds(queue_us) +
                                    ", render;dur=" + milliseconds(drawn->render_us) +
                                    ", encode;dur=" + milliseconds(drawn->encode_us));
  response.headers.emplace_back("Windsplat-Frame", ascii_json(protocol::encode_frame_info(info)));
  add_picture_headers(picture.encoding.format, response);
  response.body = http::Body::of(std::move(drawn->bytes));
  return response;
}

void submit_picture(tasks::Backend& backend, access::Admission& admission, Picture asked,
                    std::shared_ptr<data::Dataset> dataset, const http::Request& request,
                    http::Reply reply) {
  if (auto refusal = admission.picture(request.address)) {
    reply(std::move(*refusal));
    return;
  }
  const double estimate_ms = backend.request_times.estimate_ms(
      asked.view.dataset, asked.view.method.name, asked.cost.kernels);
  if (const auto fits = admission.check_estimate(asked.cost, estimate_ms); !fits) {
    reply(http::problem_response(fits.error()));
    return;
  }
  asked.if_none_match = request.header("If-None-Match");
  asked.accept_encoding = request.header("Accept-Encoding");
  const auto picture = std::make_shared<const Picture>(std::move(asked));
  const auto answer = std::make_shared<const http::Reply>(std::move(reply));
  const CancelToken cancel = request.cancel;
  // Addresses take turns, however many connections each has.
  const std::uint64_t owner =
      request.address.empty() ? request.peer : std::hash<std::string>{}(request.address);
  tasks::Drawing drawing{
      tasks::RenderService::Kind::request, owner, cancel, std::move(dataset), {}, {}, {}, 0, {}};
  drawing.prepare = [&backend, picture, answer, cancel,
                     completion = std::make_shared<tasks::ViewCompletion>(),
                     id = request.id](data::Dataset& available, tasks::Loading loading) {
    return tasks::run_guarded<tasks::PreparedPtr>(
        "preparing a picture", cancel,
        [&] {
          return prepare(backend, *picture, *completion, available, loading, *answer, cancel);
        },
        id);
  };
  drawing.draw = [&backend, picture, answer, cancel, id = request.id](
                     const tasks::PreparedPicture& prepared, data::Dataset& resident,
                     std::int64_t queue_us, tasks::Loading loading) {
    auto response = tasks::run_guarded<http::Response>(
        "a picture", cancel,
        [&] { return draw(backend, *picture, prepared, resident, queue_us, loading, cancel); }, id);
    (*answer)(response ? std::move(*response) : http::problem_response(response.error()));
  };
  drawing.payer = request.address;
  drawing.cost_ms = estimate_ms;
  drawing.fail = [answer](const Error& error) { (*answer)(http::problem_response(error)); };
  if (const auto queued = tasks::submit(backend, std::move(drawing)); !queued) {
    (*answer)(http::problem_response(queued.error()));
  }
}

// Requests that are refused do not count as a picture of the address.
void check_and_submit(tasks::Backend& backend, access::Admission& admission, Picture picture,
                      std::shared_ptr<data::Dataset> dataset, const http::Request& request,
                      http::Reply reply) {
  auto checked = backend.check(picture.view);
  if (!checked) {
    reply(http::problem_response(checked.error()));
    return;
  }
  picture.cost = std::move(checked->cost);
  submit_picture(backend, admission, std::move(picture), std::move(dataset), request,
                 std::move(reply));
}

// --- POST /v1/frames ----------------------------------------------------------------------------

Result<Picture> read_view(const http::Request& request, frame::Format format) {
  http::QueryReader query(request.query);
  Picture picture;
  const auto dots_per_inch = read_dots_per_inch(query, format);
  if (const auto ok = query.finish(); !ok) return ok.error();
  if (!dots_per_inch) return dots_per_inch.error();
  picture.encoding.dots_per_inch = *dots_per_inch;
  const auto document = protocol::ViewDocument::parse(request.body);
  if (!document) return document.error();
  picture.view = document->view();
  picture.encoding.format = format;
  picture.encoding.quality = jpeg_quality_default;
  picture.encoding.describe = true;
  if (picture.view.dataset.empty()) {
    return make_error_at(ErrorKind::invalid, "/dataset", "must name a dataset");
  }
  return picture;
}

}  // namespace

void get_frame(tasks::Backend& backend, access::Admission& admission, frame::Format format,
               const std::string& id, const http::Request& request, http::Reply reply) {
  auto dataset = backend.catalogue.find(id);
  if (!dataset) {
    reply(http::problem_response(make_error(ErrorKind::not_found, dataset.error().message)));
    return;
  }
  auto picture = read_picture(request, format, protocol::ViewDocument(), (*dataset)->info());
  if (!picture) {
    reply(http::problem_response(picture.error()));
    return;
  }
  picture->view.dataset = id;
  check_and_submit(backend, admission, std::move(*picture), std::move(*dataset), request,
                   std::move(reply));
}

void get_view_frame(tasks::Backend& backend, access::Admission& admission,
                    const views::SavedViews& views, frame::Format format, const std::string& id,
                    const http::Request& request, http::Reply reply) {
  const auto refuse = [&](const Error& error) { reply(http::problem_response(error)); };
  const auto saved = views.find(id);
  if (!saved) return refuse(saved.error());
  const protocol::View view = saved->view.view();
  if (view.dataset.empty()) {
    return refuse(make_error_at(ErrorKind::invalid, "/dataset", "the saved view names no dataset"));
  }
  const auto of = backend.catalogue.find(view.dataset);
  if (!of) return refuse(make_error(ErrorKind::not_found, of.error().message));
  auto picture = read_picture(request, format, saved->view, (*of)->info());
  if (!picture) return refuse(picture.error());
  auto dataset = tasks::find_shown(backend.catalogue, picture->view);
  if (!dataset) return refuse(dataset.error());
  check_and_submit(backend, admission, std::move(*picture), std::move(*dataset), request,
                   std::move(reply));
}

void post_frame(tasks::Backend& backend, access::Admission& admission, const http::Request& request,
                http::Reply reply) {
  constexpr std::array<frame::Format, 5> formats{frame::Format::jpeg, frame::Format::png,
                                                 frame::Format::npy, frame::Format::pdf,
                                                 frame::Format::svg};
  constexpr std::array<std::string_view, 5> types{"image/jpeg", "image/png", "application/x-npy",
                                                  "application/pdf", "image/svg+xml"};
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  const auto type = http::choose_type(request.header("Accept"), types);
  if (!type) {
    reply(http::problem_response(406, "Not Acceptable",
                                 "Accept must allow image/jpeg, image/png, application/x-npy, "
                                 "application/pdf or image/svg+xml"));
    return;
  }
  auto picture = read_view(request, formats[*type]);
  if (!picture) {
    reply(http::problem_response(picture.error()));
    return;
  }
  auto checked = backend.check(picture->view);
  if (!checked) {
    reply(http::problem_response(checked.error()));
    return;
  }
  picture->cost = std::move(checked->cost);
  auto dataset = tasks::find_shown(backend.catalogue, picture->view);
  if (!dataset) {
    reply(http::problem_response(dataset.error()));
    return;
  }
  submit_picture(backend, admission, std::move(*picture), std::move(*dataset), request,
                 std::move(reply));
}

}  // namespace windsplat::api
