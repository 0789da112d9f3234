// windsplat serve: opens datasets, then runs the daemon until SIGTERM or SIGINT; SIGHUP reloads
// configuration, token and certificate, and retries failed datasets.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/base/log.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/command.hpp"
#include "server/cli/open_store.hpp"
#include "server/cli/serve/config_file.hpp"
#include "server/cli/serve/service_manager.hpp"
#include "server/cli/serve/settings.hpp"
#include "server/cli/signals.hpp"
#include "server/data/files/url.hpp"
#include "server/data/resident/store.hpp"
#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "server/scene/defaults.hpp"
#include "server/scene/describe.hpp"
#include "server/transport/server.hpp"
#include "server/uploads/uploads.hpp"
#include "server/views/saved_views.hpp"

namespace windsplat::cli {
namespace {

// Options applied at a reload; others require a restart.
constexpr std::array<std::string_view, 9> live_options{"token-file",   "tls-cert",   "tls-key",
                                                       "allow-origin", "allow-host", "allow-remote",
                                                       "allow-root",   "log-format", "log-level"};

// Limit on the wait for a reload at shutdown, because a disk may not respond.
constexpr std::chrono::seconds reload_patience{1};

void configure_log(const ServeArguments& arguments) {
  const std::string& level =
      arguments.verbosity_level.empty() ? arguments.log_level : arguments.verbosity_level;
  log::configure(arguments.log_format == "json" ? log::Format::json : log::Format::text,
                 log::parse_level(level).value_or(log::Level::info));
}

// Signal handling of the daemon. The watching thread starts before the server, which exists only
// when the datasets are open.
class Control {
 public:
  Control(const CLI::App& given, std::shared_ptr<const ServiceManager> manager)
      : given_(given), manager_(std::move(manager)) {}

  // Applies requests received before the server existed.
  void arm(transport::Server& server, std::shared_ptr<data::Store> store,
           std::unique_ptr<ServeSettings> started) {
    store_ = std::move(store);
    started_ = std::move(started);
    tls_ = started_->options.tls;
    serving_ = "serving " + server.url();
    while (true) {
      {
        const std::lock_guard lock(mutex_);
        if (!reload_wanted_) {
          server_ = &server;
          return;
        }
        reload_wanted_ = false;
      }
      reload_now([&server](transport::Access access) { server.change(std::move(access)); });
    }
  }
  void disarm() {
    const std::lock_guard lock(mutex_);
    server_ = nullptr;
  }

  // Before the server exists the process exits without waiting for a reload.
  void drain() {
    const std::lock_guard lock(mutex_);
    if (server_ == nullptr) _exit(exit_ok);
    log::info("draining");  // log it before the drain can complete
    draining_ = true;
    server_->drain();
    manager_->stopping();  // may wait
  }

  // Called on one thread. Deferred until the server exists.
  void reload() {
    {
      const std::lock_guard lock(mutex_);
      reload_wanted_ = server_ == nullptr;
      if (reload_wanted_ || draining_) return;
      manager_->reloading();
    }
    const bool reloaded = reload_now([this](transport::Access access) {
      const std::lock_guard lock(mutex_);
      if (server_ != nullptr) server_->change(std::move(access));
    });
    const std::lock_guard lock(mutex_);
    if (draining_) return;  // the manager must not take it for running again
    manager_->ready(reloaded ? serving_ : serving_ + "; the last reload was refused: see the log");
  }

 private:
  // All or nothing, even when memory or threads run out. False: nothing.
  bool reload_now(const std::function<void(transport::Access)>& change) {
    try {
      return take_over(change);
    } catch (const std::exception& fault) {
      log::error("the configuration is unchanged", {{"fault", fault.what()}});
      return false;
    }
  }

