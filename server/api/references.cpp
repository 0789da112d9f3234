// References: a posted view becomes a job that draws it; cached pictures are served as PNG.
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "server/api/resources.hpp"
#include "server/base/trim_storage.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/tasks/reference_job.hpp"

namespace windsplat::api {
namespace {

constexpr std::string_view suffix = ".png";

Result<protocol::View> read_view(tasks::Backend& backend, const http::Request& request) {
  const auto document = protocol::ViewDocument::parse(request.body);
  if (!document) return document.error();
  protocol::View view = document->view();
  if (view.dataset.empty()) {
    return make_error_at(ErrorKind::invalid, "/dataset", "must name a dataset");
  }
  if (view.method.name == protocol::MethodName::reference) {
    return make_error_at(ErrorKind::invalid, "/method/name",
                         "must be the method to compare with the reference: kernel or slab");
  }
  const auto pixels =
      static_cast<std::size_t>(view.image.width) * static_cast<std::size_t>(view.image.height);
  if (pixels > retained_pixels) {
    std::string detail = "a reference has at most " + std::to_string(retained_pixels);
    detail += " pixels; draw larger ones with `windsplat render`";
    return make_error_at(ErrorKind::too_large, "/image", std::move(detail));
  }
  if (const auto drawable = backend.check(view); !drawable) return drawable.error();
  return view;
}

}  // namespace

void post_reference(tasks::Backend& backend, access::Admission& admission,
                    const std::string& base_path, const http::Request& request, http::Reply reply) {
  const http::Reply answer = std::move(reply);
  if (!is_json(request.header("Content-Type"))) {
    answer(http::problem_response(415, "Unsupported Media Type",
                                  "Content-Type must be application/json"));
    return;
  }
  auto view = read_view(backend, request);
  if (!view) return answer(http::problem_response(view.error()));
  const auto dataset = tasks::find_shown(backend.catalogue, *view);
  if (!dataset) return answer(http::problem_response(dataset.error()));
  if (auto refusal = admission.picture(request.address)) return answer(*refusal);
  tasks::Jobs::Terms terms;
  terms.slow = true;
  auto ticket = backend.references.admit(request.address, terms.cancel);
  if (!ticket) return answer(http::problem_response(ticket.error()));
  const auto work = [&backend, &base_path, view = std::move(*view), dataset = *dataset,
                     address = request.address,
                     ticket = std::move(*ticket)](const tasks::Jobs::Handle& handle) {
    return tasks::draw_reference(backend, view, *dataset, handle, address, base_path);
  };
  answer(job_response(backend.metrics, base_path, backend.jobs.submit("reference", work, terms)));
}

// The content of an id never changes.
http::Response get_reference(tasks::References& references, const std::string& name,
                             const http::Request& request) {
  const bool is_png = name.size() > suffix.size() && name.ends_with(suffix);
  const std::string id = is_png ? name.substr(0, name.size() - suffix.size()) : "";
  const auto kept = references.find(id);
  if (!kept) {
    return http::problem_response(
        make_error(ErrorKind::not_found, "unknown or expired reference: post the view again"));
  }
  http::Response response;
  const std::string etag = '"' + id + '"';
  response.headers = {{"Cache-Control", "private, max-age=3600, immutable"}, {"ETag", etag}};
  if (http::matches_etag(request.header("If-None-Match"), etag)) {
    response.status = 304;
    return response;
  }
  response.content_type = "image/png";
  response.body = {kept->png, *kept->png};
  return response;
}

}  // namespace windsplat::api
