// Options may also come from the environment or the file of --config (config_file.hpp), so every
// numeric option declares its range here.
#include "server/cli/serve/options.hpp"

#include "server/cli/command.hpp"
#include "server/cli/serve/limits.hpp"

namespace windsplat::cli {
namespace {

constexpr int sessions_max = 100000;
constexpr int idle_timeout_s_max = 7 * 24 * 3600;

void add_network_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("--listen", arguments.listen,
                  "Address or name and port, or unix: and the path of a socket; port 0: any free "
                  "port; may be repeated")
      ->envname("WINDSPLAT_LISTEN")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("HOST:PORT|unix:PATH")
      ->default_str("127.0.0.1:8080");
  command.add_option("--listen-mode", arguments.listen_mode, "Mode of the file of UNIX sockets")
      ->envname("WINDSPLAT_LISTEN_MODE")
      ->type_name("OCTAL")
      ->capture_default_str();
  command
      .add_flag("--allow-remote", arguments.allow_remote,
                "Allow an address reachable from other machines without a token. Clients are not "
                "authenticated: use an authenticating proxy")
      ->envname("WINDSPLAT_ALLOW_REMOTE");
  command
      .add_flag(
          "--allow-root", arguments.allow_root,
          "Allow an address reachable from other machines when running as root. Root is needed "
          "only to read files restricted to root")
      ->envname("WINDSPLAT_ALLOW_ROOT");
  command
      .add_option("--base-path", arguments.base_path,
                  "Path below which a proxy forwards to the server")
      ->envname("WINDSPLAT_BASE_PATH")
      ->type_name("PATH")
      ->capture_default_str();
  command
      .add_option("--allow-origin", arguments.origins,
                  "Additional web origin whose pages may connect and whose scripts may read "
                  "answers (CORS); may be repeated")
      ->envname("WINDSPLAT_ALLOW_ORIGIN")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("ORIGIN");
  command
      .add_option(
          "--allow-host", arguments.hosts,
          "Additional name accepted in Host. Without a token: loopback names, "
          "numeric addresses and the hosts of --allow-origin; with a token: all, unless this "
          "is given. May be repeated")
      ->envname("WINDSPLAT_ALLOW_HOST")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("NAME");
  command
      .add_option("--allow-embed,--frame-ancestors", arguments.embedders,
                  "Web origin whose pages may show the embedded view (?embed) in a frame, such as "
                  "https://site.example; may be repeated")
      ->envname("WINDSPLAT_ALLOW_EMBED")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("ORIGIN");
  command.add_option("--max-sessions", arguments.sessions, "Concurrent sessions")
      ->envname("WINDSPLAT_MAX_SESSIONS")
      ->check(CLI::Range(1, sessions_max))
      ->type_name("N")
      ->capture_default_str();
  command.add_option("--idle-timeout", arguments.idle_timeout_s, "Close an inactive session after")
      ->envname("WINDSPLAT_IDLE_TIMEOUT")
      ->check(CLI::Range(1, idle_timeout_s_max))
      ->type_name("SECONDS")
      ->capture_default_str();
}

void add_access_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("--token-file", arguments.token_file,
                  "Require the token in this file: one line of 16 to 512 letters, "
                  "digits and -._~+/. Read again on SIGHUP")
      ->envname("WINDSPLAT_TOKEN_FILE")
      ->type_name("FILE");
  command
      .add_option("--tls-cert", arguments.tls_cert,
                  "Use TLS with this certificate and its chain (PEM). Read again on SIGHUP")
      ->envname("WINDSPLAT_TLS_CERT")
      ->type_name("FILE");
  command.add_option("--tls-key", arguments.tls_key, "Private key of the certificate (PEM)")
      ->envname("WINDSPLAT_TLS_KEY")
      ->type_name("FILE");
}

void add_data_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("--data-root", arguments.data_root,
                  "Let clients list and open the files below this folder")
      ->envname("WINDSPLAT_DATA_ROOT")
      ->type_name("DIR");
  command
      .add_flag("--fixed-entries", arguments.fixed_entries,
                "Serve only the members, reference times or bands named here; without it, clients "
                "may choose others of the same files")
      ->envname("WINDSPLAT_FIXED_ENTRIES");
  command
      .add_option("--state-dir", arguments.state_dir,
                  "Store saved views in this folder; default: in memory only")
      ->envname("WINDSPLAT_STATE_DIR")
      ->type_name("DIR");
  command
      .add_option(
          "--upload-limit", arguments.upload_limit,
          "Let clients upload files, of so many bytes in all, which are kept in --state-dir "
          "for a limited time; 0: none. K, M, G, T as for --memory-limit")
      ->envname("WINDSPLAT_UPLOAD_LIMIT")
      ->type_name("BYTES")
      ->capture_default_str();
  command
      .add_flag(
          "--strict", arguments.strict,
          "Do not start if one of the datasets cannot be opened; without it, such a dataset is "
          "listed as failed")
      ->envname("WINDSPLAT_STRICT");
  add_memory_option(command, arguments.memory_limit);
  command
      .add_option(
          "--storage", arguments.storage,
          "Precision of resident data; packed16 errs by at most 1/131068 of a field's range")
      ->envname("WINDSPLAT_STORAGE")
      ->check(CLI::IsMember({"float32", "packed16"}))
      ->capture_default_str();
}

}  // namespace

void add_serve_options(CLI::App& command, ServeArguments& arguments) {
  command
      .add_option("datasets", arguments.datasets,
                  "Names of samples, or files; default: all built-in samples")
      ->type_name("DATASET");
  command
      .add_option("--config", arguments.config,
                  "JSON file of these options, without leading dashes. The command line and the "
                  "environment take precedence. Read again on SIGHUP")
      ->envname("WINDSPLAT_CONFIG")
      ->type_name("FILE");
  add_network_options(command, arguments);
  add_access_options(command, arguments);
  add_limit_options(command, arguments.limits);
  add_data_options(command, arguments);
  add_data_host_options(command, arguments.data_hosts);
  add_threads_option(command, arguments.threads);
  command.add_option("--log-format", arguments.log_format, "Format of the log on stderr")
      ->envname("WINDSPLAT_LOG_FORMAT")
      ->check(CLI::IsMember({"text", "json"}))
      ->capture_default_str();
  CLI::Option* level =
      command.add_option("--log-level", arguments.log_level, "Lowest level that is logged")
          ->envname("WINDSPLAT_LOG_LEVEL")
          ->check(CLI::IsMember({"debug", "info", "warn", "error", "off"}))
          ->capture_default_str();
  // As other options they have precedence over the environment, which is read after them.
  const auto [quiet, verbose] = add_verbosity_flags(
      command,
      {"Log warnings and errors only, as --log-level warn", "Log all, as --log-level debug"},
      [&arguments, level](Verbosity wanted) {
        arguments.verbosity_level = wanted == Verbosity::quiet ? "warn" : "debug";
        level->envname("");
      });
  for (CLI::Option* const flag : {quiet, verbose}) flag->trigger_on_parse()->excludes(level);
}

}  // namespace windsplat::cli
