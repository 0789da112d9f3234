#include "server/transport/http/http_gate.hpp"

#include <ctime>
#include <string>
#include <utility>

#include "server/access/auth.hpp"
#include "server/access/login.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::transport {
namespace {

bool is_known_host(const api::ServerOptions& options, const std::string& host) {
  if (!options.local_hosts_only && !options.known_hosts_only) return true;
  return http::local_host_allowed(host, options.allow_origins, options.allow_hosts) ||
         (!options.local_hosts_only && http::is_address(host));
}

}  // namespace

std::optional<http::Response> check_form(const api::ServerOptions& options, http::Request& request,
                                         boost::beast::string_view target, unsigned version) {
  if (auto fault = http::check_request(request, version)) return fault;
  const std::string host = request.header("Host");
  if (!is_known_host(options, host)) {
    return http::problem_response(
        421, "Misdirected Request",
        "unknown host " + printable(host, 80) + "; use --allow-host to allow it");
  }
  if (const auto ok = http::parse_target(target, options.base_path, request); !ok) {
    return http::problem_response(ok.error());
  }
  return std::nullopt;
}

std::optional<http::Response> check_access(const api::ServerOptions& options,
                                           access::Admission& admission,
                                           const http::Request& request, bool health, bool upgrade,
                                           bool secure) {
  const access::Token* const token = options.token.get();
  if (token != nullptr && access::shows_token(request, upgrade)) {
    if (auto over = admission.may_try_login(request.address)) return over;
  }
  const access::Verdict verdict =
      access::judge(request, upgrade, token, options.allow_origins, std::time(nullptr), secure);
  if (verdict == access::Verdict::wrong_token) admission.failed_login(request.address);
  if (verdict != access::Verdict::allowed)
    return access::turned_away(verdict, request, options.base_path, options.embedders);
  if (token != nullptr && !health && !access::needs_no_token(request) &&
      !access::is_login(request)) {
    admission.authenticated(request.address);
  }
  return std::nullopt;
}

std::optional<http::Response> answer_login(const api::ServerOptions& options,
                                           access::Admission& admission,
                                           const http::Request& request, bool secure) {
  if (options.token == nullptr || !access::is_login(request)) return std::nullopt;
  if (auto over = admission.may_try_login(request.address)) return over;
  http::Response answer =
      access::log_in(request, *options.token, options.base_path, secure, std::time(nullptr));
  if (answer.status == 401) admission.failed_login(request.address);
  return answer;
}

}  // namespace windsplat::transport
