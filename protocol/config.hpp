// The configuration file: one JSON object whose keys are named as the options of `windsplat serve`,
// without their dashes. What each may be is the options' to say; here is its form.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::protocol {

struct ConfigEntry {
  enum class Kind { text, number, boolean, list };

  std::string key;
  Kind kind = Kind::text;
  // As the command line would have it: one word, "true" or "false", a number as JSON writes it, or
  // the list's texts.
  std::vector<std::string> words;
};

struct Config {
  std::vector<ConfigEntry> entries;  // by key, each once
};

// Errors, with JSON pointers: too_large, malformed (as every document of the wire), invalid (no
// object, a value that is no text, number, boolean or list of texts; a text with a control
// character).
Result<Config> parse_config(std::string_view json);

// A fault of one entry, found by whoever knows the option: invalid, at its pointer.
Error config_error(const std::string& key, std::string detail);

}  // namespace windsplat::protocol
