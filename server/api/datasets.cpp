// Opening datasets by a posted path in a job, removing them, and the jobs resource.
#include <memory>
#include <string>
#include <utility>

#include "protocol/codec.hpp"
#include "protocol/measurements.hpp"
#include "protocol/problems/problem_types.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/resources.hpp"
#include "server/data/files/files.hpp"
#include "server/data/files/locate_parts.hpp"
#include "server/data/files/url.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {
namespace {

http::Response no_content() { return {204, "", {{"Cache-Control", "no-store"}}, {}}; }

// `open`: takes a CancelToken and returns the id of the dataset.
template <class Open>
http::Response open_in_job(tasks::Backend& backend, const std::string& base_path, Open open) {
  const auto job =
      backend.jobs.submit("dataset",
                          [&backend, open = std::move(open)](
                              const tasks::Jobs::Handle& handle) -> Result<protocol::JobResult> {
                            Result<std::string> opened = open(handle.cancel);
                            backend.metrics.dataset_opened(opened.has_value());
                            if (!opened) return opened.error();
                            return std::move(*opened);
                          });
  return job_response(backend.metrics, base_path, job);
}

http::Response not_located(const Error& error) {
  return http::problem_response(make_error_at(error.kind, "/path", error.message));
}

http::Response open_location(const ServerOptions& options, tasks::Backend& backend,
                             const data::Location& location) {
  return open_in_job(backend, options.base_path, [&backend, location](const CancelToken& cancel) {
    return backend.catalogue.open(location, cancel);
  });
}

// Resolves only the name; reads nothing.
http::Response locate_and_open(const ServerOptions& options, tasks::Backend& backend,
                               const std::string& path) {
  const auto located = data::locate_beneath(options.data_root, path);
  if (located) return open_location(options, backend, *located);
  return not_located(located.error());
}

// The names in the list are resolved when it is opened, below the data root only.
http::Response open_list(const ServerOptions& options, tasks::Backend& backend,
                         const protocol::DatasetRequest& request) {
  data::Location location;
  location.folder = options.data_root;
  location.companions = true;
  location.stem = data::stem_of_pattern(request.first);
  location.list = request.list;
  return open_location(options, backend, location);
}

// The dataset is removed with the upload.
http::Response open_upload(const ServerOptions& options, tasks::Backend& backend,
                           const std::string& id) {
  const auto& uploads = options.uploads;
  if (!uploads) {
    return http::problem_response(403, "Forbidden",
                                  "uploads are disabled: start the server with --upload-limit "
                                  "and --state-dir");
  }
  const auto refuse = [](const Error& error) {
    return http::problem_response(make_error_at(error.kind, "/upload", error.message));
  };
  if (const auto upload = uploads->find(id); !upload) return refuse(upload.error());
  const auto located =
      data::locate_beneath(uploads->folder().native(), uploads::Uploads::path_of(id));
  if (!located) return refuse(located.error());
  return open_in_job(backend, options.base_path,
                     [&backend, uploads, location = *located,
                      id](const CancelToken& cancel) -> Result<std::string> {
                       auto dataset = backend.catalogue.open(location, cancel);
                       if (!dataset || uploads->opened(id, *dataset)) return dataset;
                       backend.catalogue.forget(*dataset);
                       return make_error(ErrorKind::not_found, "the upload was removed");
                     });
}

// No file is named: other entries of the files of a listed dataset.
http::Response open_entries(const ServerOptions& options, tasks::Backend& backend,
                            const protocol::DatasetRequest& request) {
  if (options.fixed_entries) {
    return http::problem_response(
        403, "Forbidden",
        "choosing other entries is disabled: the server runs with --fixed-entries");
  }
  data::Selection chosen;
  for (const auto& [dimension, value] : request.selection) chosen.push_back({dimension, value});
  const auto entries = backend.catalogue.entries_of(request.from, chosen);
  if (!entries) return http::problem_response(entries.error());
  return open_in_job(backend, options.base_path,
                     [&backend, entries = *entries](const CancelToken& cancel) {
                       return backend.catalogue.open_entries(entries, cancel);
                     });
}

void resolve_problem(protocol::JobDescription& job, const std::string& base_path) {
  if (job.problem) job.problem->type = protocol::resolved_type(base_path, job.problem->type);
}

}  // namespace

