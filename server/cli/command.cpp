// Common parts of the commands: parsing of numbers, output to files, errors to stderr.
#include "server/cli/command.hpp"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <system_error>

#include "server/base/whole_file.hpp"
#include "server/cli/open_store.hpp"

namespace windsplat::cli {
namespace {

constexpr unsigned threads_max = 1024;

// Set while the arguments are parsed, before any other thread is started.
Verbosity command_verbosity = Verbosity::normal;

struct CloseFile {
  void operator()(std::FILE* file) const {
    if (file != stdin) std::fclose(file);
  }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

Error error_of_system(ErrorKind kind, const char* what, const std::string& path) {
  return make_error(kind, std::string(what) + " '" + printable(path) +
                              "': " + std::generic_category().message(errno));
}

}  // namespace

void add_threads_option(CLI::App& command, unsigned& threads) {
  command.add_option("--threads", threads, "Render threads; 0: one per hardware thread")
      ->envname("WINDSPLAT_THREADS")
      ->check(CLI::Range(0U, threads_max))
      ->type_name("N")
      ->capture_default_str();
}

void add_memory_option(CLI::App& command, std::string& bytes) {
  command
      .add_option("--memory-limit", bytes,
                  "Bytes for data, pictures and loaders, at least " + bytes_text(memory_bytes_min) +
                      "; K, M, G, T are powers of 1024, as in 512M or 1.5G")
      ->envname("WINDSPLAT_MEMORY_LIMIT")
      ->type_name("BYTES")
      ->capture_default_str();
}

Result<std::uint64_t> memory_limit(const std::string& text) {
  const auto bytes = parse_bytes(text);
  const std::string option = "--memory-limit '" + printable(text) + "' ";
  if (!bytes) {
    return make_error(ErrorKind::malformed,
                      option + "is not a number of bytes such as 512M, 1.5G or 8G, at most " +
                          bytes_text(memory_bytes_max));
  }
  if (*bytes > memory_bytes_max) {
    return make_error(ErrorKind::malformed, option + "is above " + bytes_text(memory_bytes_max) +
                                                ", more than a process can address");
  }
  if (*bytes >= memory_bytes_min) return *bytes;
  return make_error(ErrorKind::malformed,
                    option + "is below the minimum of " + bytes_text(memory_bytes_min) + ": " +
                        bytes_text(program_bytes) + " for the program and a picture, the rest " +
                        "for a loader and fields (a number without K, M, G or T is in bytes)");
}

VerbosityFlags add_verbosity_flags(CLI::App& command, const VerbosityWords& words,
                                   const std::function<void(Verbosity)>& set) {
  constexpr const char* group = "Messages";
  CLI::Option* quiet = command
                           .add_flag_callback(
                               "-q,--quiet", [set] { set(Verbosity::quiet); }, words.quiet)
                           ->group(group);
  CLI::Option* verbose = command
                             .add_flag_callback(
                                 "-v,--verbose", [set] { set(Verbosity::verbose); }, words.verbose)
                             ->excludes(quiet)
                             ->group(group);
  return {quiet, verbose};
}

void add_verbosity_options(CLI::App& command) {
  command_verbosity = Verbosity::normal;
  add_verbosity_flags(
      command,
      {"Write errors only to stderr: no notes, no progress", "Also write to stderr what was done"},
      [](Verbosity wanted) { command_verbosity = wanted; });
}

Verbosity verbosity() { return command_verbosity; }

void complain(std::string_view message) {
  const std::string line = "windsplat: " + std::string(message) + '\n';
  std::fwrite(line.data(), 1, line.size(), stderr);
}

void note(std::string_view message) {
  if (verbosity() != Verbosity::quiet) complain(message);
}

void detail(std::string_view message) {
  if (verbosity() == Verbosity::verbose) complain(message);
}

std::string seconds_text(double seconds) {
  char text[32];
  std::snprintf(text, sizeof text, seconds < 10 ? "%.2f s" : "%.0f s", seconds);
  return text;
}

CLI::Validator between(double min, double max) {
  char text[64];
  std::snprintf(text, sizeof text, "%.10g to %.10g", min, max);
  const std::string range = text;
  return {
      [min, max, range](std::string& value) {
        double number = 0;
        const char* const end = value.data() + value.size();
        const auto [next, fault] = std::from_chars(value.data(), end, number);
        const bool valid = fault == std::errc() && next == end && number >= min && number <= max;
        return valid ? std::string() : "'" + printable(value) + "' is not a number from " + range;
      },
      range};
}

Result<void> check_streams(const std::vector<NamedFile>& inputs,
                           const std::vector<NamedFile>& outputs) {
  for (const auto* files : {&inputs, &outputs}) {
    const char* first = nullptr;
    for (const NamedFile& file : *files) {
      if (!is_stdout(file.name)) continue;
      if (first != nullptr) {
        return make_error(ErrorKind::invalid, std::string(file.option) +
                                                  " -: " + (files == &inputs ? "stdin" : "stdout") +
                                                  " is used by " + first);
      }
      first = file.option;
    }
  }
  if (!outputs.empty() && is_stdout(outputs.front().name) && isatty(STDOUT_FILENO) == 1) {
    return make_error(ErrorKind::invalid,
                      std::string(outputs.front().option) +
                          " -: stdout is a terminal; redirect it to a file or a pipe");
  }
  return {};
}

int exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::malformed:
    case ErrorKind::invalid:
    case ErrorKind::too_large:
      return exit_usage;
    case ErrorKind::bad_data:
      return exit_bad_data;
    case ErrorKind::not_found:
    case ErrorKind::not_resident:
    case ErrorKind::conflict:
    case ErrorKind::busy:
    case ErrorKind::draining:
    case ErrorKind::out_of_memory:
    case ErrorKind::cancelled:
    case ErrorKind::internal:
      return exit_failed;
  }
  return exit_failed;
}

