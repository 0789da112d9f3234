// Rejects ambiguous requests (RFC 9112: exactly one Host, one length, no other framing) and invalid
// upgrades (RFC 6455).
#include "server/http/http_checks.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

#include "protocol/limits.hpp"
#include "server/base/error.hpp"
#include "server/http/gzip.hpp"
#include "server/http/problem.hpp"

namespace windsplat::http {
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
  if (count(request, "Content-Length") > 1) return bad_request("duplicate Content-Length");
  const std::string text = request.header("Content-Length");
  if (text.empty()) {
    if (request.method == "POST" || request.method == "PUT" || request.method == "PATCH") {
      return problem_response(411, "Length Required", "a body requires Content-Length");
    }
    return std::nullopt;
  }
  std::uint64_t length = 0;
  const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), length);
  if (stop != text.data() + text.size() || fault == std::errc::invalid_argument) {
    return bad_request("Content-Length is not a number");
  }
  if (fault != std::errc()) return body_too_large();
  return std::nullopt;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

// The library reports an invalid version token as an unsupported version.
bool is_request_line(std::string_view line) {
  const std::size_t target = line.find(' ') + 1;
  const std::size_t version = line.rfind(' ') + 1;
  if (target <= 1 || version <= target + 1) return false;
  const std::string_view between = line.substr(target, version - 1 - target);
  const std::string_view last = line.substr(version);
  return between.find_first_of(" \t") == std::string_view::npos && last.size() == 8 &&
         last.starts_with("HTTP/") && is_digit(last[5]) && last[6] == '.' && is_digit(last[7]);
}

bool is_port(std::string_view text) {
  return text.size() <= 5 && std::all_of(text.begin(), text.end(), is_digit) &&
         (text.size() < 5 || text <= "65535");
}

// uri-host [ ":" port ] (RFC 9110, 7.2); of an address in brackets only the characters are checked.
bool is_host(std::string_view host) {
  std::size_t end = 0;
  if (host.starts_with('[')) {
    end = host.find_first_not_of("0123456789abcdefABCDEF:.", 1);
    if (end == std::string_view::npos || end == 1 || host[end] != ']') return false;
    ++end;
  } else {
    constexpr std::string_view others = "-._~!$&'()*+;=%";  // no comma: it would separate a list
    while (end < host.size() && (is_letter(host[end]) || is_digit(host[end]) ||
                                 others.find(host[end]) != std::string_view::npos)) {
      ++end;
    }
    if (end == 0) return false;
  }
  return end == host.size() || (host[end] == ':' && is_port(host.substr(end + 1)));
}

bool lists(const std::string& header, std::string_view name) {
  const auto parts = split_list(header, ',');
  return std::any_of(parts.begin(), parts.end(),
                     [&](std::string_view part) { return equal_without_case(part, name); });
}

// 16 bytes in base64 (RFC 6455, 4.2.1).
bool is_websocket_key(std::string_view key) {
  constexpr std::size_t letters = 22;
  return key.size() == letters + 2 && key.ends_with("==") &&
         std::all_of(key.begin(), key.begin() + letters,
                     [](char c) { return is_letter(c) || is_digit(c) || c == '+' || c == '/'; });
}

}  // namespace

Response body_too_large() {
  return problem_response(make_error(
      ErrorKind::too_large, "a request body may have at most " +
                                std::to_string(protocol::limits::http_body_bytes_max) + " bytes"));
}

std::optional<Response> check_header_bytes(std::string_view header) {
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (header[i] != '\n' && header[i] != '\r') continue;
    const bool pair = header[i] == '\r' && i + 1 < header.size() && header[i + 1] == '\n';
    if (!pair) return bad_request("a header line ends with a bare CR or LF");
    const char next = i + 2 < header.size() ? header[i + 2] : 'x';
    if (next == ' ' || next == '\t') return bad_request("folded header lines are not supported");
    ++i;
  }
  if (!is_request_line(header.substr(0, header.find('\r')))) {
    return bad_request("the request line must be a method, a target and HTTP/ with a version");
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
                            "Transfer-Encoding is not supported: use Content-Length");
  }
  if (count(request, "Host") != 1) return bad_request("a request must have exactly one Host");
  if (const std::string host = request.header("Host"); !is_host(host)) {
    return bad_request("the Host " + printable(host, 80) +
                       " is not a host name with an optional port");
  }
  if (std::find(known_methods.begin(), known_methods.end(), request.method) ==
      known_methods.end()) {
    return problem_response(501, "Not Implemented",
                            "unknown method " + printable(request.method, 20));
  }
  if (const std::string expect = request.header("Expect");
      !expect.empty() && !equal_without_case(expect, "100-continue")) {
    return problem_response(417, "Expectation Failed",
                            "the only supported expectation is 100-continue");
  }
  if (auto fault = check_coding(request)) return fault;
  return check_length(request);
}

bool asks_for_websocket(const Request& request, unsigned version) {
  return version == 11 && request.method == "GET" &&
         lists(request.header("Connection"), "upgrade") &&
         lists(request.header("Upgrade"), "websocket");
}

std::optional<Response> check_upgrade(const Request& request) {
  if (request.header("Sec-WebSocket-Version") != "13") {
    Response response =
        problem_response(426, "Upgrade Required", "unsupported WebSocket version; use 13");
    response.headers.emplace_back("Sec-WebSocket-Version", "13");
    response.headers.emplace_back("Upgrade", "websocket");
    return response;
  }
  if (!is_websocket_key(request.header("Sec-WebSocket-Key"))) {
    return bad_request("a WebSocket request must have one Sec-WebSocket-Key: 16 bytes in base64");
  }
  return std::nullopt;
}

}  // namespace windsplat::http
