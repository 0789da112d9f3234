// Every option may also come from the environment or the file of --config (config_file.hpp), so
// each number has its range here.
#include "server/cli/serve_options.hpp"

#include "server/cli/command.hpp"
#include "server/cli/serve_limits.hpp"

namespace windsplat::cli {
namespace {

constexpr int sessions_max = 100000;
constexpr int idle_timeout_s_max = 7 * 24 * 3600;

void add_network_options(CLI::App& command, ServeArguments& arguments) {
  command.add_option("--listen", arguments.listen, "Where; port 0: any free one")
      ->envname("WINDSPLAT_LISTEN")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  command
      .add_flag("--allow-remote", arguments.allow_remote,
                "Without a token, too, allow an address that other machines reach. Nobody is asked "
                "who they are: put a proxy in front that does")
      ->envname("WINDSPLAT_ALLOW_REMOTE");
  command
      .add_flag("--allow-root", arguments.allow_root,
                "As root, too, allow an address that other machines reach. It needs none of root's "
                "rights but to read files that only root may")
      ->envname("WINDSPLAT_ALLOW_ROOT");
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
  command
      .add_option(
          "--allow-host", arguments.hosts,
          "A further name that Host may have. Without a token those are loopback names, "
          "numeric addresses and the hosts of --allow-origin; with a token all, unless this "
          "is given. May be repeated")
      ->envname("WINDSPLAT_ALLOW_HOST")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("NAME");
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

void add_access_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("--token-file", arguments.token_file,
                  "Let in only who shows the token in this file: one line of 16 to 512 letters, "
                  "digits and -._~+/. Read again on SIGHUP")
      ->envname("WINDSPLAT_TOKEN_FILE")
      ->type_name("FILE");
  command
      .add_option("--tls-cert", arguments.tls_cert,
                  "Speak TLS with this certificate and its chain (PEM). Read again on SIGHUP")
      ->envname("WINDSPLAT_TLS_CERT")
      ->type_name("FILE");
  command.add_option("--tls-key", arguments.tls_key, "The certificate's private key (PEM)")
      ->envname("WINDSPLAT_TLS_KEY")
      ->type_name("FILE");
}

void add_data_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("--data-root", arguments.data_root,
                  "Let clients open files below this folder by POST /v1/datasets")
      ->envname("WINDSPLAT_DATA_ROOT")
      ->type_name("DIR");
  command
      .add_option("--state-dir", arguments.state_dir,
                  "Keep saved views in this folder; without it they last as long as the daemon")
      ->envname("WINDSPLAT_STATE_DIR")
      ->type_name("DIR");
  add_memory_option(command, arguments.memory_limit);
  command
      .add_option("--storage", arguments.storage,
                  "Of resident data: 16 bits a value err by at most 1/131068 of a field's width")
      ->envname("WINDSPLAT_STORAGE")
      ->check(CLI::IsMember({"float32", "packed16"}))
      ->capture_default_str();
}

}  // namespace

void add_serve_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("datasets", arguments.datasets,
                  "Samples' names or files; none: all built-in samples")
      ->type_name("DATASET");
  command
      .add_option("--config", arguments.config,
                  "JSON with these options, named without dashes. What stands on the command line "
                  "or in the environment wins. Read again on SIGHUP")
      ->envname("WINDSPLAT_CONFIG")
      ->type_name("FILE");
  add_network_options(command, arguments);
  add_access_options(command, arguments);
  add_limit_options(command, arguments.limits);
  add_data_options(command, arguments);
  add_threads_option(command, arguments.threads);
  command.add_option("--log-format", arguments.log_format, "Of the log on stderr")
      ->envname("WINDSPLAT_LOG_FORMAT")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  command.add_option("--log-level", arguments.log_level, "What the log leaves out")
      ->envname("WINDSPLAT_LOG_LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
}

}  // namespace windsplat::cli
