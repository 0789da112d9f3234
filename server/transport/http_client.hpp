// The HTTP client of `windsplat healthcheck`.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat::transport {

// GET of an http:// or https:// URL, for `healthcheck`: the status code. The certificate is checked
// against `ca`, certificates in PEM, the server's own among them or one that leads to it; empty:
// those of the system.
Result<int> http_status(const std::string& url, int timeout_s, const std::string& ca = "");

}  // namespace windsplat::transport