  // May block on a disk, so only `change` takes the lock.
  bool take_over(const std::function<void(transport::Access)>& change) {
    const auto fresh = read_settings(given_, *manager_);
    if (!fresh) return refuse(fresh.error());
    const ServeSettings& settings = **fresh;
    // The address does not change at a reload, so check the rule for the current one.
    const auto exposed = check_exposure(settings.arguments, started_->options.local_hosts_only);
    if (!exposed) return refuse(exposed.error());
    for (const std::string& name : changed_options(started_->command, settings.command)) {
      if (std::find(live_options.begin(), live_options.end(), name) == live_options.end()) {
        log::warn("a changed option requires a restart", {{"option", name}});
      }
    }
    const api::ServerOptions& options = settings.options;
    auto tls = tls_;
    if ((tls != nullptr) != (options.tls != nullptr)) {
      log::warn("enabling or disabling TLS requires a restart", {{"option", "tls-cert"}});
    } else {
      tls = options.tls;
    }
    warn_of(settings);
    change(
        {options.allow_origins, options.token, tls, options.known_hosts_only, options.allow_hosts});
    tls_ = std::move(tls);
    configure_log(settings.arguments);
    store_->try_failed_again();
    log::info("configuration reloaded");
    return true;
  }

  static bool refuse(const Error& error) {
    log::error("the configuration is unchanged", {{"fault", error.message}});
    return false;
  }

