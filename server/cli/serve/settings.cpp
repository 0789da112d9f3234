// Validates settings before anything is opened or changed.
#include "server/cli/serve/settings.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include "server/base/log.hpp"
#include "server/cli/command.hpp"
#include "server/cli/open_store.hpp"
#include "server/cli/serve/config_file.hpp"
#include "server/cli/serve/listen_address.hpp"
#include "server/cli/settings_file.hpp"
#include "server/http/cors.hpp"
#include "server/http/framing.hpp"

namespace windsplat::cli {
namespace {

constexpr std::size_t token_file_bytes_max = 1024;

// Characters that need no escape in a URL, in segments between single slashes.
bool is_base_path(const std::string& path) {
  if (path.empty() || path.front() != '/' || path.find("//") != std::string::npos) return false;
  return std::all_of(path.begin(), path.end(), [](unsigned char c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    return letter || c == '/' || c == '-' || c == '_' || c == '.' || c == '~';
  });
}

// Absolute path with links resolved now: later changes of links have no effect.
Result<std::string> plain_folder(const std::string& folder) {
  if (folder.empty()) return std::string();
  std::error_code fault;
  const std::filesystem::path plain = std::filesystem::canonical(folder, fault);
  if (fault || !std::filesystem::is_directory(plain, fault)) {
    return make_error(ErrorKind::invalid,
                      "--data-root '" + printable(folder) + "' is not an accessible folder");
  }
  return plain.native();
}

bool others_read(const std::string& path) {
  struct stat facts {};
  constexpr mode_t others = S_IRGRP | S_IROTH;
  return ::stat(path.c_str(), &facts) == 0 && (facts.st_mode & others) != 0;
}

Error of_file(const char* option, const std::string& path, Error error) {
  error.message = std::string(option) + " '" + printable(path) + "': " + error.message;
  return error;
}

Result<std::shared_ptr<const access::Token>> read_token(const std::string& path) {
  if (path.empty()) return std::shared_ptr<const access::Token>();
  auto text = read_settings_file(path, token_file_bytes_max);
  if (!text) return of_file("--token-file", path, text.error());
  auto token = access::Token::parse(*text);
  access::wipe(*text);
  if (!token) return of_file("--token-file", path, token.error());
  return std::make_shared<const access::Token>(*token);
}

Result<std::shared_ptr<transport::TlsContext>> read_tls(const ServeArguments& arguments) {
  if (arguments.tls_cert.empty() && arguments.tls_key.empty()) {
    return std::shared_ptr<transport::TlsContext>();
  }
  if (arguments.tls_cert.empty() || arguments.tls_key.empty()) {
    return make_error(ErrorKind::invalid, "--tls-cert and --tls-key must be given together");
  }
  const auto chain = read_settings_file(arguments.tls_cert, transport::pem_bytes_max);
  if (!chain) return of_file("--tls-cert", arguments.tls_cert, chain.error());
  auto key = read_settings_file(arguments.tls_key, transport::pem_bytes_max);
  if (!key) return of_file("--tls-key", arguments.tls_key, key.error());
  auto tls = transport::make_tls(*chain, *key);
  access::wipe(*key);
  if (!tls) {
    return of_file("--tls-cert and --tls-key", arguments.tls_cert + "', '" + arguments.tls_key,
                   tls.error());
  }
  return tls;
}

// A core dump would contain the secrets. The limit is 1 instead of 0, because with 0 the kernel
// still passes a dump to a collecting program (core(5)).
Result<void> forbid_dumps() {
  const rlimit one{1, 1};
  rlimit now{};
  if (::getrlimit(RLIMIT_CORE, &now) == 0 && now.rlim_cur <= 1 && now.rlim_max <= 1) return {};
  if (::setrlimit(RLIMIT_CORE, &one) == 0) return {};
  return make_error(ErrorKind::internal,
                    "cannot disable core dumps, which would contain secrets: " +
                        std::generic_category().message(errno));
}

bool is_host_name(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    return letter || c == '-' || c == '.' || c == '_';
  });
}

