// Rejects requests that HTTP allows and this server does not support, before a body is read.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "protocol/limits.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::http {

// Checks the header as received, with its final empty line: rejects folded lines, bare line ends
// and malformed request lines.
std::optional<Response> check_header_bytes(std::string_view header);

// Method, Host, Transfer-Encoding, Content-Length and Expect of a parsed header. `version` is 11
// for HTTP/1.1.
std::optional<Response> check_request(
    const Request& request, unsigned version,
    std::uint64_t body_bytes_max = protocol::limits::http_body_bytes_max);

// Whether a client requests a WebSocket (RFC 6455, 4.2.1); list headers may span several lines.
bool asks_for_websocket(const Request& request, unsigned version);

// Checks key and version of a WebSocket request.
std::optional<Response> check_upgrade(const Request& request);

Response body_too_large();

}  // namespace windsplat::http
