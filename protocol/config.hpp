// The configuration file: one JSON object with the options of `windsplat serve` as keys, without
// dashes. Only the form is checked here; the options check their values.
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
  // Words as on the command line: one word, "true" or "false", a number as in JSON, or the strings
  // of a list.
  std::vector<std::string> words;
};

struct Config {
  std::vector<ConfigEntry> entries;  // unique, sorted by key
};

// Errors, with JSON pointers: too_large, malformed (as for every document of the protocol), invalid
// (not an object; a value that is not a string, number, boolean or list of strings; a string with a
// control character).
Result<Config> parse_config(std::string_view json);

// An error of kind invalid at the pointer of one entry, for checks by option.
Error config_error(const std::string& key, std::string detail);

}  // namespace windsplat::protocol