Result<void> check_host_names(const std::vector<std::string>& names) {
  const auto bad = std::find_if_not(names.begin(), names.end(), is_host_name);
  if (bad == names.end()) return {};
  return make_error(ErrorKind::malformed, "--allow-host '" + printable(*bad) +
                                              "' is not a host name such as winds.example");
}

Result<void> check_embedders(const std::vector<std::string>& origins) {
  const auto bad = std::find_if_not(origins.begin(), origins.end(), http::is_embedder);
  if (bad == origins.end()) return {};
  return make_error(ErrorKind::malformed, "--allow-embed '" + printable(*bad) +
                                              "' is not an origin such as https://site.example");
}

Result<void> check_origins(const std::vector<std::string>& origins) {
  const auto bad = std::find_if_not(origins.begin(), origins.end(),
                                    [](const auto& text) { return http::is_origin(text); });
  if (bad == origins.end()) return {};
  return make_error(ErrorKind::malformed,
                    "--allow-origin '" + printable(*bad) +
                        "' is not an origin such as https://site.example (scheme, host and port "
                        "without a path; no wildcard)");
}

// Whether a folder, which need not exist yet, is `root` or lies below it; false without a root.
bool lies_below(const std::filesystem::path& folder, const std::filesystem::path& root) {
  if (root.empty()) return false;
  std::error_code fault;
  // A relative path of which nothing exists would stay relative.
  const auto inner = std::filesystem::weakly_canonical(std::filesystem::absolute(folder), fault);
  const auto outer = std::filesystem::weakly_canonical(std::filesystem::absolute(root), fault);
  return std::mismatch(outer.begin(), outer.end(), inner.begin(), inner.end()).first == outer.end();
}

Result<api::ServerOptions> server_options(const ServeArguments& arguments) {
  auto listen = listen_places(arguments.listen, arguments.listen_mode);
  if (!listen) return listen.error();
  if (const auto ok = check_exposure(arguments, listen->loopback); !ok) return ok.error();
  if (const auto ok = check_host_names(arguments.hosts); !ok) return ok.error();
  if (const auto ok = check_origins(arguments.origins); !ok) return ok.error();
  if (const auto ok = check_embedders(arguments.embedders); !ok) return ok.error();
  if (!arguments.limits.identity_header.empty() && arguments.limits.trusted_proxies.empty()) {
    return make_error(ErrorKind::malformed,
                      "--identity-header needs --trusted-proxy: others could name any user");
  }
  if (!is_base_path(arguments.base_path)) {
    return make_error(ErrorKind::malformed, "--base-path '" + printable(arguments.base_path) +
                                                "' is not of the form /windsplat/");
  }
  const auto limit = memory_limit(arguments.memory_limit);
  if (!limit) return limit.error();
  const auto uploads = upload_bytes(arguments);
  if (!uploads) return uploads.error();
  auto data_root = plain_folder(arguments.data_root);
  if (!data_root) return data_root.error();
  if (*uploads > 0 && lies_below(arguments.state_dir, *data_root)) {
    return make_error(ErrorKind::invalid,
                      "--state-dir '" + printable(arguments.state_dir) +
                          "' lies below --data-root: uploads would be listed for everybody");
  }
  if (!arguments.data_hosts.hosts.empty()) {
    if (const auto hosts = fetch_options(arguments.data_hosts); !hosts) return hosts.error();
  }
  auto token = read_token(arguments.token_file);
  if (!token) return token.error();
  auto tls = read_tls(arguments);
  if (!tls) return tls.error();
  if (*token != nullptr || *tls != nullptr) {
    if (const auto ok = forbid_dumps(); !ok) return ok.error();
  }
  api::ServerOptions options;
  options.token = std::move(*token);
  options.tls = std::move(*tls);
  options.data_root = std::move(*data_root);
  options.fixed_entries = arguments.fixed_entries;
  options.listen = std::move(listen->places);
  options.local_hosts_only = listen->loopback;
  // Without a token, a page whose name was rebound to this machine could connect.
  options.known_hosts_only = options.token == nullptr || !arguments.hosts.empty();
  options.allow_hosts = arguments.hosts;
  options.base_path = arguments.base_path;
  options.sessions_max = arguments.sessions;
  options.idle_timeout_s = arguments.idle_timeout_s;
  options.ground_bytes = ground_bytes_of(*limit);
  options.limits = arguments.limits;
  options.allow_origins = arguments.origins;
  options.embedders = arguments.embedders;
  return options;
}

