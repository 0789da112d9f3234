// CLI11's own configuration files override the environment; these do not.
#include "server/cli/serve/config_file.hpp"

#include <algorithm>
#include <set>

#include "protocol/config.hpp"
#include "protocol/limits.hpp"
#include "server/cli/command.hpp"
#include "server/cli/settings_file.hpp"

namespace windsplat::cli {
namespace {

using protocol::ConfigEntry;

// "listen", or "datasets" for the positional argument.
std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name() : option.get_lnames().front();
}

// By its name or an alias of it.
CLI::Option* find_option(CLI::App& command, const std::string& name) {
  for (CLI::Option* const option : command.get_options()) {
    const std::vector<std::string>& names = option->get_lnames();
    if (name_of(*option) == name || std::find(names.begin(), names.end(), name) != names.end()) {
      return option;
    }
  }
  return nullptr;
}

// Files have log-level in place of -q and -v.
bool is_setting(const std::string& name) {
  return name != "help" && name != "config" && name != "quiet" && name != "verbose";
}

std::string known_names(CLI::App& command) {
  std::string names;
  for (const CLI::Option* const option : command.get_options()) {
    if (is_setting(name_of(*option))) names += (names.empty() ? "" : ", ") + name_of(*option);
  }
  return names;
}

// Describes an entry of the wrong type; empty if it is valid.
std::string kind_fault(const CLI::Option& option, ConfigEntry::Kind kind) {
  using Kind = ConfigEntry::Kind;
  if (option.get_expected_min() == 0) return kind == Kind::boolean ? "" : "must be true or false";
  if (option.get_expected_max() > 1) {
    return kind == Kind::text || kind == Kind::list ? "" : "must be a string or a list of strings";
  }
  // Every numeric option has a range in its type name: "N:INT in [1 - 10]".
  if (option.get_type_name().find(" in [") != std::string::npos) {
    return kind == Kind::number ? "" : "must be a number";
  }
  return kind == Kind::text ? "" : "must be a string";
}

// Validates against the option's own rules. Errors: CLI::Error.
void give(CLI::Option& option, const std::vector<std::string>& words) {
  option.clear();
  option.add_result(words);
  option.run_callback();
}

Result<void> apply(CLI::App& command, const ConfigEntry& entry) {
  CLI::Option* const option = is_setting(entry.key) ? find_option(command, entry.key) : nullptr;
  if (option == nullptr) {
    return protocol::config_error(entry.key,
                                  "unknown option; known options: " + known_names(command));
  }
  if (std::string fault = kind_fault(*option, entry.kind); !fault.empty()) {
    return protocol::config_error(entry.key, std::move(fault));
  }
  if (std::find(entry.words.begin(), entry.words.end(), "") != entry.words.end()) {
    return protocol::config_error(entry.key, "must not be empty");
  }
  if (entry.words.empty()) return {};
  const std::vector<std::string> given = option->results();
  try {
    give(*option, entry.words);
    if (!given.empty())
      give(*option, given);  // takes precedence; the file's value was validated above
  } catch (const CLI::Error& fault) {
    return protocol::config_error(entry.key, fault.what());
  }
  return {};
}

}  // namespace

void give_again(const CLI::App& given, CLI::App& command) {
  for (const CLI::Option* const option : given.get_options()) {
    if (option->count() == 0) continue;
    CLI::Option* const same = find_option(command, name_of(*option));
    if (same == nullptr || same->count() > 0) continue;
    same->add_result(option->results());
    same->run_callback();
  }
}

Result<void> apply_config(CLI::App& command, const std::string& path) {
  const auto in_file = [&path](Error error) {
    error.message = "the configuration '" + printable(path) + "': " + error.message;
    return error;
  };
  const auto text = read_settings_file(path, protocol::limits::message_bytes_max);
  if (!text) return text.error();
  const auto config = protocol::parse_config(*text);
  if (!config) return in_file(config.error());
  std::set<const CLI::Option*> named;
  for (const ConfigEntry& entry : config->entries) {
    if (const auto ok = apply(command, entry); !ok) return in_file(ok.error());
    const CLI::Option* const option = find_option(command, entry.key);
    if (!named.insert(option).second) {
      return in_file(protocol::config_error(
          entry.key, "is another name of " + name_of(*option) + ", which the file has, too"));
    }
  }
  return {};
}

std::vector<std::string> changed_options(const CLI::App& before, const CLI::App& after) {
  std::vector<std::string> names;
  const auto old = before.get_options();
  const auto fresh = after.get_options();
  for (std::size_t i = 0; i < old.size() && i < fresh.size(); ++i) {
    if (old[i]->results() != fresh[i]->results()) names.push_back(name_of(*fresh[i]));
  }
  return names;
}

}  // namespace windsplat::cli
