// Internal to the codec: untrusted text -> a JSON tree within the limits of the protocol, and
// readers that extract typed, range-checked values. Faults are collected with JSON pointers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "protocol/codec_tree.hpp"
#include "protocol/limits.hpp"
#include "protocol/view.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

// Errors: too_large (over message_bytes_max), malformed (syntax, UTF-8, NUL, byte order mark,
// nesting, duplicate keys), invalid (a number beyond the range of double).
Result<Json> parse_json(std::string_view text);

// Serialises without spaces, with sorted keys, with invalid UTF-8 replaced and non-finite numbers
// as null.
std::string dump(const Json& value);

// The canonical form of a number: an integer if it is one exactly; no negative zero.
Json canonical_number(double value);
Json number_or_null(const std::optional<double>& value);
Json numbers_json(const std::vector<double>& values);
// Makes all numbers of a tree canonical.
void make_numbers_canonical(Json& value);

// pointer + "/" + key, escaped by RFC 6901; long or unprintable keys are shortened to a printable
// token.
std::string join_pointer(const std::string& pointer, std::string_view key);
std::string join_pointer(const std::string& pointer, std::size_t index);

// Invalid values in the order found. A response lists at most problem_errors_max of them.
class Faults {
 public:
  void add(std::string pointer, std::string detail, ErrorKind kind = ErrorKind::invalid);
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] std::size_t count() const { return count_; }
  // The message is that of the first fault; kind `invalid` has precedence over `too_large`.
  // Requires at least one fault.
  [[nodiscard]] Error error() const;

 private:
  std::vector<FieldError> at_;
  std::size_t count_ = 0;
  ErrorKind kind_ = ErrorKind::too_large;
};

enum class Presence { optional, required };
enum class Null { refused, is_default };  // is_default: as if the key were absent

struct NumberRange {
  double min;
  double max;
};
struct IntegerRange {
  std::int64_t min;
  std::int64_t max;
};

// Names of the values of an enumeration in JSON.
template <class E>
struct Name {
  E value;
  const char* text;
};

// Reads one JSON object by key. An invalid value is recorded and leaves `out` unchanged. finish()
// records unknown keys.
class ObjectReader {
 public:
  ObjectReader(const Json& value, std::string pointer, Faults& faults);

  // The value at `key`, or null if it is absent.
  const Json* child(const char* key, Presence presence = Presence::optional,
                    Null null = Null::refused);

  void boolean(const char* key, bool& out, Presence presence = Presence::optional);
  void number(const char* key, double& out, NumberRange range);
  void number(const char* key, std::optional<double>& out, NumberRange range);
  void text(const char* key, std::string& out, std::size_t chars_min,
            Presence presence = Presence::optional, std::size_t chars_max = limits::name_chars_max);
  void text(const char* key, std::optional<std::string>& out, std::size_t chars_min);
  void color(const char* key, std::string& out);
  void color(const char* key, std::optional<std::string>& out);

  template <class Int>
  void integer(const char* key, Int& out, IntegerRange range,
               Presence presence = Presence::optional) {
    if (const Json* value = child(key, presence)) {
      if (const auto read = read_integer(*value, at(key), range)) out = static_cast<Int>(*read);
    }
  }
  template <class Int>
  void integer(const char* key, std::optional<Int>& out, IntegerRange range) {
    if (const Json* value = child(key, Presence::optional, Null::is_default)) {
      if (const auto read = read_integer(*value, at(key), range)) out = static_cast<Int>(*read);
    }
  }
  template <std::size_t N>
  void numbers(const char* key, std::array<double, N>& out, NumberRange range) {
    if (const Json* value = child(key)) read_numbers(*value, at(key), range, out);
  }
  template <std::size_t N>
  void numbers(const char* key, std::optional<std::array<double, N>>& out, NumberRange range) {
    if (const Json* value = child(key, Presence::optional, Null::is_default)) {
      std::array<double, N> read{};
      if (read_numbers(*value, at(key), range, read)) out = read;
    }
  }
  template <class E, std::size_t N>
  void choice(const char* key, E& out, const std::array<Name<E>, N>& names,
              Presence presence = Presence::optional) {
    if (const Json* value = child(key, presence)) {
      if (const auto index = read_name(*value, at(key), texts(names))) out = names[*index].value;
    }
  }
  template <class E, std::size_t N>
  void choice(const char* key, std::optional<E>& out, const std::array<Name<E>, N>& names) {
    if (const Json* value = child(key, Presence::optional, Null::is_default)) {
      if (const auto index = read_name(*value, at(key), texts(names))) out = names[*index].value;
    }
  }

  std::optional<std::string> read_text(const Json& value, const std::string& pointer,
                                       std::size_t chars_min,
                                       std::size_t chars_max = limits::name_chars_max);
  [[nodiscard]] std::string at(const char* key) const { return join_pointer(pointer_, key); }
  [[nodiscard]] const std::string& pointer() const { return pointer_; }
  Faults& faults() { return faults_; }

  void finish();  // records unknown keys as faults and lists the known ones

 private:
  [[nodiscard]] std::string known_keys() const;
  template <class E, std::size_t N>
  static std::array<std::string_view, N> texts(const std::array<Name<E>, N>& names) {
    std::array<std::string_view, N> out;
    for (std::size_t i = 0; i < N; ++i) out[i] = names[i].text;
    return out;
  }
  template <std::size_t N>
  bool read_numbers(const Json& value, const std::string& pointer, NumberRange range,
                    std::array<double, N>& out) {
    return read_number_array(value, pointer, range, out.data(), N);
  }
  bool read_number_array(const Json& value, const std::string& pointer, NumberRange range,
                         double* out, std::size_t count);
  std::optional<std::int64_t> read_integer(const Json& value, const std::string& pointer,
                                           IntegerRange range);
  std::optional<std::size_t> read_name(const Json& value, const std::string& pointer,
                                       std::span<const std::string_view> names);

  const Json* value_ = nullptr;  // null if the value is not an object
  std::string pointer_;
  Faults& faults_;
  std::vector<std::string_view> asked_;
};

// A number of an array or object, if it is within the range.
std::optional<double> read_number(const Json& value, const std::string& pointer, NumberRange range,
                                  Faults& faults);

// The JSON name of an enumeration value.
template <class E, std::size_t N>
const char* name_of(E value, const std::array<Name<E>, N>& names) {
  for (const Name<E>& name : names) {
    if (name.value == value) return name.text;
  }
  return "";
}

// Description of a value for error messages: a number or string itself, otherwise its type.
std::string described(const Json& value);

// Converts a document to a typed View with all checks; the result is valid only without faults.
View read_view(const Json& document, Faults& faults);
Json view_to_json(const View& view);  // every key

}  // namespace windsplat::protocol
