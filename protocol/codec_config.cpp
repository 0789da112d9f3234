// Configuration file -> entries.
#include <algorithm>

#include "protocol/codec_json.hpp"
#include "protocol/config.hpp"

namespace windsplat::protocol {
namespace {

constexpr std::size_t config_text_bytes_max = 4096;
constexpr std::size_t config_list_max = 256;

void read_text(const Json& value, const std::string& pointer, Faults& faults, ConfigEntry& entry) {
  const auto& text = value.get_ref<const std::string&>();
  if (text.size() > config_text_bytes_max) {
    faults.add(pointer, "must have at most " + std::to_string(config_text_bytes_max) + " bytes");
  } else if (std::any_of(text.begin(), text.end(),
                         [](unsigned char c) { return c < 0x20 || c == 0x7f; })) {
    faults.add(pointer, "must not contain control characters");
  } else {
    entry.words.push_back(text);
  }
}

void read_list(const Json& value, const std::string& pointer, Faults& faults, ConfigEntry& entry) {
  entry.kind = ConfigEntry::Kind::list;
  if (value.size() > config_list_max) {
    faults.add(pointer, "must have at most " + std::to_string(config_list_max) + " elements");
    return;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string at = join_pointer(pointer, i);
    if (value[i].is_string()) {
      read_text(value[i], at, faults, entry);
    } else {
      faults.add(at, "must be a string, not " + described(value[i]));
    }
  }
}

ConfigEntry read_entry(const std::string& key, const Json& value, Faults& faults) {
  const std::string pointer = join_pointer("", key);
  ConfigEntry entry{key, ConfigEntry::Kind::text, {}};
  if (value.is_string()) {
    read_text(value, pointer, faults, entry);
  } else if (value.is_boolean()) {
    entry.kind = ConfigEntry::Kind::boolean;
    entry.words.emplace_back(value.get<bool>() ? "true" : "false");
  } else if (value.is_number()) {
    entry.kind = ConfigEntry::Kind::number;
    entry.words.push_back(
        dump(value.is_number_float() ? canonical_number(value.get<double>()) : value));
  } else if (value.is_array()) {
    read_list(value, pointer, faults, entry);
  } else {
    faults.add(pointer, "must be a string, a number, true, false or a list of strings, not " +
                            described(value));
  }
  return entry;
}

}  // namespace

Result<Config> parse_config(std::string_view json) {
  const auto tree = parse_json(json);
  if (!tree) return tree.error();
  if (!tree->is_object()) {
    return make_error_at(ErrorKind::invalid, "", "must be an object, not " + described(*tree));
  }
  Faults faults;
  Config config;
  for (const auto& [key, value] : tree->items()) {
    config.entries.push_back(read_entry(key, value, faults));
  }
  if (!faults.empty()) return faults.error();
  return config;
}

Error config_error(const std::string& key, std::string detail) {
  return make_error_at(ErrorKind::invalid, join_pointer("", key), std::move(detail));
}

}  // namespace windsplat::protocol
