// Manual pages in the macros of man(7).
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "server/cli/help/pages.hpp"

namespace windsplat::cli {
namespace {

constexpr std::size_t columns = 78;

// Text with hyphens as the character that is typed.
std::string roff(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else if (c == '\'') {
      out += "\\(aq";
    } else {
      out += c;
    }
  }
  return out;
}

// A paragraph in short lines, none of which begins a request. Lines of the text stay apart.
std::string paragraph(std::string_view text) {
  std::string out;
  std::string line;
  const auto end_line = [&] {
    if (line.starts_with('.')) out += "\\&";
    out += line + '\n';
    line.clear();
  };
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
    const std::string word = roff(text.substr(at, end - at));
    if (!line.empty() && line.size() + 1 + word.size() > columns) end_line();
    line += (line.empty() ? "" : " ") + word;
    if (end < text.size() && text[end] == '\n') {
      end_line();
      out += ".br\n";
    }
    at = end + 1;
  }
  if (!line.empty()) end_line();
  return out;
}

std::string bold(std::string_view text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + roff(text) + "\\fR"; }

std::string title_of(const std::string& name) {
  std::string upper = name;
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  return ".TH \"" + roff(upper) +
         "\" 1 \"\" \"windsplat " WINDSPLAT_VERSION "\" \"User Commands\"\n";
}

std::string tag_of(const OptionText& option) {
  std::string tag;
  for (const std::string& name : option.names) tag += (tag.empty() ? "" : ", ") + bold(name);
  if (option.is_argument()) return italic(option.value);
  return option.value.empty() ? tag : tag + " " + italic(option.value);
}

std::string sentence(std::string text) {
  if (!text.empty() && text.back() != '.' && text.back() != '?') text += '.';
  return text;
}

std::string entry(const OptionText& option) {
  std::string out = ".TP\n" + tag_of(option) + "\n" + paragraph(sentence(option.description));
  std::string words;
  for (const std::string& choice : option.choices) words += (words.empty() ? "" : ", ") + choice;
  if (!words.empty()) out += paragraph("One of: " + words + ".");
  if (!option.limits.empty()) out += paragraph("From " + option.limits + ".");
  if (!option.preset.empty()) out += paragraph("Default: " + option.preset + ".");
  if (option.required) out += "Required.\n";
  return out;
}

std::string options_of(const CommandText& command) {
  std::string out;
  std::vector<std::string> groups;
  for (const OptionText& option : command.options) {
    if (option.is_argument()) continue;
    if (std::find(groups.begin(), groups.end(), option.group) == groups.end()) {
      groups.push_back(option.group);
    }
  }
  std::stable_partition(groups.begin(), groups.end(),
                        [](const std::string& group) { return group == "Options"; });
  if (!groups.empty()) out += ".SH OPTIONS\n";
  for (const std::string& group : groups) {
    if (group != "Options") out += ".SS " + roff(group) + "\n";
    for (const OptionText& option : command.options) {
      if (!option.is_argument() && option.group == group) out += entry(option);
    }
  }
  return out;
}

std::string environment_of(const CommandText& command) {
  std::string out;
  for (const OptionText& option : command.options) {
    if (option.environment.empty() || option.is_argument()) continue;
    out += ".TP\n" + bold(option.environment) + "\nSets " + bold(option.names.back()) +
           ", which has precedence.\n";
  }
  return out.empty() ? out : ".SH ENVIRONMENT\n" + out;
}

constexpr const char* exit_status = R"(.SH EXIT STATUS
.TP
.B 0
Success.
.TP
.B 1
Failure: a file does not exist or cannot be read or written; memory or a host
failed.
.TP
.B 2
Invalid usage: a command, option, configuration or view, or a value in it.
.TP
.B 3
Invalid data: a file is damaged or not supported.
.TP
.B 130
Interrupted.
)";

// Pages of the others, three to a line.
std::string see_also(const CommandText& program, const std::string& self) {
  std::string out;
  if (self != program.name) out += ".BR " + roff(program.name) + " (1)";
  for (const CommandText& command : program.commands) {
    if (command.name == self) continue;
    if (!out.empty()) out += ",\n";
    out += ".BR " + roff(program.name + "-" + command.name) + " (1)";
  }
  return ".SH SEE ALSO\n" + out + "\n";
}

// The first line of a description, without a full stop.
std::string summary_of(const CommandText& command) {
  std::string line = command.description.substr(0, command.description.find('\n'));
  if (!line.empty() && line.back() == '.') line.pop_back();
  return line;
}

std::string name_line(const std::string& name, const std::string& summary) {
  std::string out = paragraph(name + " - " + summary);
  const std::string from = roff(" - ");  // the separator that indexes of pages look for
  return out.replace(out.find(from), from.size(), " \\- ");
}

}  // namespace

std::string manual_page(const CommandText& program) {
  std::string out = title_of(program.name);
  const std::string prefix = program.name + " draws ";
  std::string summary = summary_of(program);
  if (summary.starts_with(prefix)) summary = "draw " + summary.substr(prefix.size());
  out += ".SH NAME\n" + name_line(program.name, summary);
  out += ".SH SYNOPSIS\n" + bold(program.name) + " " + italic("COMMAND") + " [" + italic("OPTION") +
         "]...\n";
  out += ".SH DESCRIPTION\n" + paragraph(program.description);
  out += ".SH COMMANDS\n";
  for (const CommandText& command : program.commands) {
    out += ".TP\n" + bold(command.name) + "\n" + paragraph(sentence(command.description));
  }
  out += options_of(program) + exit_status;
  return out + see_also(program, program.name);
}

std::string manual_page(const CommandText& program, const CommandText& command) {
  const std::string name = program.name + "-" + command.name;
  std::string out = title_of(name);
  out += ".SH NAME\n" + name_line(name, summary_of(command));
  out += ".SH SYNOPSIS\n" + bold(program.name) + " " + bold(command.name);
  std::string arguments;
  for (const OptionText& option : command.options) {
    if (option.is_argument()) {
      const std::string value = italic(option.value) + (option.repeats ? "..." : "");
      out += option.required ? " " + value : " [" + value + "]";
      arguments += entry(option);
    } else if (option.required) {
      out += " " + bold(option.names.front()) + " " + italic(option.value);
    }
  }
  out += " [" + italic("OPTION") + "]...\n";
  out += ".SH DESCRIPTION\n" + paragraph(sentence(command.description)) + arguments;
  out += options_of(command) + environment_of(command) + exit_status;
  return out + see_also(program, command.name);
}

}  // namespace windsplat::cli
