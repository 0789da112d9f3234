// What HTTP allows and this server does not, told before a body is read.
#pragma once

#include <optional>
#include <string_view>

#include "server/http/exchange.hpp"

namespace windsplat::net {

// The header as received, with its final empty line: folded lines, bare line ends and a request
// line that is not three words are refused.
std::optional<Response> check_header_bytes(std::string_view header);

// Method, Host, Transfer-Encoding, Content-Length and Expect of a parsed header. `version` is 11
// for HTTP/1.1.
std::optional<Response> check_request(const Request& request, unsigned version);

// Whether a client asks for a WebSocket (RFC 6455, 4.2.1), its lists in however many lines.
bool asks_for_websocket(const Request& request, unsigned version);

// Key and version of a request that asks for a WebSocket.
std::optional<Response> check_upgrade(const Request& request);

Response body_too_large();

}  // namespace windsplat::net
