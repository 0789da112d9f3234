// JSON tree -> typed values: every type and range is checked before a value is taken.
#include <algorithm>
#include <cmath>

#include "protocol/codec_json.hpp"
#include "protocol/limits.hpp"
#include "server/base/nearest_word.hpp"

namespace windsplat::protocol {

namespace {

std::string range_text(NumberRange range) {
  return dump(canonical_number(range.min)) + " to " + dump(canonical_number(range.max));
}

std::size_t count_chars(std::string_view utf8) {
  return static_cast<std::size_t>(std::count_if(utf8.begin(), utf8.end(), [](char c) {
    return (static_cast<unsigned char>(c) & 0xc0U) != 0x80U;
  }));
}

bool has_control(std::string_view text) {
  return std::any_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7f;
  });
}

bool is_color(std::string_view text) {
  constexpr std::string_view digits = "0123456789abcdefABCDEF";
  return text.size() == 7 && text[0] == '#' &&
         text.substr(1).find_first_not_of(digits) == std::string_view::npos;
}

// An integer that fits 64 bits, in any notation (12, 12.0, 1.2e1).
std::optional<std::int64_t> whole(const Json& value) {
  if (value.is_number_unsigned()) {
    const auto raw = value.get<std::uint64_t>();
    if (raw > static_cast<std::uint64_t>(INT64_MAX)) return std::nullopt;
    return static_cast<std::int64_t>(raw);
  }
  if (value.is_number_integer()) return value.get<std::int64_t>();
  if (!value.is_number_float()) return std::nullopt;
  const auto raw = value.get<double>();
  if (std::trunc(raw) != raw || std::abs(raw) >= 9.2e18) return std::nullopt;
  return static_cast<std::int64_t>(raw);
}

}  // namespace

std::optional<double> read_number(const Json& value, const std::string& pointer, NumberRange range,
                                  Faults& faults) {
  if (value.is_number()) {
    const auto number = value.get<double>();
    if (number >= range.min && number <= range.max) return number + 0.0;  // no minus zero
  }
  faults.add(pointer, "must be a number from " + range_text(range) + ", not " + described(value));
  return std::nullopt;
}

ObjectReader::ObjectReader(const Json& value, std::string pointer, Faults& faults)
    : pointer_(std::move(pointer)), faults_(faults) {
  if (value.is_object()) {
    value_ = &value;
  } else {
    faults_.add(pointer_, "must be an object, not " + described(value));
  }
}

const Json* ObjectReader::child(const char* key, Presence presence, Null null) {
  asked_.emplace_back(key);
  if (value_ == nullptr) return nullptr;
  const auto found = value_->find(key);
  if (found == value_->end()) {
    if (presence == Presence::required) faults_.add(at(key), "is required");
    return nullptr;
  }
  if (found->is_null() && null == Null::is_default) return nullptr;
  return &*found;
}

void ObjectReader::boolean(const char* key, bool& out, Presence presence) {
  const Json* value = child(key, presence);
  if (value == nullptr) return;
  if (value->is_boolean()) {
    out = value->get<bool>();
  } else {
    faults_.add(at(key), "must be true or false, not " + described(*value));
  }
}

void ObjectReader::number(const char* key, double& out, NumberRange range) {
  if (const Json* value = child(key)) {
    if (const auto read = read_number(*value, at(key), range, faults_)) out = *read;
  }
}

void ObjectReader::number(const char* key, std::optional<double>& out, NumberRange range) {
  if (const Json* value = child(key, Presence::optional, Null::is_default)) {
    if (const auto read = read_number(*value, at(key), range, faults_)) out = read;
  }
}

void ObjectReader::text(const char* key, std::string& out, std::size_t chars_min, Presence presence,
                        std::size_t chars_max) {
  if (const Json* value = child(key, presence)) {
    if (auto read = read_text(*value, at(key), chars_min, chars_max)) out = std::move(*read);
  }
}

void ObjectReader::text(const char* key, std::optional<std::string>& out, std::size_t chars_min) {
  if (const Json* value = child(key, Presence::optional, Null::is_default)) {
    if (auto read = read_text(*value, at(key), chars_min)) out = std::move(read);
  }
}

