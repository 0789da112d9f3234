// Cross-origin resource sharing (Fetch Standard, 3.2): which answers a page of another origin may
// read. Without it browsers send such requests, but keep the answers from the page.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http/exchange.hpp"

namespace windsplat::http {

// Whether the text is an origin as browsers send it: a scheme, a host and perhaps a port of 1 to
// 65535, without a path. "*" and "null" are none: neither names a site.
bool is_origin(std::string_view text);

// Whether the request asks, for a page of one of the origins `allowed`, which requests it may send.
// Browsers send no credentials with it, so it is answered without authentication.
bool is_preflight(const Request& request, const std::vector<std::string>& allowed);

// 204 with methods and headers that requests may have. The same for every path, so that it tells
// nothing about the resources.
Response preflight_response();

// Lets a page of one of the origins `allowed` read the response, with its headers. Cookies remain
// without effect (docs/design/security.md). Nothing is added for other origins but Vary, and
// nothing at all if `allowed` is empty.
void share_with_origins(Response& response, const Request& request,
                        const std::vector<std::string>& allowed);

// Adds a name to the header Vary, once.
void add_vary(Response& response, std::string_view name);

}  // namespace windsplat::http
