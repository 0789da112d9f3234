// Handlers of the API resources. The router has checked path and method.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "server/api/router.hpp"
#include "server/frame/frame.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::net {

Response get_service(const Services& services);
Response get_color_maps();
Response get_presets();
Response get_view_schema(const Request& request);
Response get_livez();
Response get_readyz(const Services& services);
Response get_metrics(const Services& services);

// Runs `make` on a thread of the service and replies with its value or error. `what` names the work
// in the log; `of`: the dataset that it reads, if any.
void run_later(TaskExecutor& service, const Request& request, Reply reply, const char* what,
               const data::Dataset* of, std::function<Response()> make);
bool is_json(std::string_view content_type);
bool is_merge_patch(std::string_view content_type);

Response get_datasets(const Services& services);
void get_dataset(Services& services, const std::string& id, const Request& request, Reply reply);

// Opens a file below a root given by --data-root, in a job.
void post_dataset(Services& services, const Request& request, Reply reply);
Response delete_dataset(Services& services, const std::string& id, const Request& request);
// 202 with the location of the job, or the error.
Response job_response(Services& services, const Result<protocol::JobDescription>& job);
Response get_jobs(const Services& services);
Response get_job(const Services& services, const std::string& id);
Response delete_job(Services& services, const std::string& id);

void get_probe(Services& services, const std::string& id, const Request& request, Reply reply);
void get_histogram(Services& services, const std::string& id, const std::string& field,
                   const Request& request, Reply reply);
void get_series(Services& services, const std::string& id, const std::string& field,
                const Request& request, Reply reply);
void get_range(Services& services, const std::string& id, const std::string& field,
               const Request& request, Reply reply);

void get_frame(Services& services, const std::string& id, frame::Format format,
               const Request& request, Reply reply);
void post_frame(Services& services, const Request& request, Reply reply);

// The reference of a view: drawn by a job, then cached.
void post_reference(Services& services, const Request& request, Reply reply);
Response get_reference(Services& services, const std::string& name, const Request& request);
// Estimated time and error of a picture of a posted view.
void post_forecast(Services& services, const Request& request, Reply reply);

void post_saved_view(Services& services, const Request& request, Reply reply);
Response get_view(const Services& services, const std::string& id, const Request& request);
void put_view(Services& services, const std::string& id, const Request& request, Reply reply);
void patch_view(Services& services, const std::string& id, const Request& request, Reply reply);
void delete_view(Services& services, const std::string& id, const Request& request, Reply reply);

// An embedded file of the page; `path` as in web_assets().
bool has_page(const std::string& path);
Response get_page(const Request& request, const std::string& path);

// A JSON response.
Response json_response(std::string json);
// The same with a strong ETag of its content; 304 if the client has it.
Response tagged_response(const Request& request, std::string_view content_type,
                         std::string_view content);
// Digest of 128 bits, in quotes.
std::string etag_of(std::string_view text);

}  // namespace windsplat::net
