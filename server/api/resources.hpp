// Handlers of the API resources. The router has checked path and method.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "server/api/router.hpp"
#include "server/frame/frame.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::api {

http::Response get_service(const Services& services);
http::Response get_color_maps();
http::Response get_presets();
http::Response get_view_schema(const http::Request& request);
http::Response get_livez();
http::Response get_readyz(const Services& services);
http::Response get_metrics(const Services& services);

// Runs `make` on a thread of the service and replies with its value or error. `what` names the work
// in the log; `of`: the dataset that it reads, if any.
void run_later(work::TaskExecutor& service, const http::Request& request, http::Reply reply,
               const char* what, const data::Dataset* of, std::function<http::Response()> make);
bool is_json(std::string_view content_type);
bool is_merge_patch(std::string_view content_type);

http::Response get_datasets(const Services& services);
void get_dataset(Services& services, const std::string& id, const http::Request& request,
                 http::Reply reply);

// Opens a file below a root given by --data-root, in a job.
void post_dataset(Services& services, const http::Request& request, http::Reply reply);
http::Response delete_dataset(Services& services, const std::string& id,
                              const http::Request& request);
// 202 with the location of the job, or the error.
http::Response job_response(Services& services, const Result<protocol::JobDescription>& job);
http::Response get_jobs(const Services& services);
http::Response get_job(const Services& services, const std::string& id);
http::Response delete_job(Services& services, const std::string& id);

void get_probe(Services& services, const std::string& id, const http::Request& request,
               http::Reply reply);
void get_histogram(Services& services, const std::string& id, const std::string& field,
                   const http::Request& request, http::Reply reply);
void get_series(Services& services, const std::string& id, const std::string& field,
                const http::Request& request, http::Reply reply);
void get_range(Services& services, const std::string& id, const std::string& field,
               const http::Request& request, http::Reply reply);

void get_frame(Services& services, const std::string& id, frame::Format format,
               const http::Request& request, http::Reply reply);
void post_frame(Services& services, const http::Request& request, http::Reply reply);

// The reference of a view: drawn by a job, then cached.
void post_reference(Services& services, const http::Request& request, http::Reply reply);
http::Response get_reference(Services& services, const std::string& name,
                             const http::Request& request);
// Estimated time and error of a picture of a posted view.
void post_forecast(Services& services, const http::Request& request, http::Reply reply);

void post_saved_view(Services& services, const http::Request& request, http::Reply reply);
http::Response get_view(const Services& services, const std::string& id,
                        const http::Request& request);
void put_view(Services& services, const std::string& id, const http::Request& request,
              http::Reply reply);
void patch_view(Services& services, const std::string& id, const http::Request& request,
                http::Reply reply);
void delete_view(Services& services, const std::string& id, const http::Request& request,
                 http::Reply reply);

// An embedded file of the page; `path` as in web_assets().
bool has_page(const std::string& path);
http::Response get_page(const http::Request& request, const std::string& path);

// A JSON response.
http::Response json_response(std::string json);
// The same with a strong ETag of its content; 304 if the client has it.
http::Response tagged_response(const http::Request& request, std::string_view content_type,
                               std::string_view content);
// Digest of 128 bits, in quotes.
std::string etag_of(std::string_view text);

}  // namespace windsplat::api
