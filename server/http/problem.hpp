// Errors -> problem+json answers (RFC 9457), for the HTTP edge and the resources alike.
#pragma once

#include <string>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::net {

Response problem_response(const Error& error);

// What has no ErrorKind: refusals of HTTP itself. `title` is the status in words.
// `retry_after_s` goes with 409, 429 and 503; at least 1.
Response problem_response(int status, std::string title, std::string detail, int retry_after_s = 0);

// The answer names its request: in a header, and in a problem as its member requestId.
void name_request(Response& response, const std::string& request_id);

}  // namespace windsplat::net
