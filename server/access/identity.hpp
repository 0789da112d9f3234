// The user that a trusted proxy has authenticated and names in a header.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::access {

constexpr std::size_t user_bytes_max = 128;

// Whether it may be the name of a header field: a token (RFC 9110, 5.1 and 5.6.2).
bool is_field_name(std::string_view name);

// The value of that header; empty if the request has none. Fails if it has several, of which only
// one can be the proxy's, or one longer than user_bytes_max.
Result<std::string> named_user(const http::Request& request, std::string_view header);

// Text under which quotas count a user: that of no address.
std::string counted_user(std::string_view user);

}  // namespace windsplat::access
