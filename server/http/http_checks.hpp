// Rejects requests that HTTP allows and this server does not support, before a body is read.
#pragma once

#include <optional>
#include <string_view>

#include "server/http/exchange.hpp"

namespace windsplat::http {

// Checks the header as received, with its final empty line: rejects folded lines, bare line ends
// and malformed request lines.
std::optional<Response> check_header_bytes(std::string_view header);

// Method, Host, Transfer-Encoding, Content-Length and Expect of a parsed header. `version` is 11
// for HTTP/1.1. How long a body may be is judged by what takes it.
std::optional<Response> check_request(const Request& request, unsigned version);

// Whether a client requests a WebSocket (RFC 6455, 4.2.1); list headers may span several lines.
bool asks_for_websocket(const Request& request, unsigned version);

// Checks key and version of a WebSocket request.
std::optional<Response> check_upgrade(const Request& request);

Response body_too_large();

}  // namespace windsplat::http
