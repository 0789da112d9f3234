// Members are declared in order of dependency.
#include "server/transport/server_parts.hpp"

#include <utility>

#include "server/api/routes.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::transport {
namespace {

api::ServerOptions completed(api::ServerOptions options) {
  options.base_path = http::normal_base_path(options.base_path);
  if (options.views == nullptr) options.views = views::SavedViews::open({}).value();
  return options;
}

}  // namespace

ServerParts::ServerParts(api::ServerOptions server_options, std::shared_ptr<data::Store> store,
                         std::shared_ptr<ThreadPool> threads)
    : options(completed(std::move(server_options))),
      admission(options.limits, metrics),
      backend(
          std::move(store), std::move(threads), metrics,
          {options.requests_waiting_ms_max, options.limits.wait_ms,
           [this](const std::string& address, std::int64_t us) { admission.rendered(address, us); },
           [this](const frame::Cost& cost) { return admission.check(cost); },
           options.ground_bytes}),
      router(api::routes(options, draining, admission, backend, look_ups, view_io,
                         {upload_io, unpacking}),
             options, admission, draining) {
  metrics.count_routes(router.route_names());
}

void ServerParts::end() {
  look_ups.end();  // submit jobs
  backend.end();
  file_checks.end();
  view_io.end();
  unpacking.end();  // removes by upload_io
  upload_io.end();
  packing.end();  // after those that submit to it
}

}  // namespace windsplat::transport