  const CLI::App& given_;
  std::shared_ptr<const ServiceManager> manager_;
  std::shared_ptr<data::Store> store_;
  std::unique_ptr<ServeSettings> started_;
  std::shared_ptr<transport::TlsContext> tls_;  // the newest one
  std::string serving_;                         // status for the service manager
  std::mutex mutex_;                            // guards the members below, held briefly
  transport::Server* server_ = nullptr;
  bool reload_wanted_ = false;
  bool draining_ = false;
};

// Reject a dataset whose default fields cannot be loaded: every frame of it would fail. Where boxes
// of all fields can be read, it can be probed; but one that was shown `before` is not replaced by
// one that is not.
Result<void> check_first_view(const data::Dataset& dataset, const data::Dataset* before) {
  const auto unfit = scene::why_not_shown(dataset);
  if (!unfit) return unfit.error();
  if (unfit->empty() || before == nullptr) return {};
  const auto was = scene::why_not_shown(*before);
  return was && was->empty() ? Result<void>(make_error(ErrorKind::out_of_memory, *unfit))
                             : Result<void>();
}

// One bad file does not prevent serving the others, unless `strict`: it is listed as failed. The
// value is the exit code if nothing can be served (that of bad data if any file is bad), or with
// `strict` not all, else exit_ok.
int open_datasets(const std::vector<std::string>& named, bool strict, data::Store& store) {
  int code = exit_ok;
  for (const std::string& name : named.empty() ? data::sample_names() : named) {
    const auto dataset = store.add(name);
    if (!dataset) {
      const Error& error = dataset.error();
      const std::string shown = data::looks_like_url(name) ? data::without_secrets(name) : name;
      code = code == exit_bad_data ? code : exit_code(error.kind);
      log::warn("cannot open a dataset", {{"dataset", shown}, {"fault", error.message}});
      store.list_failed(name, error);
      continue;
    }
    const data::DatasetInfo& info = (*dataset)->info();
    log::info("opened", {{"dataset", info.id},
                         {"format", info.format},
                         {"samples", info.grid.samples()},
                         {"fields", info.fields.size()},
                         {"steps", info.steps.size()}});
    const auto unfit = scene::why_not_shown(**dataset);
    const std::string beyond = (*dataset)->beyond_limit(scene::fields_of({}, info));
    if (unfit && !unfit->empty()) {
      log::warn("a dataset can be probed, but its default view is not shown",
                {{"dataset", info.id}, {"fault", *unfit}});
    } else if (!beyond.empty() && info.stored) {
      log::info("full detail exceeds the memory limit: pictures are drawn from stored levels",
                {{"dataset", info.id}, {"fault", beyond.substr(2)}});
    } else if (!beyond.empty()) {
      log::warn("the memory limit may be too small for a dataset's first view",
                {{"dataset", info.id}, {"fault", beyond.substr(2)}});
    }
  }
  if (store.all().empty() || strict) return code;
  if (code != exit_ok) {
    log::warn("datasets that cannot be opened are listed as failed",
              {{"datasets", store.failed().size()}});
  }
  return exit_ok;
}

// Locates the URLs of POST /v1/datasets.
std::function<Result<data::Location>(const std::string&)> locate_on(const FetcherPtr& fetcher) {
  return [fetcher](const std::string& url) -> Result<data::Location> {
    auto location = data::locate_url(url);
    if (!location) return location;
    if (auto permitted = fetcher->check(*location); !permitted) return permitted.error();
    return location;
  };
}

// Null: none are accepted. Called while the folder of the state is locked, so that uploads found in
// it are those of a daemon that was killed.
Result<std::shared_ptr<uploads::Uploads>> open_uploads(const ServeArguments& arguments) {
  if (arguments.state_dir.empty()) return std::shared_ptr<uploads::Uploads>();
  const auto folder = std::filesystem::absolute(arguments.state_dir) / "uploads";
  if (const auto bytes = upload_bytes(arguments); bytes && *bytes > 0) {
    return uploads::Uploads::open({folder, *bytes});
  }
  if (const auto ok = uploads::Uploads::remove_leftovers(folder); !ok) {
    log::warn("uploads of a daemon that was killed cannot be removed",
              {{"fault", ok.error().message}});
  }
  return std::shared_ptr<uploads::Uploads>();
}

int serve(const CLI::App& given) {
  auto manager = ServiceManager::from_environment();
  if (!manager) return answer(manager.error());
  const auto control = std::make_shared<Control>(given, *manager);
  SignalWatch signals([control] { control->drain(); }, [control] { control->reload(); });
  auto settings = read_settings(given, **manager);
  if (!settings) return answer(settings.error());
  const ServeArguments arguments = (*settings)->arguments;
  configure_log(arguments);
  api::ServerOptions options = (*settings)->options;
  warn_of(**settings);

  auto fetcher = open_fetcher(arguments.data_hosts);
  if (!fetcher) return answer(fetcher.error());
  if (*fetcher) options.locate_url = locate_on(*fetcher);
  data::StoreOptions stored = store_options(
      parse_bytes(arguments.memory_limit).value_or(0), *fetcher,
      arguments.storage == "packed16" ? data::Storage::packed16 : data::Storage::float32);
  stored.check = check_first_view;
  const auto store = std::make_shared<data::Store>(std::move(stored));
  if (const int code = open_datasets(arguments.datasets, arguments.strict, *store);
      code != exit_ok) {
    for (const data::Store::Failed& failed : store->failed())
      complain(printable(failed.problem, 2000));
    return code;
  }
  auto views = views::SavedViews::open({arguments.state_dir});
  if (!views) return answer(views.error());
  options.views = std::move(*views);
  options.alive_every = (*manager)->alive_every();
  options.alive = [told = *manager] { told->alive(); };
  auto uploads = open_uploads(arguments);
  if (!uploads) return answer(uploads.error());
  options.uploads = std::move(*uploads);
  transport::Server server(std::move(options), store,
                           std::make_shared<ThreadPool>(arguments.threads));
  if (const auto ok = server.listen(); !ok) return answer(ok.error());
  std::string urls;
  for (const std::string& url : server.urls()) urls += url + '\n';
  control->arm(server, store, std::move(*settings));
  int code = exit_ok;
  if (const auto ok = write_stdout(urls); !ok) {
    code = answer(ok.error());
  } else {
    (*manager)->ready("serving " + server.url());
    server.run();
    if (*fetcher) (*fetcher)->end();
    log::info("drained");
  }
  control->disarm();  // a further signal now ends the process
  if (!signals.settle(reload_patience)) {
    log::warn("reload did not finish before shutdown");
    _exit(code);
  }
  return code;
}

}  // namespace

void add_serve(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("serve", "Serve datasets to browsers; prints the URL to open");
  const auto arguments = std::make_shared<ServeArguments>();
  add_serve_options(*command, *arguments);
  command->callback(
      [&chosen, arguments, command] { chosen = [arguments, command] { return serve(*command); }; });
}

}  // namespace windsplat::cli
