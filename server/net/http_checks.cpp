// Refusals that keep requests unambiguous (RFC 9112): one Host, one length, no other framing.
#include "server/net/http_checks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

#include "protocol/limits.hpp"
#include "server/base/error.hpp"
#include "server/net/problem.hpp"

namespace windsplat::net {
namespace {

constexpr std::array<std::string_view, 7> known_methods{"GET",   "HEAD",   "POST",   "PUT",
                                                        "PATCH", "DELETE", "OPTIONS"};

Response bad_request(std::string detail) {
  return problem_response(400, "Bad Request", std::move(detail));
}

std::size_t count(const Request& request, std::string_view name) {
  return static_cast<std::size_t>(
      std::count_if(request.headers.begin(), request.headers.end(),
                    [&](const auto& field) { return equal_without_case(field.first, name); }));
}

std::optional<Response> check_length(const Request& request) {
  if (count(request, "Content-Length") > 1) return bad_request("there are two Content-Lengths");
  const std::string text = request.header("Content-Length");
  if (text.empty()) {
    if (request.method == "POST") {
      return problem_response(411, "Length Required", "a body needs its Content-Length");
    }
    return std::nullopt;
  }
  std::uint64_t length = 0;
  const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (stop != text.data() + text.size() || fault == std::errc::invalid_argument) {
    return bad_request("Content-Length is not a number");
  }
  if (fault != std::errc() || length > protocol::limits::http_body_bytes_max) {
    return body_too_large();
  }
  return std::nullopt;
}

}  // namespace

Response body_too_large() {
  return problem_response(make_error(
      ErrorKind::too_large,
      "a body may have " + std::to_string(protocol::limits::http_body_bytes_max) + " bytes"));
}

std::optional<Response> check_header_bytes(std::string_view header) {
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (header[i] != '\n' && header[i] != '\r') continue;
    const bool pair = header[i] == '\r' && i + 1 < header.size() && header[i + 1] == '\n';
    if (!pair) return bad_request("a line of the header ends with a bare CR or LF");
    const char next = i + 2 < header.size() ? header[i + 2] : 'x';
    if (next == ' ' || next == '\t') return bad_request("a line of the header is folded");
    ++i;
  }
  return std::nullopt;
}

std::optional<Response> check_request(const Request& request, unsigned version) {
  if (version != 11 && version != 10) {
    return problem_response(505, "HTTP Version Not Supported",
                            "this server speaks HTTP/1.1 and HTTP/1.0");
  }
  if (count(request, "Transfer-Encoding") > 0) {
    return problem_response(501, "Not Implemented",
                            "a body is sent by Content-Length, not by Transfer-Encoding");
  }
  if (count(request, "Host") != 1) return bad_request("a request has exactly one Host");
  if (std::find(known_methods.begin(), known_methods.end(), request.method) ==
      known_methods.end()) {
    return problem_response(501, "Not Implemented",
                            "the method " + printable(request.method, 20) + " is unknown");
  }
  if (const std::string expect = request.header("Expect");
      !expect.empty() && !equal_without_case(expect, "100-continue")) {
    return problem_response(417, "Expectation Failed", "only 100-continue can be expected");
  }
  return check_length(request);
}

}  // namespace windsplat::net
