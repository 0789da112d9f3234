// Responses to unauthenticated clients, and the login page, which exchanges the token for a cookie.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/access/auth.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::access {

inline constexpr std::int64_t cookie_lasts_s = std::int64_t{7} * 24 * 3600;

// The response for every verdict but `allowed`: a problem, or the login page if a browser navigates
// to a page. In a frame of `embedders` (http/framing.hpp) it says why it shows nothing.
http::Response turned_away(Verdict verdict, const http::Request& request,
                           const std::string& base_path,
                           const std::vector<std::string>& embedders = {});

// Replies to a request that is_login(): 303 to the page with a cookie, or the login page again.
// `tls`: the connection uses TLS, so the cookie gets the attribute Secure.
http::Response log_in(const http::Request& request, const Token& token,
                      const std::string& base_path, bool tls, std::int64_t now_s);

// "'sha256-...'" source expression of an inline element for the Content-Security-Policy.
std::string policy_hash(std::string_view text);

}  // namespace windsplat::access
