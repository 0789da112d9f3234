// Files that the daemon's settings name: token, certificate, key, configuration.
#pragma once

#include <string>

#include "server/base/error.hpp"

namespace windsplat::cli {

// Reads a whole file. Anything but a regular file, such as a pipe, is rejected without blocking.
// Errors: not_found, invalid, too_large above `bytes_max`.
Result<std::string> read_settings_file(const std::string& path, std::size_t bytes_max);

}  // namespace windsplat::cli