std::string listen_text(const ServeArguments& arguments) {
  std::string text;
  for (const std::string& place : arguments.listen) text += (text.empty() ? "" : ",") + place;
  return text;
}

}  // namespace

Result<std::uint64_t> upload_bytes(const ServeArguments& arguments) {
  const std::string& text = arguments.upload_limit;
  if (text == "0") return std::uint64_t{0};
  const auto bytes = parse_bytes(text);
  if (!bytes) {
    return make_error(ErrorKind::malformed, "--upload-limit '" + printable(text) +
                                                "' is not a number of bytes such as 10G");
  }
  if (arguments.state_dir.empty()) {
    return make_error(ErrorKind::invalid,
                      "--upload-limit needs --state-dir, below which uploads are kept");
  }
  constexpr std::uint64_t least = 8192;  // an address may have half, and an upload takes 4 KiB
  if (*bytes < least) {
    return make_error(ErrorKind::invalid,
                      "--upload-limit '" + printable(text) + "' is less than 8K, and not 0");
  }
  return *bytes;
}

Result<void> check_exposure(const ServeArguments& arguments, bool loopback) {
  if (loopback) return {};
  const std::string reached =
      "--listen '" + printable(listen_text(arguments)) + "' is reachable from other machines, and ";
  if (!arguments.allow_remote && arguments.token_file.empty()) {
    return make_error(ErrorKind::invalid, reached +
                                              "clients are not authenticated: use --token-file, or "
                                              "--allow-remote if this is intended");
  }
  if (::geteuid() == 0 && !arguments.allow_root) {
    return make_error(ErrorKind::invalid,
                      reached +
                          "this process runs as root: start it as another user (as "
                          "deploy/windsplat.service and the Dockerfile do), or use --allow-root if "
                          "this is intended");
  }
  return {};
}

void warn_of(const ServeSettings& settings) {
  const ServeArguments& arguments = settings.arguments;
  const api::ServerOptions& options = settings.options;
  for (const std::string* secret : {&arguments.token_file, &arguments.tls_key}) {
    if (!secret->empty() && others_read(*secret)) {
      log::warn("a secret is readable by other users", {{"file", *secret}});
    }
  }
  if (options.tls != nullptr && transport::certificate_ends(*options.tls) < std::time(nullptr)) {
    log::warn("the certificate has expired", {{"file", arguments.tls_cert}});
  }
  const std::string expensive =
      options.tls != nullptr ? transport::expensive_handshakes(*options.tls) : "";
  if (!expensive.empty()) {
    log::warn("TLS handshakes are expensive", {{"file", arguments.tls_cert}, {"fault", expensive}});
  }
  if (options.token != nullptr && !options.embedders.empty()) {
    log::warn("frames of other sites get no picture: browsers keep the login out of them",
              {{"allow-embed", options.embedders.front()}});
  }
  if (!options.local_hosts_only && options.token != nullptr && options.tls == nullptr) {
    log::warn("the token is sent unencrypted: use --tls-cert or a proxy with TLS",
              {{"listen", listen_text(arguments)}});
  }
}

Result<std::unique_ptr<ServeSettings>> read_settings(const CLI::App& given,
                                                     const ServiceManager& manager) {
  auto settings = std::make_unique<ServeSettings>();
  add_serve_options(settings->command, settings->arguments);
  give_again(given, settings->command);
  if (const std::string& path = settings->arguments.config; !path.empty()) {
    if (const auto ok = apply_config(settings->command, path); !ok) return ok.error();
  }
  if (manager.socket()) settings->arguments.listen = {manager.socket()->address};
  auto options = server_options(settings->arguments);
  if (!options) return options.error();
  if (manager.socket()) options->listen.front().socket = manager.socket()->descriptor;
  settings->options = std::move(*options);
  return settings;
}

}  // namespace windsplat::cli
