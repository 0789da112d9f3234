// Errors -> problem+json answers (RFC 9457), for the HTTP edge and the resources alike.
#pragma once

#include <string>

#include "server/base/error.hpp"
#include "server/net/exchange.hpp"

namespace windsplat::net {

Response problem_response(const Error& error);

// What has no ErrorKind: refusals of HTTP itself. `title` is the status in words.
Response problem_response(int status, std::string title, std::string detail);

}  // namespace windsplat::net
