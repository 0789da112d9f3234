// Handlers of the API resources, each with the parts of the server that it uses. The router has
// checked path and method.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/admission.hpp"
#include "server/api/documents/documents.hpp"
#include "server/api/routes.hpp"
#include "server/api/server_options.hpp"
#include "server/frame/frame.hpp"
#include "server/http/exchange.hpp"
#include "server/metrics/metrics.hpp"
#include "server/tasks/backend.hpp"

namespace windsplat::api {

http::Response get_service(const ServerOptions& options);
http::Response get_color_maps();
http::Response get_presets();
http::Response get_view_schema(const http::Request& request);
// The documents of the API (documents/documents.hpp), which need the table of routes.
std::shared_ptr<documents::Documents> documents_of(const ServerOptions& options);
http::Response get_description(documents::Documents& documents, documents::Kind kind,
                               const http::Request& request);
// Value of a header Link with the descriptions (RFC 8631).
std::string description_links(const std::string& base_path);
http::Response get_livez();
http::Response get_readyz(const std::atomic<bool>& draining);
http::Response get_metrics(const metrics::Metrics& metrics, const tasks::Catalogue& catalogue);

// Runs `make` on a thread of the executor and replies with its value or error. `what` names the
// work in the log; `of`: the dataset that it reads, if any.
void run_later(tasks::TaskExecutor& executor, const http::Request& request, http::Reply reply,
               const char* what, const data::Dataset* of, std::function<http::Response()> make);
bool is_json(std::string_view content_type);
bool is_merge_patch(std::string_view content_type);

http::Response get_datasets(const tasks::Catalogue& catalogue);
void get_dataset(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
                 const http::Request& request, http::Reply reply);

// Opens a file below a root given by --data-root, or other entries of a listed dataset, in a job.
void post_dataset(const ServerOptions& options, tasks::TaskExecutor& look_ups,
                  tasks::Backend& backend, const http::Request& request, http::Reply reply);
http::Response delete_dataset(tasks::Catalogue& catalogue, const std::string& id,
                              const http::Request& request);
// What can be opened below that root, one folder and page at a time. Reads names and first bytes.
void get_files(const ServerOptions& options, tasks::TaskExecutor& look_ups,
               const http::Request& request, http::Reply reply);
// 202 with the location of the job, or the error.
http::Response job_response(metrics::Metrics& metrics, const std::string& base_path,
                            const Result<protocol::JobDescription>& job);
http::Response get_jobs(const tasks::Jobs& jobs, const std::string& base_path);
http::Response get_job(const tasks::Jobs& jobs, const std::string& base_path,
                       const std::string& id);
http::Response delete_job(tasks::Jobs& jobs, const std::string& id);

void get_probe(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
               const http::Request& request, http::Reply reply);
void get_histogram(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
                   const std::string& field, const http::Request& request, http::Reply reply);
void get_series(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, const std::string& id,
                const std::string& field, const http::Request& request, http::Reply reply);
// The samples of a box as an array, or what such an array has.
enum class ValuesFormat { npy, json };
void get_values(tasks::Catalogue& catalogue, tasks::TaskExecutor& loads, ValuesFormat format,
                const std::string& id, const std::string& field, const http::Request& request,
                http::Reply reply);
void get_range(tasks::Backend& backend, const std::string& id, const std::string& field,
               const http::Request& request, http::Reply reply);
// Of the part of the data in the region of a view, which is the body.
void post_range(tasks::Backend& backend, const std::string& id, const std::string& field,
                const http::Request& request, http::Reply reply);

void get_frame(tasks::Backend& backend, access::Admission& admission, frame::Format format,
               const std::string& id, const http::Request& request, http::Reply reply);
// The picture of a saved view, with the same parameters.
void get_view_frame(tasks::Backend& backend, access::Admission& admission,
                    const views::SavedViews& views, frame::Format format, const std::string& id,
                    const http::Request& request, http::Reply reply);
void post_frame(tasks::Backend& backend, access::Admission& admission, const http::Request& request,
                http::Reply reply);

// The reference of a view: drawn by a job, then cached.
void post_reference(tasks::Backend& backend, access::Admission& admission,
                    const std::string& base_path, const http::Request& request, http::Reply reply);
http::Response get_reference(tasks::References& references, const std::string& name,
                             const http::Request& request);
// The movie of a view: drawn by a job, then kept for a while.
void post_animation(tasks::Backend& backend, access::Admission& admission,
                    tasks::TaskExecutor& look_ups, const std::string& base_path,
                    const http::Request& request, http::Reply reply);
http::Response get_animation(tasks::Animations& animations, const std::string& name,
                             const http::Request& request);
http::Response delete_animation(tasks::Animations& animations, const std::string& name);
// What a pixel of a posted view shows.
void post_pick(tasks::Backend& backend, const http::Request& request, http::Reply reply);
// Estimated time and error of a picture of a posted view.
void post_forecast(tasks::Backend& backend, const http::Request& request, http::Reply reply);

// `view_io` runs the changes.
void post_saved_view(views::SavedViews& views, tasks::TaskExecutor& view_io,
                     const std::string& base_path, const http::Request& request, http::Reply reply);
http::Response get_view(const views::SavedViews& views, const std::string& id,
                        const http::Request& request);
void put_view(views::SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
              const http::Request& request, http::Reply reply);
void patch_view(views::SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
                const http::Request& request, http::Reply reply);
void delete_view(views::SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
                 const http::Request& request, http::Reply reply);

// Where the body of a PUT of an upload goes, which also answers, or why it is refused.
StreamedBody receive_upload(const ServerOptions& options, const UploadThreads& threads,
                            const std::string& id, const http::Request& request,
                            std::uint64_t bytes);
http::Response get_upload(const ServerOptions& options, const std::string& id);
// With the datasets that were opened from it.
void delete_upload(const ServerOptions& options, tasks::TaskExecutor& disk,
                   tasks::Catalogue& catalogue, const std::string& id, const http::Request& request,
                   http::Reply reply);

// An embedded file of the page; `path` as in web_assets().
bool has_page(const std::string& path);
http::Response get_page(const ServerOptions& options, const std::string& path,
                        const http::Request& request);

// The page of a problem type, and the list of all, as HTML or plain text (problem_pages.cpp).
http::Response get_problem_types(const std::string& base_path, const http::Request& request);
http::Response get_problem_type(const std::string& base_path, const std::string& slug,
                                const http::Request& request);

// A JSON response.
http::Response json_response(std::string json);
// The same with a strong ETag of its content; 304 if the client has it.
http::Response tagged_response(const http::Request& request, std::string_view content_type,
                               std::string_view content);
// Digest of 128 bits, in quotes.
std::string etag_of(std::string_view text);

}  // namespace windsplat::api