int answer(const Error& error) {
  complain(printable(error.message, 2000));
  if (error.at.size() > 1) {
    for (const FieldError& field : error.at) {
      complain("  " + printable(field.pointer) + ": " + printable(field.detail, 500));
    }
  }
  return exit_code(error.kind);
}

std::optional<std::array<std::int64_t, 3>> parse_extent(std::string_view text, std::size_t count) {
  std::array<std::int64_t, 3> numbers{1, 1, 1};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) {
      if (at == end || (*at != 'x' && *at != 'X')) return std::nullopt;
      ++at;
    }
    const auto [next, fault] = std::from_chars(at, end, numbers[i]);
    if (fault != std::errc() || numbers[i] < 1) return std::nullopt;
    at = next;
  }
  if (at != end) return std::nullopt;
  return numbers;
}

std::optional<std::uint64_t> parse_bytes(std::string_view text) {
  constexpr std::string_view units = "KMGT";
  constexpr std::string_view digits = "0123456789";
  double scale = 1;
  bool is_whole = true;
  if (!text.empty() && digits.find(text.back()) == std::string_view::npos) {
    const std::size_t power =
        units.find(static_cast<char>(std::toupper(static_cast<unsigned char>(text.back()))));
    if (power == std::string_view::npos) return std::nullopt;
    scale = std::ldexp(1.0, 10 * (static_cast<int>(power) + 1));
    is_whole = false;
    text.remove_suffix(1);
  }
  // Require digits at both ends: from_chars accepts signs, "inf" and "1.".
  const auto is_digit = [&](char one) { return digits.find(one) != std::string_view::npos; };
  if (text.empty() || !is_digit(text.front()) || !is_digit(text.back())) return std::nullopt;
  if (is_whole && !std::all_of(text.begin(), text.end(), is_digit)) return std::nullopt;
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto [next, fault] = std::from_chars(text.data(), end, number, std::chars_format::fixed);
  if (fault != std::errc() || next != end) return std::nullopt;
  const double bytes = std::floor(number * scale);
  if (bytes < 1 || bytes >= std::ldexp(1.0, 64)) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

Result<std::string> read_text_file(const std::string& path, std::size_t bytes_max) {
  const File file(is_stdin(path) ? stdin : std::fopen(path.c_str(), "rbe"));
  if (!file) return error_of_system(ErrorKind::not_found, "cannot open", path);
  std::string text(bytes_max + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), file.get()));
  if (std::ferror(file.get()) != 0)
    return error_of_system(ErrorKind::not_found, "cannot read", path);
  if (text.size() > bytes_max) {
    return make_error(ErrorKind::too_large, "'" + printable(path) + "' has more than " +
                                                std::to_string(bytes_max) + " bytes");
  }
  return text;
}

Result<void> write_stdout(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (std::fflush(stdout) == 0 && written) return {};
  return make_error(ErrorKind::internal,
                    "cannot write to stdout: " + std::generic_category().message(errno));
}

Result<void> write_output(const std::string& path, std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return is_stdout(path) ? write_stdout(text) : write_whole_file(path, text);
}

}  // namespace windsplat::cli
