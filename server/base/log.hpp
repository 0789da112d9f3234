// The log of the program: one line per event to stderr, as text or JSON lines. Messages and values
// are escaped and truncated here. Thread-safe.
#pragma once

#include <concepts>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

namespace windsplat::log {

enum class Format { text, json };
enum class Level { debug, info, warn, error, off };

// A key with a value: {"peer", address}, {"ms", 12.5}. Keys are trusted, values are not.
struct Field {
  std::string_view key;
  std::string value;
  bool quoted = true;  // false: a number or a boolean

  Field(std::string_view name, std::string_view text) : key(name), value(text) {}
  Field(std::string_view name, const char* text) : key(name), value(text) {}
  Field(std::string_view name, const std::string& text) : key(name), value(text) {}
  Field(std::string_view name, bool flag)
      : key(name), value(flag ? "true" : "false"), quoted(false) {}
  template <std::integral T>
  Field(std::string_view name, T number)
      : key(name), value(std::to_string(number)), quoted(false) {}
  Field(std::string_view name, double number);  // quoted if JSON cannot represent it
};
using Fields = std::initializer_list<Field>;

// Until called: text, level info. Text is coloured on a terminal, unless NO_COLOR is set.
void configure(Format format, Level level);
std::optional<Level> parse_level(std::string_view name);  // debug, info, warn, error, off

void write(Level level, std::string_view message, Fields fields = {});
inline void debug(std::string_view message, Fields fields = {}) {
  write(Level::debug, message, fields);
}
inline void info(std::string_view message, Fields fields = {}) {
  write(Level::info, message, fields);
}
inline void warn(std::string_view message, Fields fields = {}) {
  write(Level::warn, message, fields);
}
inline void error(std::string_view message, Fields fields = {}) {
  write(Level::error, message, fields);
}

// The line of an event, in text format without time and level; also for tests.
//   text: message key=value key="two words"
//   JSON: {"time":"2026-01-02T03:04:05.678Z","level":"info","message":"...","key":"value"}
std::string text_line(std::string_view message, Fields fields);
std::string json_line(std::string_view time, Level level, std::string_view message, Fields fields);

}  // namespace windsplat::log
