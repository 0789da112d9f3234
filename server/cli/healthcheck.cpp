// windsplat healthcheck: queries whether a running daemon is ready.
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "server/base/elapsed.hpp"
#include "server/cli/command.hpp"
#include "server/cli/settings_file.hpp"
#include "server/transport/http_client.hpp"
#include "server/transport/server.hpp"
#include "server/transport/unix_socket.hpp"

namespace windsplat::cli {
namespace {

constexpr int timeout_s = 5;
constexpr int http_ok = 200;

int healthcheck(std::string url, const std::string& ca_file) {
  std::string ca;
  if (!ca_file.empty()) {
    auto text = read_settings_file(ca_file, transport::pem_bytes_max);
    if (!text) return answer(text.error());
    ca = std::move(*text);
  }
  constexpr std::string_view unix_prefix = "unix:";
  if (url.starts_with(unix_prefix)) url = transport::unix_url(url.substr(unix_prefix.size()), "/");
  if (url.empty() || url.back() != '/') url += '/';
  url += "readyz";
  const auto start = std::chrono::steady_clock::now();
  const auto status = transport::http_status(url, timeout_s, ca);
  if (!status) return answer(status.error());
  if (*status == http_ok) {
    detail(printable(url) + " is ready: answered in " + seconds_text(seconds_since(start)));
    return exit_ok;
  }
  complain(printable(url) + " returned status " + std::to_string(*status));
  return exit_failed;
}

}  // namespace

void add_healthcheck(CLI::App& app, Action& chosen) {
  CLI::App* command =
      app.add_subcommand("healthcheck", "Exit 0 if a daemon is ready to serve, 1 if not");
  const auto url = std::make_shared<std::string>("http://127.0.0.1:8080/");
  command
      ->add_option("url", *url,
                   "Base URL of the daemon, or unix: and the path of its "
                   "socket")
      ->envname("WINDSPLAT_URL")
      ->type_name("URL")
      ->capture_default_str();
  const auto ca = std::make_shared<std::string>();
  command
      ->add_option(
          "--ca", *ca,
          "For https: trust these certificates (PEM), the daemon's or its issuer's, instead "
          "of the system's")
      ->envname("WINDSPLAT_CA")
      ->type_name("FILE");
  add_verbosity_options(*command);
  command->callback([&chosen, url, ca] { chosen = [url, ca] { return healthcheck(*url, *ca); }; });
}

}  // namespace windsplat::cli
