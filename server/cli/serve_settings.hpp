// Arguments of `windsplat serve` and the files they name -> checked settings, at the start and
// again on SIGHUP.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>

#include "server/base/error.hpp"
#include "server/cli/serve_options.hpp"
#include "server/transport/server.hpp"

namespace windsplat::cli {

struct ServeSettings {
  CLI::App command;  // which of the arguments were given
  ServeArguments arguments;
  net::ServerOptions options;  // without what is made from other folders
};

// As `given` was given on the command line and in the environment, and as the configuration, the
// token and the certificate are now. Errors say which option or file is at fault and why.
Result<std::unique_ptr<ServeSettings>> read_settings(const CLI::App& given);

// Logs what is allowed and yet no good: secrets that others can read or that travel in the clear, a
// certificate that has expired.
void warn_of(const ServeSettings& settings);

// Whether others may reach the address without being asked for a token, or reach a process of
// root's, though nobody said so. Errors: invalid.
Result<void> check_exposure(const ServeArguments& arguments, bool loopback);

}  // namespace windsplat::cli
