// What is answered to those who are not let in, and the page by which a person shows the token: it
// is changed for a cookie, which the browser sends from then on.
#pragma once

#include <cstdint>
#include <string>

#include "server/access/auth.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::net {

inline constexpr std::int64_t cookie_lasts_s = std::int64_t{7} * 24 * 3600;

// For every verdict but `allowed`: a problem, or the login page where a browser wants to show a
// page.
Response turned_away(Verdict verdict, const Request& request, const std::string& base_path);

// Answers a request that is_login(): 303 to the page with a cookie, or the login page again. `tls`:
// the connection is, so the cookie is for such ones alone.
Response log_in(const Request& request, const Token& token, const std::string& base_path, bool tls,
                std::int64_t now_s);

}  // namespace windsplat::net
