// Members are declared in order of dependency.
#include "server/tasks/backend.hpp"

#include <utility>

namespace windsplat::tasks {

Backend::Backend(std::shared_ptr<data::Store> store, std::shared_ptr<ThreadPool> threads,
                 metrics::Metrics& metrics_of_server, BackendOptions options)
    : catalogue(std::move(store)),
      metrics(metrics_of_server),
      pool(std::move(threads)),
      video([this](int more) { metrics.video_encoders(more); }),
      request_times(pool->size()),
      jobs(job_settings),
      renderer({requests_waiting_max,
                options.requests_waiting_ms_max,
                {},
                options.wait_ms,
                std::move(options.charge),
                [this] { metrics.refused(metrics::LimitKind::waiting); }}),
      loads(load_settings, [this] { metrics.refused(metrics::LimitKind::waiting); }),
      check_cost_(std::move(options.check_cost)) {
  frames.space.limit_grounds(options.ground_bytes);
}

Result<Catalogue::Checked> Backend::check(const protocol::View& view) {
  auto checked = catalogue.check(view);
  if (!checked) return checked;
  if (const auto fits = check_cost_(checked->cost); !fits) return fits.error();
  return checked;
}

void Backend::end() {
  jobs.end();  // jobs wait for the renderer and the loads
  loads.end();
  renderer.end();
}

}  // namespace windsplat::tasks
