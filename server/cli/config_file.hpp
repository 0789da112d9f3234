// Options from three places: the command line, the environment, a file of JSON; the first wins.
// Which options there are is known to CLI11 alone.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::cli {

// Gives the options of `command` that were not given yet what `given`, a command with the same
// options, was given on the command line and in the environment.
void give_again(const CLI::App& given, CLI::App& command);

// Gives the options that were not given yet what the file says. Errors name the file: those of
// reading it, and of parse_config; invalid, with the pointer, for a key that is no option, a value
// that is not of the option's kind, or out of its range.
Result<void> apply_config(CLI::App& command, const std::string& path);

// The options, by their names without dashes, that were given different values.
std::vector<std::string> changed_options(const CLI::App& before, const CLI::App& after);

}  // namespace windsplat::cli
