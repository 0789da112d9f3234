// windsplat serve: datasets opened in order, then the daemon until SIGTERM or SIGINT; SIGHUP has it
// read its configuration, token and certificate again, and try again what could not be opened.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
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
#include "server/cli/config_file.hpp"
#include "server/cli/open_store.hpp"
#include "server/cli/serve_settings.hpp"
#include "server/cli/signals.hpp"
#include "server/data/resident/store.hpp"
#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"
#include "server/transport/server.hpp"
#include "server/views/saved_views.hpp"

namespace windsplat::cli {
namespace {

// What a running daemon takes over; the rest waits for the next start.
constexpr std::array<std::string_view, 9> live_options{"token-file",   "tls-cert",   "tls-key",
                                                       "allow-origin", "allow-host", "allow-remote",
                                                       "allow-root",   "log-format", "log-level"};

// At the end of the daemon. A disk may never answer.
constexpr std::chrono::seconds reload_patience{1};

void configure_log(const ServeArguments& arguments) {
  log::configure(arguments.log_format == "json" ? log::Format::json : log::Format::text,
                 log::parse_level(arguments.log_level).value_or(log::Level::info));
}

// The signals' side of the daemon. The watching thread needs the server, which does not exist until
// the datasets are open.
class Control {
 public:
  explicit Control(const CLI::App& given) : given_(given) {}

  // What was wanted before there was a server to change is done now.
  void arm(net::Server& server, std::shared_ptr<data::Store> store,
           std::unique_ptr<ServeSettings> started) {
    store_ = std::move(store);
    started_ = std::move(started);
    tls_ = started_->options.tls;
    while (true) {
      {
        const std::lock_guard lock(mutex_);
        if (!reload_wanted_) {
          server_ = &server;
          return;
        }
        reload_wanted_ = false;
      }
      reload_now([&server](net::Access access) { server.change(std::move(access)); });
    }
  }
  void disarm() {
    const std::lock_guard lock(mutex_);
    server_ = nullptr;
  }

  // Before there is anything to drain the program just ends. It waits for no reload.
  void drain() {
    const std::lock_guard lock(mutex_);
    if (server_ == nullptr) _exit(exit_ok);
    log::info("draining");  // before there can be word that it is done
    server_->drain();
  }

  // By one thread. Before there is anything to change it is done when there is.
  void reload() {
    {
      const std::lock_guard lock(mutex_);
      reload_wanted_ = server_ == nullptr;
      if (reload_wanted_) return;
    }
    reload_now([this](net::Access access) {
      const std::lock_guard lock(mutex_);
      if (server_ != nullptr) server_->change(std::move(access));
    });
  }

 private:
  // All of it or nothing, also where memory or threads are short.
  void reload_now(const std::function<void(net::Access)>& change) {
    try {
      take_over(change);
    } catch (const std::exception& fault) {
      log::error("the configuration stays as it was", {{"fault", fault.what()}});
    }
  }

  // Reads for as long as a disk takes: the lock is `change`'s business.
  void take_over(const std::function<void(net::Access)>& change) {
    const auto fresh = read_settings(given_);
    if (!fresh) return refuse(fresh.error());
    const ServeSettings& settings = **fresh;
    // The address stays what it is, so the rule is asked of that one, too.
    const auto exposed = check_exposure(settings.arguments, started_->options.local_hosts_only);
    if (!exposed) return refuse(exposed.error());
    for (const std::string& name : changed_options(started_->command, settings.command)) {
      if (std::find(live_options.begin(), live_options.end(), name) == live_options.end()) {
        log::warn("an option has changed that needs a restart", {{"option", name}});
      }
    }
    const net::ServerOptions& options = settings.options;
    auto tls = tls_;
    if ((tls != nullptr) != (options.tls != nullptr)) {
      log::warn("whether TLS is spoken needs a restart", {{"option", "tls-cert"}});
    } else {
      tls = options.tls;
    }
    warn_of(settings);
    change(
        {options.allow_origins, options.token, tls, options.known_hosts_only, options.allow_hosts});
    tls_ = std::move(tls);
    configure_log(settings.arguments);
    store_->try_failed_again();
    log::info("read the configuration again");
  }

