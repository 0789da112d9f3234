// Validates the arguments of `windsplat serve` and the files they name, at startup and on SIGHUP.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>

#include "server/base/error.hpp"
#include "server/cli/serve/options.hpp"
#include "server/cli/serve/service_manager.hpp"
#include "server/transport/server.hpp"

namespace windsplat::cli {

struct ServeSettings {
  CLI::App command;  // records which arguments were given
  ServeArguments arguments;
  api::ServerOptions options;  // without members that are created from other settings
};

// Settings from `given` (command line and environment) and the current configuration, token and
// certificate. A socket of the service manager takes the place of --listen. Errors name the option
// or file and the reason.
Result<std::unique_ptr<ServeSettings>> read_settings(const CLI::App& given,
                                                     const ServiceManager& manager);

// Limit on uploads; 0: none are accepted. Errors: malformed; invalid without a folder.
Result<std::uint64_t> upload_bytes(const ServeArguments& arguments);

// Logs insecure but permitted settings: secrets that others can read or that are sent unencrypted,
// an expired certificate.
void warn_of(const ServeSettings& settings);

// Rejects, unless explicitly allowed, an address reachable by others without a token or by a
// process of root. Errors: invalid.
Result<void> check_exposure(const ServeArguments& arguments, bool loopback);

}  // namespace windsplat::cli
