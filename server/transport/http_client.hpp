// The HTTP client of `windsplat healthcheck`.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat::transport {

// GET of an http:// or https:// URL, for `healthcheck`: returns the status code. The certificate is
// checked against `ca`, PEM certificates that include the server's own or one of its chain; empty:
// those of the system.
Result<int> http_status(const std::string& url, int timeout_s, const std::string& ca = "");

}  // namespace windsplat::transport
