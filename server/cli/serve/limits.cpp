// Options and environment variables that limit the usage per address and in total.
#include "server/cli/serve/limits.hpp"

#include <sstream>
#include <string>

#include "protocol/limits.hpp"
#include "server/access/address.hpp"
#include "server/access/identity.hpp"

namespace windsplat::cli {
namespace {

constexpr std::size_t count_max = 1'000'000;
constexpr double number_max = 1e18;

template <class Number>
CLI::Validator up_to(Number most) {
  return CLI::Validator(
      [most](const std::string& text) {
        if (CLI::Range(Number{0}, most)(text).empty()) return std::string();
        std::ostringstream words;
        words << "must be a number from 0 (no limit) to " << most << ", not '" << text << "'";
        return words.str();
      },
      "");
}

template <class Number>
void add(CLI::App& command, const char* flag, const char* environment, Number& value, Number most,
         const char* help, const char* unit) {
  command.add_option(flag, value, help)
      ->envname(environment)
      ->check(up_to(most))
      ->type_name(unit)
      ->capture_default_str()
      ->group("Limits (0: none)");
}

std::string fault_of_proxy(const std::string& text) {
  if (access::Network::parse(text)) return "";
  return "must be an address or a network such as 172.17.0.0/16, not '" + text + "'";
}

std::string fault_of_header(const std::string& text) {
  if (access::is_field_name(text)) return "";
  return "must be the name of a header such as X-Forwarded-User, not '" + text + "'";
}

}  // namespace

void add_limit_options(CLI::App& command, access::Limits& limits) {
  add(command, "--max-connections", "WINDSPLAT_MAX_CONNECTIONS", limits.connections, count_max,
      "Concurrent connections, including streams", "N");
  add(command, "--max-connections-per-address", "WINDSPLAT_MAX_CONNECTIONS_PER_ADDRESS",
      limits.connections_per_address, count_max,
      "Concurrent connections per address (IPv6: per /64)", "N");
  add(command, "--max-arrivals", "WINDSPLAT_MAX_ARRIVALS", limits.arrivals, number_max,
      "New connections per second; a TLS connection counts as 5", "N");
  add(command, "--max-arrivals-per-address", "WINDSPLAT_MAX_ARRIVALS_PER_ADDRESS",
      limits.arrivals_per_address, number_max, "New connections per second per address", "N");
  add(command, "--max-handshakes", "WINDSPLAT_MAX_HANDSHAKES", limits.handshake_ms, number_max,
      "CPU time per second of TLS handshakes from addresses without a recent valid token; the "
      "same again for those with one. 127.0.0.1 and ::1 have only the limit per address",
      "MS");
  add(command, "--max-handshakes-per-address", "WINDSPLAT_MAX_HANDSHAKES_PER_ADDRESS",
      limits.handshake_ms_per_address, number_max,
      "CPU time per second of TLS handshakes per address", "MS");
  add(command, "--max-sessions-per-address", "WINDSPLAT_MAX_SESSIONS_PER_ADDRESS",
      limits.sessions_per_address, count_max, "Concurrent sessions per address", "N");
  add(command, "--max-requests-per-address", "WINDSPLAT_MAX_REQUESTS_PER_ADDRESS",
      limits.requests_per_address, number_max, "Requests per second per address", "N");
  add(command, "--max-messages-per-address", "WINDSPLAT_MAX_MESSAGES_PER_ADDRESS",
      limits.messages_per_address, number_max, "Stream messages per second per address", "N");
  add(command, "--max-received-per-address", "WINDSPLAT_MAX_RECEIVED_PER_ADDRESS",
      limits.received_per_address, number_max, "Bytes of stream messages per second per address",
      "BYTES");
  add(command, "--max-bytes-per-address", "WINDSPLAT_MAX_BYTES_PER_ADDRESS",
      limits.bytes_per_address, number_max, "Bytes sent per second per address", "BYTES");
  add(command, "--max-render-per-address", "WINDSPLAT_MAX_RENDER_PER_ADDRESS",
      limits.render_s_per_address, number_max, "Rendering time per minute per address", "SECONDS");
  add(command, "--max-failed-logins-per-address", "WINDSPLAT_MAX_FAILED_LOGINS_PER_ADDRESS",
      limits.failed_logins_per_address, number_max, "Failed logins per minute per address", "N");
  add(command, "--max-pixels", "WINDSPLAT_MAX_PIXELS", limits.pixels,
      protocol::limits::image_pixels_max, "Pixels per picture", "N");
  add(command, "--max-kernels", "WINDSPLAT_MAX_KERNELS", limits.kernels, number_max,
      "Estimated cost of a picture: lines, samples and the pixels they cover (16 count as 1)", "N");
  add(command, "--max-render", "WINDSPLAT_MAX_RENDER", limits.render_s, number_max,
      "Estimated rendering time of a picture requested over HTTP", "SECONDS");
  add(command, "--max-wait", "WINDSPLAT_MAX_WAIT", limits.wait_ms, number_max,
      "Reject an HTTP request for a picture that would wait for other addresses longer than this "
      "and longer than its own rendering time",
      "MS");
  command
      .add_option("--trusted-proxy", limits.trusted_proxies,
                  "Address or network of a proxy whose X-Forwarded-For header is trusted, or "
                  "unix: all that connect to a UNIX socket; may be repeated")
      ->envname("WINDSPLAT_TRUSTED_PROXY")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->check(fault_of_proxy)
      ->type_name("ADDRESS|unix");
  command
      .add_option("--identity-header", limits.identity_header,
                  "Header in which a trusted proxy names the user it has authenticated, such as "
                  "X-Forwarded-User: limits count for users, and the log names them")
      ->envname("WINDSPLAT_IDENTITY_HEADER")
      ->check(fault_of_header)
      ->type_name("NAME");
}

}  // namespace windsplat::cli
