// Members are declared in order of dependency.
#include "server/api/services.hpp"

#include <utility>

#include "server/api/routes.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {
namespace {

constexpr std::size_t view_changes_waiting_max = 64;  // each may take one disk sync

}  // namespace

Services::Services(ServerOptions server_options, std::shared_ptr<data::Store> store,
                   std::shared_ptr<ThreadPool> threads)
    : options(std::move(server_options)),
      metrics(route_names()),
      admission(options.limits, metrics),
      backend(
          std::move(store), std::move(threads), metrics,
          {options.requests_waiting_ms_max, options.limits.wait_ms,
           [this](const std::string& address, std::int64_t us) { admission.rendered(address, us); },
           [this](const frame::Cost& cost) { return admission.check(cost); }}),
      locator(1, work::Backend::requests_waiting_max, "files to open"),
      view_io(1, view_changes_waiting_max, "changes of saved views"),
      file_watch(1, 1, "file checks") {
  options.base_path = http::normal_base_path(options.base_path);
  if (options.views == nullptr) options.views = views::SavedViews::open({}).value();
}

void Services::end() {
  locator.end();  // submits jobs
  backend.end();
  file_watch.end();
  view_io.end();
}

}  // namespace windsplat::api
