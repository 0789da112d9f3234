// Converts errors to application/problem+json (RFC 9457).
#pragma once

#include <string>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::http {

Response problem_response(const Error& error);

// For responses of HTTP itself without an ErrorKind. `title` is the reason phrase. `retry_after_s`
// is sent with 409 of data that are not in memory, 429 and 503; at least 1.
Response problem_response(int status, std::string title, std::string detail, int retry_after_s = 0);

// Adds the request id: as a header, and as requestId in a problem, whose type becomes the path of
// its page below `base_path`.
void name_request(Response& response, const std::string& request_id, const std::string& base_path);

}  // namespace windsplat::http
