// Converts errors to application/problem+json (RFC 9457).
#pragma once

#include <string>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::http {

Response problem_response(const Error& error);

// For refusals of HTTP itself, which have no ErrorKind. `title` is the reason phrase.
// `retry_after_s` is sent with 409, 429 and 503; at least 1.
Response problem_response(int status, std::string title, std::string detail, int retry_after_s = 0);

// Adds the request id: as a header, and as requestId in a problem.
void name_request(Response& response, const std::string& request_id);

}  // namespace windsplat::http
