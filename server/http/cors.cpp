#include "server/http/cors.hpp"

#include <algorithm>
#include <charconv>

namespace windsplat::http {
namespace {

constexpr const char* shared_methods = "GET, HEAD, POST, PUT, PATCH, DELETE";
constexpr const char* accepted_headers =
    "Accept, Authorization, Content-Digest, Content-Encoding, Content-Type, If-Match, "
    "If-None-Match, Repr-Digest, X-Request-Id";
// What answers carry besides the headers that scripts may always read.
constexpr const char* exposed_headers =
    "Accept-Encoding, Accept-Patch, Allow, Content-Disposition, Content-Encoding, Deprecation, "
    "ETag, Link, Location, RateLimit, RateLimit-Policy, Retry-After, Server-Timing, Sunset, "
    "WWW-Authenticate, Windsplat-Frame, Windsplat-Values, X-Request-Id";
// Seconds for which a browser keeps the answer to a preflight. Requests are judged by their own
// Origin, so an origin that is no longer allowed gains nothing by an old answer.
constexpr const char* preflight_lasts_s = "7200";

bool is_alphanumeric(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool is_scheme(std::string_view text) {
  return !text.empty() && !(text[0] >= '0' && text[0] <= '9') && is_alphanumeric(text[0]) &&
         std::all_of(text.begin(), text.end(),
                     [](char c) { return is_alphanumeric(c) || c == '+' || c == '-' || c == '.'; });
}

bool is_origin_port(std::string_view text) {
  constexpr unsigned port_max = 65535;
  unsigned port = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data(), end, port);
  return fault == std::errc() && rest == end && port >= 1 && port <= port_max;
}

// A name, or an IPv6 address in brackets.
bool is_origin_host(std::string_view text) {
  const bool bracketed = text.size() > 2 && text.front() == '[' && text.back() == ']';
  if (bracketed) {
    return text.substr(1, text.size() - 2).find_first_not_of("0123456789abcdefABCDEF:.") ==
           std::string_view::npos;
  }
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return is_alphanumeric(c) || c == '-' || c == '.' || c == '_';
  });
}

// The origin of the page that sends the request if it is one of `allowed`; otherwise empty.
std::string sharing_origin(const Request& request, const std::vector<std::string>& allowed) {
  if (allowed.empty()) return {};
  std::string origin = request.header("Origin");
  const bool listed = std::any_of(allowed.begin(), allowed.end(), [&](const std::string& other) {
    return equal_without_case(origin, other);
  });
  return listed ? origin : std::string();
}

}  // namespace

bool is_origin(std::string_view text) {
  const std::size_t mark = text.find("://");
  if (mark == std::string_view::npos || !is_scheme(text.substr(0, mark))) return false;
  const std::string_view authority = text.substr(mark + 3);
  const std::size_t from = authority.starts_with('[') ? authority.find(']') : 0;
  const std::size_t colon = from == std::string_view::npos ? from : authority.find(':', from);
  if (!is_origin_host(authority.substr(0, colon))) return false;
  return colon == std::string_view::npos || is_origin_port(authority.substr(colon + 1));
}

bool is_preflight(const Request& request, const std::vector<std::string>& allowed) {
  return request.method == "OPTIONS" && !request.header("Access-Control-Request-Method").empty() &&
         !sharing_origin(request, allowed).empty();
}

Response preflight_response() {
  return {204,
          "",
          {{"Access-Control-Allow-Methods", shared_methods},
           {"Access-Control-Allow-Headers", accepted_headers},
           {"Access-Control-Max-Age", preflight_lasts_s}},
          {}};
}

void share_with_origins(Response& response, const Request& request,
                        const std::vector<std::string>& allowed) {
  if (allowed.empty()) return;
  // A cache must not give the answer to a page of one origin to that of another.
  add_vary(response, "Origin");
  const std::string origin = sharing_origin(request, allowed);
  if (origin.empty()) return;
  response.headers.emplace_back("Access-Control-Allow-Origin", origin);
  response.headers.emplace_back("Access-Control-Expose-Headers", exposed_headers);
}

void add_vary(Response& response, std::string_view name) {
  for (auto& [key, value] : response.headers) {
    if (!equal_without_case(key, "Vary")) continue;
    for (const std::string_view part : split_list(value, ',')) {
      if (equal_without_case(part, name)) return;
    }
    value += ", ";
    value += name;
    return;
  }
  response.headers.emplace_back("Vary", name);
}

}  // namespace windsplat::http
