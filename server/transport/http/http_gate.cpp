#include "server/transport/http/http_gate.hpp"

#include <ctime>
#include <string>
#include <utility>

#include "server/access/auth.hpp"
#include "server/access/login.hpp"
#include "server/api/router.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::net {
namespace {

bool is_known_host(const ServerOptions& options, const std::string& host) {
  if (!options.local_hosts_only && !options.known_hosts_only) return true;
  return local_host_allowed(host, options.allow_origins, options.allow_hosts) ||
         (!options.local_hosts_only && is_address(host));
}

}  // namespace

std::optional<Response> check_form(const ServerOptions& options, Request& request,
                                   boost::beast::string_view target, unsigned version) {
  if (auto fault = check_request(request, version)) return fault;
  const std::string host = request.header("Host");
  if (!is_known_host(options, host)) {
    return problem_response(
        421, "Misdirected Request",
        "unknown host " + printable(host, 80) + "; use --allow-host to allow it");
  }
  if (const auto ok = parse_target(target, options.base_path, request); !ok) {
    return problem_response(ok.error());
  }
  return std::nullopt;
}

std::optional<Response> check_access(const ServerOptions& options, Admission& admission,
                                     const Request& request, bool upgrade, bool secure) {
  const Token* const token = options.token.get();
  if (token != nullptr && shows_token(request, upgrade)) {
    if (auto over = admission.may_try_login(request.address)) return over;
  }
  const Verdict verdict =
      judge(request, upgrade, token, options.allow_origins, std::time(nullptr), secure);
  if (verdict == Verdict::wrong_token) admission.failed_login(request.address);
  if (verdict != Verdict::allowed) return turned_away(verdict, request, options.base_path);
  if (token != nullptr && !names_health(request) && !is_login(request)) {
    admission.authenticated(request.address);
  }
  return std::nullopt;
}

std::optional<Response> answer_login(const ServerOptions& options, Admission& admission,
                                     const Request& request, bool secure) {
  if (options.token == nullptr || !is_login(request)) return std::nullopt;
  if (auto over = admission.may_try_login(request.address)) return over;
  Response answer = log_in(request, *options.token, options.base_path, secure, std::time(nullptr));
  if (answer.status == 401) admission.failed_login(request.address);
  return answer;
}

}  // namespace windsplat::net