  static void refuse(const Error& error) {
    log::error("the configuration stays as it was", {{"fault", error.message}});
  }

  const CLI::App& given_;
  std::shared_ptr<data::Store> store_;
  std::unique_ptr<ServeSettings> started_;
  std::shared_ptr<net::TlsContext> tls_;  // the newest
  std::mutex mutex_;                      // of the rest, held for moments
  net::Server* server_ = nullptr;
  bool reload_wanted_ = false;
};

// A dataset is refused where a field that is shown at first cannot be loaded at a step: its viewers
// would be told at each frame.
Result<void> check_first_view(const data::Dataset& dataset) {
  return dataset.check_room(scene::fields_of({}, dataset.info()));
}

// One bad file of many does not take the others from their viewers: it is listed as failed. The
// value is the exit code where nothing can be served, that of bad data if any file is, else
// exit_ok.
int open_datasets(const std::vector<std::string>& named, data::Store& store) {
  int code = exit_ok;
  for (const std::string& name : named.empty() ? data::sample_names() : named) {
    const auto dataset = store.add(name);
    if (!dataset) {
      const Error& error = dataset.error();
      code = code == exit_bad_data ? code : exit_code(error.kind);
      log::warn("a dataset cannot be opened", {{"dataset", name}, {"fault", error.message}});
      store.list_failed(name, error);
      continue;
    }
    const data::DatasetInfo& info = (*dataset)->info();
    log::info("opened", {{"dataset", info.id},
                         {"format", info.format},
                         {"samples", info.grid.samples()},
                         {"fields", info.fields.size()},
                         {"steps", info.steps.size()}});
    const std::string beyond = (*dataset)->beyond_limit(scene::fields_of({}, info));
    if (!beyond.empty()) {
      log::warn("the memory limit may be too small for a dataset's first view",
                {{"dataset", info.id}, {"fault", beyond.substr(2)}});
    }
  }
  if (store.all().empty()) return code;
  if (code != exit_ok) {
    log::warn("what cannot be opened is listed as failed", {{"datasets", store.failed().size()}});
  }
  return exit_ok;
}

int serve(const CLI::App& given) {
  const auto control = std::make_shared<Control>(given);
  SignalWatch signals([control] { control->drain(); }, [control] { control->reload(); });
  auto settings = read_settings(given);
  if (!settings) return answer(settings.error());
  const ServeArguments arguments = (*settings)->arguments;
  configure_log(arguments);
  net::ServerOptions options = (*settings)->options;
  warn_of(**settings);

  data::StoreOptions stored = store_options(
      parse_bytes(arguments.memory_limit).value_or(0),
      arguments.storage == "packed16" ? data::Storage::packed16 : data::Storage::float32);
  stored.check = check_first_view;
  const auto store = std::make_shared<data::Store>(std::move(stored));
  if (const int code = open_datasets(arguments.datasets, *store); code != exit_ok) {
    for (const data::Store::Failed& failed : store->failed())
      complain(printable(failed.problem, 2000));
    return code;
  }
  auto views = views::SavedViews::open({arguments.state_dir});
  if (!views) return answer(views.error());
  options.views = std::move(*views);
  net::Server server(std::move(options), store, std::make_shared<ThreadPool>(arguments.threads));
  if (const auto ok = server.listen(); !ok) return answer(ok.error());
  const std::string url = server.url();
  control->arm(server, store, std::move(*settings));
  int code = exit_ok;
  if (const auto ok = write_stdout(url + "\n"); !ok) {
    code = answer(ok.error());
  } else {
    server.run();
    log::info("drained");
  }
  control->disarm();  // from here on a signal ends the program
  if (!signals.settle(reload_patience)) {
    log::warn("a configuration that is still read is waited for no longer");
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
