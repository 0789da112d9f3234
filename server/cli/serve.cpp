// windsplat serve: datasets opened in order, then the daemon until SIGTERM or SIGINT.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "protocol/limits.hpp"
#include "server/base/log.hpp"
#include "server/base/thread_pool.hpp"
#include "server/cli/command.hpp"
#include "server/cli/listen_address.hpp"
#include "server/cli/signals.hpp"
#include "server/data/store.hpp"
#include "server/net/server.hpp"

namespace windsplat::cli {
namespace {

constexpr int sessions_max = 100000;
constexpr int idle_timeout_s_max = 7 * 24 * 3600;

struct Arguments {
  std::vector<std::string> datasets;
  std::string listen = "127.0.0.1:8080";
  bool allow_remote = false;
  std::string base_path = "/";
  std::string memory_limit = "8G";
  unsigned threads = 0;
  int sessions = protocol::limits::sessions_max_default;
  std::vector<std::string> origins;
  int idle_timeout_s = 300;
  std::string log_format = "text";
};

// The watching thread needs the server, which does not exist until the datasets are open.
class Drain {
 public:
  void arm(net::Server* server) {
    const std::lock_guard lock(mutex_);
    server_ = server;
  }
  // Before there is anything to drain the program just ends.
  void operator()() {
    const std::lock_guard lock(mutex_);
    if (server_ == nullptr) _exit(exit_ok);
    log::info("draining");
    server_->drain();
  }

 private:
  std::mutex mutex_;
  net::Server* server_ = nullptr;
};

Result<void> configure_log(const std::string& format) {
  log::Level level = log::Level::info;
  if (const char* name = std::getenv("WINDSPLAT_LOG_LEVEL"); name != nullptr && *name != '\0') {
    const auto parsed = log::parse_level(name);
    if (!parsed) {
      return make_error(ErrorKind::malformed,
                        "WINDSPLAT_LOG_LEVEL is debug, info, warn, error or "
                        "off, not '" +
                            printable(name) + "'");
    }
    level = *parsed;
  }
  log::configure(format == "json" ? log::Format::json : log::Format::text, level);
  return {};
}

// Letters that need no escape in a URL, in segments between single slashes.
bool is_base_path(const std::string& path) {
  if (path.empty() || path.front() != '/' || path.find("//") != std::string::npos) return false;
  return std::all_of(path.begin(), path.end(), [](unsigned char c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    return letter || c == '/' || c == '-' || c == '_' || c == '.' || c == '~';
  });
}

Result<net::ServerOptions> server_options(const Arguments& arguments) {
  const auto listen = parse_listen_address(arguments.listen);
  if (!listen) return listen.error();
  if (!listen->loopback && !arguments.allow_remote) {
    return make_error(
        ErrorKind::invalid,
        "--listen '" + printable(arguments.listen) +
            "' can be reached from other machines, and nobody who reaches it is asked "
            "who they are; say --allow-remote if that is wanted");
  }
  if (!is_base_path(arguments.base_path)) {
    return make_error(ErrorKind::malformed, "--base-path '" + printable(arguments.base_path) +
                                                "' is not of the form /windsplat/");
  }
  net::ServerOptions options;
  options.address = listen->address;
  options.port = listen->port;
  options.local_hosts_only = listen->loopback;
  options.base_path = arguments.base_path;
  options.sessions_max = arguments.sessions;
  options.idle_timeout_s = arguments.idle_timeout_s;
  options.allow_origins = arguments.origins;
  return options;
}

// All or none: a daemon that serves half of what it was asked to is harder to notice than none.
Result<void> open_datasets(const std::vector<std::string>& named, data::Store& store) {
  for (const std::string& name : named.empty() ? data::sample_names() : named) {
    const auto dataset = store.add(name);
    if (!dataset) return dataset.error();
    const data::DatasetInfo& info = (*dataset)->info();
    log::info("opened", {{"dataset", info.id},
                         {"format", info.format},
                         {"samples", info.grid.samples()},
                         {"fields", info.fields.size()},
                         {"steps", info.steps.size()}});
  }
  return {};
}

int serve(const Arguments& arguments) {
  if (const auto ok = configure_log(arguments.log_format); !ok) return answer(ok.error());
  const auto options = server_options(arguments);
  if (!options) return answer(options.error());
  const auto memory_bytes = parse_bytes(arguments.memory_limit);
  if (!memory_bytes) {
    complain("--memory-limit '" + printable(arguments.memory_limit) +
             "' is not a number of bytes such as 512M or 8G");
    return exit_usage;
  }

  const auto drain = std::make_shared<Drain>();
  const SignalWatch signals([drain] { (*drain)(); });
  const auto store = std::make_shared<data::Store>(*memory_bytes);
  if (const auto ok = open_datasets(arguments.datasets, *store); !ok) return answer(ok.error());
  net::Server server(*options, store, std::make_shared<ThreadPool>(arguments.threads));
  if (const auto ok = server.listen(); !ok) return answer(ok.error());
  drain->arm(&server);
  int code = exit_ok;
  if (const auto ok = write_stdout(server.url() + "\n"); !ok) {
    code = answer(ok.error());
  } else {
    server.run();
    log::info("drained");
  }
  drain->arm(nullptr);  // from here on a signal ends the program
  return code;
}

void add_network_options(CLI::App& command, Arguments& arguments) {
  command.add_option("--listen", arguments.listen, "Where; port 0: any free one")
      ->envname("WINDSPLAT_LISTEN")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  command
      .add_flag("--allow-remote", arguments.allow_remote,
                "Allow an address that other machines reach (needed in a container). Nobody is "
                "asked who they are: put a proxy in front that does")
      ->envname("WINDSPLAT_ALLOW_REMOTE");
  command.add_option("--base-path", arguments.base_path, "Below which path of a proxy's it stands")
      ->envname("WINDSPLAT_BASE_PATH")
      ->type_name("PATH")
      ->capture_default_str();
  command
      .add_option("--allow-origin", arguments.origins,
                  "A further web origin whose pages may connect; may be repeated")
      ->envname("WINDSPLAT_ALLOW_ORIGIN")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("ORIGIN");
  command.add_option("--max-sessions", arguments.sessions, "Viewers at a time")
      ->envname("WINDSPLAT_MAX_SESSIONS")
      ->check(CLI::Range(1, sessions_max))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--idle-timeout", arguments.idle_timeout_s, "Close a silent session after")
      ->envname("WINDSPLAT_IDLE_TIMEOUT")
      ->check(CLI::Range(1, idle_timeout_s_max))
      ->type_name("SECONDS")
      ->capture_default_str();
}

}  // namespace

void add_serve(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("serve", "Serve datasets to browsers; prints the URL to open");
  const auto arguments = std::make_shared<Arguments>();
  command
      ->add_option("datasets", arguments->datasets,
                   "Samples' names or files; none: all built-in samples")
      ->type_name("DATASET");
  add_network_options(*command, *arguments);
  command
      ->add_option("--memory-limit", arguments->memory_limit,
                   "Bytes of data to keep resident, with K, M, G as powers of 1024")
      ->envname("WINDSPLAT_MEMORY_LIMIT")
      ->type_name("BYTES")
      ->capture_default_str();
  add_threads_option(*command, arguments->threads);
  command->add_option("--log-format", arguments->log_format, "Of the log on stderr")
      ->envname("WINDSPLAT_LOG_FORMAT")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  command->footer("Environment: WINDSPLAT_LOG_LEVEL is debug, info, warn, error or off.");
  command->callback([&chosen, arguments] { chosen = [arguments] { return serve(*arguments); }; });
}

}  // namespace windsplat::cli
