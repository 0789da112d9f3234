// Opening datasets by a posted path in a job, removing them, and the jobs resource.
#include <memory>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/measurements.hpp"
#include "server/api/resources.hpp"
#include "server/data/files/files.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {
namespace {

http::Response no_content() { return {204, "", {{"Cache-Control", "no-store"}}, {}}; }

http::Response open_in_job(Services& services, data::Location location) {
  const auto job = services.backend.jobs.submit(
      "dataset",
      [&services, location = std::move(location)](
          const work::Jobs::Handle& handle) -> Result<protocol::JobResult> {
        auto opened = services.backend.catalogue.open(location, handle.cancel);
        services.metrics.dataset_opened(opened.has_value());
        if (!opened) return opened.error();
        return std::move(*opened);
      });
  return job_response(services, job);
}

// Only resolves the name; reads nothing.
http::Response locate_and_open(Services& services, const std::string& path) {
  const auto located = data::locate_beneath(services.options.data_root, path);
  if (located) return open_in_job(services, *located);
  return http::problem_response(
      make_error_at(located.error().kind, "/path", located.error().message));
}

}  // namespace

http::Response job_response(Services& services, const Result<protocol::JobDescription>& job) {
  if (!job) {
    if (job.error().kind == ErrorKind::busy) services.metrics.refused(metrics::LimitKind::waiting);
    return http::problem_response(job.error());
  }
  http::Response response = json_response(protocol::encode_job(*job));
  response.status = 202;
  response.headers.emplace_back("Location", services.options.base_path + "v1/jobs/" + job->id);
  return response;
}

void post_dataset(Services& services, const http::Request& request, http::Reply reply) {
  if (services.options.data_root.empty()) {
    reply(http::problem_response(403, "Forbidden",
                                 "opening files is disabled: start the server with "
                                 "--data-root"));
    return;
  }
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json: {\"path\": ...}"));
    return;
  }
  auto path = protocol::parse_dataset_request(request.body);
  if (!path) {
    reply(http::problem_response(path.error()));
    return;
  }
  run_later(services.locator, request, std::move(reply), "a look-up", nullptr,
            [&services, path = std::move(*path)] { return locate_and_open(services, path); });
}

http::Response delete_dataset(Services& services, const std::string& id,
                              const http::Request& request) {
  http::QueryReader query(request.query);
  const bool forget = query.boolean("forget").value_or(false);
  if (const auto ok = query.finish(); !ok) return http::problem_response(ok.error());
  const auto dataset = services.backend.catalogue.find(id);
  if (!dataset) {
    if (forget && services.backend.catalogue.forget_failed(id)) return no_content();
    return http::problem_response(make_error(ErrorKind::not_found, dataset.error().message));
  }
  if (forget && !services.backend.catalogue.is_opened_later(id)) {
    return http::problem_response(403, "Forbidden", "only datasets opened by POST can be deleted");
  }
  if (forget) {
    services.backend.catalogue.forget(
        id);  // first, so that reads in progress end with the right error
  } else {
    (*dataset)->evict();
  }
  return no_content();
}

http::Response get_jobs(const Services& services) {
  return json_response(protocol::encode_jobs(services.backend.jobs.list()));
}

http::Response get_job(const Services& services, const std::string& id) {
  const auto job = services.backend.jobs.find(id);
  return job ? json_response(protocol::encode_job(*job)) : http::problem_response(job.error());
}

http::Response delete_job(Services& services, const std::string& id) {
  const auto cancelled = services.backend.jobs.cancel(id);
  return cancelled ? no_content() : http::problem_response(cancelled.error());
}

}  // namespace windsplat::api
