// Common parts of the commands: registration, errors, and parsing of arguments.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::cli {

inline constexpr int exit_ok = 0;
inline constexpr int exit_failed = 1;
inline constexpr int exit_usage = 2;
inline constexpr int exit_bad_data = 3;
inline constexpr int exit_interrupted = 130;  // the shell convention for SIGINT

// Runs a command with validated arguments; the value is the exit code.
using Action = std::function<int()>;

// Each function adds a subcommand, which sets `chosen` when selected.
void add_serve(CLI::App& app, Action& chosen);
void add_render(CLI::App& app, Action& chosen);
void add_animate(CLI::App& app, Action& chosen);
void add_inspect(CLI::App& app, Action& chosen);
void add_synth(CLI::App& app, Action& chosen);
void add_convert(CLI::App& app, Action& chosen);
void add_healthcheck(CLI::App& app, Action& chosen);
void add_study(CLI::App& app, Action& chosen);
void add_help(CLI::App& app, Action& chosen);  // help, man and completions

// The internal command `load`, which reads files in a separate process. Returns the exit code.
int load();

// --threads N, or WINDSPLAT_THREADS; 0, the default, means one per hardware thread.
void add_threads_option(CLI::App& command, unsigned& threads);

// --memory-limit BYTES, or WINDSPLAT_MEMORY_LIMIT; `bytes` holds the default and must outlive the
// command.
void add_memory_option(CLI::App& command, std::string& bytes);
// Errors: malformed, including values below memory_bytes_min or above memory_bytes_max
// (open_store.hpp).
Result<std::uint64_t> memory_limit(const std::string& text);

// How much is written to stderr: errors alone, notes on results too, or also what was done.
enum class Verbosity { quiet, normal, verbose };
struct VerbosityWords {  // descriptions
  const char* quiet;
  const char* verbose;
};
struct VerbosityFlags {
  CLI::Option* quiet;
  CLI::Option* verbose;
};
// -q, --quiet and -v, --verbose, which exclude each other.
VerbosityFlags add_verbosity_flags(CLI::App& command, const VerbosityWords& words,
                                   const std::function<void(Verbosity)>& set);
// The same; they set the verbosity of the process when the command is parsed.
void add_verbosity_options(CLI::App& command);
[[nodiscard]] Verbosity verbosity();

// Prints one line to stderr: an error.
void complain(std::string_view message);
// The same for what the user should know of a result, unless --quiet.
void note(std::string_view message);
// The same for what was done, with --verbose.
void detail(std::string_view message);
std::string seconds_text(double seconds);  // "0.42 s"

// Accepts numbers within the limits; not NaN, which CLI::Range accepts.
CLI::Validator between(double min, double max);

// Whether a name of a file means standard output or input.
inline bool is_stdout(const std::string& name) { return name == "-"; }
inline bool is_stdin(const std::string& name) { return name == "-"; }

// An option and the file that it names.
struct NamedFile {
  const char* option;
  std::string name;
};
// At most one input may be standard input, and one output standard output. The first output is
// binary: a terminal is refused. Errors: invalid.
Result<void> check_streams(const std::vector<NamedFile>& inputs,
                           const std::vector<NamedFile>& outputs);

// Prints the error to stderr, with the JSON pointer of each invalid value, and returns the exit
// code of its kind.
int answer(const Error& error);
int exit_code(ErrorKind kind);

// "1280x720" -> {1280, 720}: `count` integers of at least 1, separated by x.
std::optional<std::array<std::int64_t, 3>> parse_extent(std::string_view text, std::size_t count);

// "8G", "1.5g" -> bytes; K, M, G and T are powers of 1024. Fractions of a byte are dropped, values
// above 2^53 rounded. Empty if malformed, less than a byte, or 2^64 and more.
std::optional<std::uint64_t> parse_bytes(std::string_view text);

// The whole file, or standard input for "-". Errors: not_found, too_large beyond `bytes_max`.
Result<std::string> read_text_file(const std::string& path, std::size_t bytes_max);

// Writes to a file (see write_whole_file), or to stdout for "-".
Result<void> write_output(const std::string& path, std::span<const std::uint8_t> bytes);
Result<void> write_stdout(std::string_view text);

}  // namespace windsplat::cli