void ObjectReader::color(const char* key, std::string& out) {
  const Json* value = child(key);
  if (value == nullptr) return;
  if (value->is_string() && is_color(value->get_ref<const std::string&>())) {
    out = value->get<std::string>();
  } else {
    faults_.add(at(key), "must be a colour written #rrggbb, not " + described(*value));
  }
}

void ObjectReader::color(const char* key, std::optional<std::string>& out) {
  const Json* value = child(key, Presence::optional, Null::is_default);
  if (value == nullptr) return;
  std::string read;
  const std::size_t before = faults_.count();
  color(key, read);
  if (faults_.count() == before) out = read;
}

bool ObjectReader::read_number_array(const Json& value, const std::string& pointer,
                                     NumberRange range, double* out, std::size_t count) {
  if (!value.is_array() || value.size() != count) {
    faults_.add(pointer,
                "must be an array of " + std::to_string(count) + " numbers, not " +
                    (value.is_array() ? "of " + std::to_string(value.size()) : described(value)));
    return false;
  }
  bool good = true;
  for (std::size_t i = 0; i < count; ++i) {
    const auto read = read_number(value[i], join_pointer(pointer, i), range, faults_);
    if (read) out[i] = *read;
    good = good && read;
  }
  return good;
}

std::optional<std::int64_t> ObjectReader::read_integer(const Json& value,
                                                       const std::string& pointer,
                                                       IntegerRange range) {
  const auto number = whole(value);
  if (number && *number >= range.min && *number <= range.max) return number;
  faults_.add(pointer, "must be a whole number from " + std::to_string(range.min) + " to " +
                           std::to_string(range.max) + ", not " + described(value));
  return std::nullopt;
}

std::optional<std::size_t> ObjectReader::read_name(const Json& value, const std::string& pointer,
                                                   std::span<const std::string_view> names) {
  std::string list;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (value.is_string() && value.get_ref<const std::string&>() == names[i]) return i;
    list += (i == 0 ? "\"" : ", \"") + std::string(names[i]) + "\"";
  }
  std::string meant;
  if (value.is_string()) {
    meant = did_you_mean(value.get_ref<const std::string&>(), {names.begin(), names.end()});
  }
  faults_.add(pointer, (names.size() == 1 ? "must be " : "must be one of ") + list + ", not " +
                           described(value) + meant);
  return std::nullopt;
}

std::optional<std::string> ObjectReader::read_text(const Json& value, const std::string& pointer,
                                                   std::size_t chars_min, std::size_t chars_max) {
  if (!value.is_string()) {
    faults_.add(pointer, "must be a string, not " + described(value));
    return std::nullopt;
  }
  const auto& text = value.get_ref<const std::string&>();
  const std::size_t chars = count_chars(text);
  if (chars < chars_min || chars > chars_max) {
    faults_.add(pointer, "must have " + std::to_string(chars_min) + " to " +
                             std::to_string(chars_max) + " characters, not " +
                             std::to_string(chars));
    return std::nullopt;
  }
  if (has_control(text)) {
    faults_.add(pointer, "must not contain control characters: " + described(value));
    return std::nullopt;
  }
  return text;
}

std::string ObjectReader::known_keys() const {
  std::string list;
  for (auto key = asked_.begin(); key != asked_.end(); ++key) {
    if (std::find(asked_.begin(), key, *key) != key) continue;
    list.append(list.empty() ? "" : ", ").append(*key);
  }
  return list;
}

void ObjectReader::finish() {
  if (value_ == nullptr) return;
  for (const auto& member : value_->items()) {
    const std::string& key = member.key();
    if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) {
      const std::vector<std::string> known(asked_.begin(), asked_.end());
      const std::string meant = did_you_mean(key, known);
      faults_.add(join_pointer(pointer_, key),
                  "unknown key" + (meant.empty() ? "; known keys: " : meant + " Known keys: ") +
                      known_keys());
    }
  }
}

}  // namespace windsplat::protocol