http::Response job_response(metrics::Metrics& metrics, const std::string& base_path,
                            const Result<protocol::JobDescription>& job) {
  if (!job) {
    if (job.error().kind == ErrorKind::busy) metrics.refused(metrics::LimitKind::waiting);
    return http::problem_response(job.error());
  }
  http::Response response = json_response(protocol::encode_job(*job));
  response.status = 202;
  response.headers.emplace_back("Location", base_path + "v1/jobs/" + job->id);
  return response;
}

void post_dataset(const ServerOptions& options, tasks::TaskExecutor& look_ups,
                  tasks::Backend& backend, const http::Request& request, http::Reply reply) {
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json: {\"path\": ...}, "
                                 "{\"upload\": ...}, {\"files\": [...]} or {\"from\": ..., "
                                 "\"selection\": {...}}"));
    return;
  }
  auto wanted = protocol::parse_dataset_request(request.body);
  if (!wanted) {
    reply(http::problem_response(wanted.error()));
    return;
  }
  if (!wanted->from.empty()) {
    reply(open_entries(options, backend, *wanted));
    return;
  }
  if (!wanted->upload.empty()) {
    run_later(look_ups, request, std::move(reply), "a look-up", nullptr,
              [&options, &backend, id = std::move(wanted->upload)] {
                return open_upload(options, backend, id);
              });
    return;
  }
  if (options.data_root.empty() && (!options.locate_url || !wanted->list.empty())) {
    reply(http::problem_response(403, "Forbidden",
                                 "opening files is disabled: start the server with "
                                 "--data-root, or --data-host for URLs"));
    return;
  }
  if (options.locate_url && data::looks_like_url(wanted->path)) {
    const auto located = options.locate_url(wanted->path);
    reply(located ? open_location(options, backend, *located) : not_located(located.error()));
    return;
  }
  if (options.data_root.empty()) {
    reply(not_located(make_error(ErrorKind::invalid, in_quotes(wanted->path) +
                                                         " is not a URL, and files are opened only "
                                                         "with --data-root")));
    return;
  }
  if (!wanted->list.empty()) {
    reply(open_list(options, backend, *wanted));
    return;
  }
  run_later(look_ups, request, std::move(reply), "a look-up", nullptr,
            [&options, &backend, path = std::move(wanted->path)] {
              return locate_and_open(options, backend, path);
            });
}

http::Response delete_dataset(tasks::Catalogue& catalogue, const std::string& id,
                              const http::Request& request) {
  http::QueryReader query(request.query);
  const bool forget = read_boolean(query, parameters::forget).value_or(false);
  if (const auto ok = query.finish(); !ok) return http::problem_response(ok.error());
  const auto dataset = catalogue.find(id);
  if (!dataset) {
    if (forget && catalogue.forget_failed(id)) return no_content();
    return http::problem_response(make_error(ErrorKind::not_found, dataset.error().message));
  }
  if (forget && !catalogue.is_opened_later(id)) {
    return http::problem_response(403, "Forbidden", "only datasets opened by POST can be deleted");
  }
  if (forget) {
    catalogue.forget(id);  // first, so that reads in progress end with the right error
  } else {
    (*dataset)->evict();
  }
  return no_content();
}

http::Response get_jobs(const tasks::Jobs& jobs, const std::string& base_path) {
  std::vector<protocol::JobDescription> list = jobs.list();
  for (protocol::JobDescription& job : list) resolve_problem(job, base_path);
  return json_response(protocol::encode_jobs(list));
}

http::Response get_job(const tasks::Jobs& jobs, const std::string& base_path,
                       const std::string& id) {
  auto job = jobs.find(id);
  if (!job) return http::problem_response(job.error());
  resolve_problem(*job, base_path);
  return json_response(protocol::encode_job(*job));
}

http::Response delete_job(tasks::Jobs& jobs, const std::string& id) {
  const auto cancelled = jobs.cancel(id);
  return cancelled ? no_content() : http::problem_response(cancelled.error());
}

}  // namespace windsplat::api
