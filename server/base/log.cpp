// Events -> lines -> the stderr sink of spdlog. Values are escaped, so that untrusted text cannot
// forge lines or control a terminal.
#include "server/base/log.hpp"

#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <memory>
#include <mutex>

#include "server/base/error.hpp"

namespace windsplat::log {
namespace {

constexpr std::size_t message_bytes_max = 1000;
constexpr std::size_t value_bytes_max = 400;
constexpr std::array<std::string_view, 5> level_names{"debug", "info", "warn", "error", "off"};

spdlog::level::level_enum spdlog_level(Level level) {
  constexpr std::array<spdlog::level::level_enum, 5> levels{
      spdlog::level::debug, spdlog::level::info, spdlog::level::warn, spdlog::level::err,
      spdlog::level::off};
  return levels[static_cast<std::size_t>(level)];
}

struct Sink {
  std::mutex mutex;  // guards both; configure replaces them
  std::shared_ptr<spdlog::logger> logger;
  Format format = Format::text;
};

std::shared_ptr<spdlog::logger> make_logger(Format format, Level level) {
  const char* no_color = std::getenv("NO_COLOR");
  const bool plain = format == Format::json || (no_color != nullptr && *no_color != '\0');
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>(
      plain ? spdlog::color_mode::never : spdlog::color_mode::automatic);
  auto logger = std::make_shared<spdlog::logger>("windsplat", std::move(sink));
  logger->set_pattern(format == Format::json ? "%v" : "%Y-%m-%dT%H:%M:%S.%eZ %^%-5l%$ %v",
                      spdlog::pattern_time_type::utc);
  logger->set_level(spdlog_level(level));
  logger->flush_on(spdlog::level::debug);
  return logger;
}

Sink& sink() {
  static Sink* const shared = [] {  // never destroyed: threads may log while the program ends
    auto* made = new Sink;
    made->logger = make_logger(Format::text, Level::info);
    return made;
  }();
  return *shared;
}

std::string now_utc() {
  const auto now = std::chrono::system_clock::now();
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  const auto since_epoch = now.time_since_epoch();
  const auto milliseconds =
      std::chrono::duration_cast<std::chrono::milliseconds>(since_epoch).count() % 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%s.%03dZ", date.data(), static_cast<int>(milliseconds));
  return text.data();
}

// Escapes quotes and backslashes; `text` is already printable.
std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

bool is_one_word(std::string_view text) {
  return !text.empty() && text.find_first_of(" =\"\\") == std::string_view::npos;
}

}  // namespace

Field::Field(std::string_view name, double number) : key(name), quoted(!std::isfinite(number)) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", number);
  value = text.data();
}

void configure(Format format, Level level) {
  Sink& shared = sink();
  auto logger = make_logger(format, level);
  const std::lock_guard lock(shared.mutex);
  shared.logger = std::move(logger);
  shared.format = format;
}

std::optional<Level> parse_level(std::string_view name) {
  for (std::size_t i = 0; i < level_names.size(); ++i) {
    if (level_names[i] == name) return static_cast<Level>(i);
  }
  return std::nullopt;
}

std::string text_line(std::string_view message, Fields fields) {
  std::string line = printable(message, message_bytes_max);
  for (const Field& field : fields) {
    const std::string value = printable(field.value, value_bytes_max);
    line += ' ';
    line += field.key;
    line += '=';
    line += is_one_word(value) ? value : quoted(value);
  }
  return line;
}

std::string json_line(std::string_view time, Level level, std::string_view message, Fields fields) {
  std::string line = "{\"time\":" + quoted(time) +
                     ",\"level\":" + quoted(level_names[static_cast<std::size_t>(level)]) +
                     ",\"message\":" + quoted(printable(message, message_bytes_max));
  for (const Field& field : fields) {
    const std::string value = printable(field.value, value_bytes_max);
    line += ',' + quoted(field.key) + ':' + (field.quoted ? quoted(value) : value);
  }
  return line + '}';
}

namespace {

void write_line(Level level, std::string_view message, Fields fields) {
  Sink& shared = sink();
  std::shared_ptr<spdlog::logger> logger;
  Format format = Format::text;
  {
    const std::lock_guard lock(shared.mutex);
    logger = shared.logger;
    format = shared.format;
  }
  if (!logger->should_log(spdlog_level(level))) return;
  const std::string line = format == Format::json ? json_line(now_utc(), level, message, fields)
                                                  : text_line(message, fields);
  logger->log(spdlog_level(level), spdlog::string_view_t(line));
}

}  // namespace

void write(Level level, std::string_view message, Fields fields) {
  try {
    write_line(level, message, fields);
  } catch (const std::exception&) {
    // Allocation failed: logging an error must not itself throw.
    constexpr std::string_view lost = "log line lost: out of memory\n";
    (void)std::fwrite(lost.data(), 1, lost.size(), stderr);
  }
}

}  // namespace windsplat::log
