#include "server/cli/help/command_text.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <utility>

namespace windsplat::cli {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    out.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

ValueKind kind_of(const OptionText& option) {
  if (!option.choices.empty()) return ValueKind::choice;
  if (option.value == "FILE" || option.value == "PATH") return ValueKind::file;
  if (option.value == "DIR") return ValueKind::folder;
  if (option.value == "DATASET") return ValueKind::dataset;
  if (option.value == "COMMAND") return ValueKind::command;
  return ValueKind::other;
}

// CLI11 describes a value as "N:INT in [1 - 100]" or "TEXT:{auto,all}": the name of its type and
// the descriptions of its checks.
void read_type(const std::string& type, OptionText& out) {
  const std::size_t open = type.find('{');
  if (open != std::string::npos && type.back() == '}') {
    out.choices = split(type.substr(open + 1, type.size() - open - 2), ',');
    out.value = type.substr(0, std::min(open, type.find(':')));
  } else {
    const std::size_t in = type.find(" in [");
    const std::size_t check = in == std::string::npos ? std::string::npos : type.rfind(':', in);
    if (check != std::string::npos) {
      const std::size_t dash = type.find(" - ", in);
      out.limits = type.substr(in + 5, dash - in - 5) + " to " +
                   type.substr(dash + 3, type.size() - dash - 4);
      out.value = type.substr(0, check);
    } else {
      const std::size_t to = type.find(" to ");
      const std::size_t colon = to == std::string::npos ? to : type.rfind(':', to);
      out.value = type.substr(0, colon);
      if (colon != std::string::npos) out.limits = type.substr(colon + 1);
    }
  }
  if (out.value == "TEXT") out.value = out.choices.empty() ? "TEXT" : "NAME";
}

OptionText describe_option(const CLI::Option& option) {
  OptionText out;
  for (const std::string& name : option.get_snames()) out.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) out.names.push_back("--" + name);
  out.description = option.get_description();
  out.environment = option.get_envname();
  out.group = option.get_group();
  out.required = option.get_required();
  out.repeats = option.get_items_expected_max() > 1;
  if (option.get_type_size_max() > 0) {
    read_type(option.get_type_name(), out);
    out.preset = option.get_default_str();
    if (out.preset == "\"\"" || out.preset == "[]") out.preset.clear();
    out.kind = kind_of(out);
  }
  return out;
}

}  // namespace

CommandText describe_command(const CLI::App& app) {
  CommandText out;
  out.name = app.get_name();
  out.description = app.get_description();
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) out.options.push_back(describe_option(*option));
  }
  // Arguments first.
  std::stable_partition(out.options.begin(), out.options.end(),
                        [](const OptionText& option) { return option.is_argument(); });
  for (const CLI::App* command : app.get_subcommands({})) {
    if (!command->get_group().empty()) out.commands.push_back(describe_command(*command));
  }
  return out;
}

}  // namespace windsplat::cli
