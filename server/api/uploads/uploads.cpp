// Uploads: the body of a PUT goes to a file while it is received; its datasets live as long as it.
#include "server/uploads/uploads.hpp"

#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "protocol/measurements.hpp"
#include "protocol/utc_time.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/resources.hpp"
#include "server/http/body_sink.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"
#include "server/tasks/run_guarded.hpp"

namespace windsplat::api {
namespace {

using uploads::Incoming;

http::Response uploads_are_off() {
  return http::problem_response(403, "Forbidden",
                                "uploads are disabled: start the server with --upload-limit "
                                "and --state-dir");
}

http::Response upload_response(const uploads::Upload& upload) {
  const std::string digest = uploads::digest_text(upload.digest);
  http::Response response = json_response(protocol::encode_upload(
      {upload.id, upload.bytes, digest, protocol::utc_text(upload.expires)}));
  response.headers = {{"Cache-Control", "no-store"}};
  return response;
}

// Works on a thread of the executor.
class UploadSink final : public http::BodySink {
 public:
  UploadSink(std::shared_ptr<Incoming> into, const UploadThreads& threads,
             const CancelToken& cancel, std::string base_path)
      : into_(std::move(into)),
        threads_(threads),
        cancel_(cancel),
        base_path_(std::move(base_path)) {}
  // The network thread, which closes connections, does not wait for a file that is removed: a task
  // has the last reference.
  ~UploadSink() override {
    try {
      static_cast<void>(threads_.disk.submit({{}, [into = std::move(into_)] {}, true}));
    } catch (const std::bad_alloc&) {  // removed here
    }
  }
  UploadSink(const UploadSink&) = delete;
  UploadSink& operator=(const UploadSink&) = delete;

  void take(std::vector<std::byte> bytes, Done done) override {
    // Admitted: one part of each upload at a time, of which there are few.
    const auto part = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
    const auto answer = std::make_shared<Done>(std::move(done));
    const auto run = [into = into_, part, answer] {
      const auto written = into->write(*part);
      (*answer)(written ? std::nullopt : std::optional(http::problem_response(written.error())));
    };
    const auto queued = threads_.disk.submit({cancel_, run, true});
    if (!queued) (*answer)(http::problem_response(queued.error()));
  }

  void answer(const http::Request& request, http::Reply reply) override {
    const auto answer = std::make_shared<const http::Reply>(std::move(reply));
    const auto finish = [into = into_, base_path = base_path_, cancel = cancel_] {
      const auto upload = into->finish(cancel);
      if (!upload) return http::problem_response(upload.error());
      http::Response response = upload_response(*upload);
      response.status = 201;
      response.headers.emplace_back("Location", base_path + "v1/uploads/" + upload->id);
      return response;
    };
    const auto run = [finish, answer, cancel = cancel_, id = request.id] {
      auto response = tasks::run_guarded<http::Response>("an upload", cancel, finish, id);
      (*answer)(response ? std::move(*response) : http::problem_response(response.error()));
    };
    // Admitted, as take(): uploads are bounded, and so are those that wait for others of their
    // address.
    const bool unpacks = into_->is_archive();
    const auto queued = (unpacks ? threads_.unpacking : threads_.disk)
                            .submit({cancel_, run, true, unpacks ? into_->address_key() : nullptr});
    if (!queued) (*answer)(http::problem_response(queued.error()));
  }

 private:
  std::shared_ptr<Incoming> into_;
  const UploadThreads threads_;
  const CancelToken cancel_;
  const std::string base_path_;
};

// What the header announces. Errors: invalid, malformed.
Result<uploads::Announced> read_announced(const std::string& id, const http::Request& request,
                                          std::uint64_t bytes) {
  http::QueryReader query(request.query);
  uploads::Announced out;
  out.id = id;
  out.bytes = bytes;
  out.address = request.address;
  out.keep_s = read_integer(query, parameters::keep).value_or(uploads::keep_s_default);
  if (const auto ok = query.finish(); !ok) return ok.error();
  for (const char* name : {"Content-Digest", "Repr-Digest"}) {
    const auto digest = uploads::parse_digest(request.header(name));
    if (!digest) return digest.error();
    if (!*digest) continue;
    if (out.digest && *out.digest != **digest) {
      return make_error(ErrorKind::invalid, "Content-Digest and Repr-Digest differ");
    }
    out.digest = **digest;
  }
  return out;
}

}  // namespace

StreamedBody receive_upload(const ServerOptions& options, const UploadThreads& threads,
                            const std::string& id, const http::Request& request,
                            std::uint64_t bytes) {
  if (!options.uploads) return {nullptr, uploads_are_off()};
  if (!request.header("Content-Encoding").empty()) {
    return {nullptr, http::problem_response(415, "Unsupported Media Type",
                                            "an upload may have no Content-Encoding")};
  }
  if (!request.header("Content-Range").empty()) {
    return {nullptr, http::problem_response(400, "Bad Request",
                                            "an upload is sent whole, without Content-Range")};
  }
  const auto announced = read_announced(id, request, bytes);
  if (!announced) return {nullptr, http::problem_response(announced.error())};
  auto into = options.uploads->begin(*announced);
  if (!into) return {nullptr, http::problem_response(into.error())};
  return {
      std::make_shared<UploadSink>(std::move(*into), threads, request.cancel, options.base_path),
      std::nullopt};
}

http::Response get_upload(const ServerOptions& options, const std::string& id) {
  if (!options.uploads) return uploads_are_off();
  const auto upload = options.uploads->find(id);
  return upload ? upload_response(*upload) : http::problem_response(upload.error());
}

void delete_upload(const ServerOptions& options, tasks::TaskExecutor& disk,
                   tasks::Catalogue& catalogue, const std::string& id, const http::Request& request,
                   http::Reply reply) {
  if (!options.uploads) {
    reply(uploads_are_off());
    return;
  }
  run_later(disk, request, std::move(reply), "removing an upload", nullptr,
            [uploads = options.uploads, &catalogue, id]() -> http::Response {
              const auto datasets = uploads->remove(id);
              if (!datasets) return http::problem_response(datasets.error());
              for (const std::string& dataset : *datasets) catalogue.forget(dataset);
              return {204, "", {{"Cache-Control", "no-store"}}, {}};
            });
}

}  // namespace windsplat::api
