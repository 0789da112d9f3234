// A configuration file -> its entries, written and read again.
#include <algorithm>
#include <cstdint>
#include <string>

#include "protocol/config.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
using windsplat::protocol::Config;
using windsplat::protocol::ConfigEntry;

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + '"';
}

std::string value_of(const ConfigEntry& entry) {
  if (entry.kind == ConfigEntry::Kind::text) return quoted(entry.words.at(0));
  if (entry.kind != ConfigEntry::Kind::list) return entry.words.at(0);
  std::string out = "[";
  for (const std::string& word : entry.words) out += (out.size() > 1 ? "," : "") + quoted(word);
  return out + ']';
}

bool is_clean(const std::string& text) {
  return std::none_of(text.begin(), text.end(),
                      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
}

void expect_entries(const Config& config) {
  for (std::size_t i = 0; i < config.entries.size(); ++i) {
    const ConfigEntry& entry = config.entries[i];
    expect(i == 0 || config.entries[i - 1].key < entry.key, "keys are sorted and unique");
    expect(entry.kind == ConfigEntry::Kind::list || entry.words.size() == 1,
           "a value other than a list is one word", entry.key);
    expect(std::all_of(entry.words.begin(), entry.words.end(), is_clean),
           "a word has no control characters", entry.key);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto config = windsplat::protocol::parse_config(fuzz::text_of(data, size));
  if (!config) {
    expect(!config.error().message.empty(), "a refusal has a reason");
    return 0;
  }
  expect_entries(*config);
  std::string text = "{";
  bool keys_are_clean = true;
  for (const ConfigEntry& entry : config->entries) {
    keys_are_clean = keys_are_clean && is_clean(entry.key);
    text += (text.size() > 1 ? "," : "") + quoted(entry.key) + ':' + value_of(entry);
  }
  if (!keys_are_clean || text.size() > 60'000) return 0;
  const auto again = windsplat::protocol::parse_config(text + '}');
  expect(again.has_value(), "written entries can be read", text);
  expect(again->entries.size() == config->entries.size(), "written entries are complete", text);
  for (std::size_t i = 0; i < again->entries.size(); ++i) {
    expect(again->entries[i].key == config->entries[i].key &&
               again->entries[i].kind == config->entries[i].kind &&
               again->entries[i].words == config->entries[i].words,
           "written entries are unchanged", text);
  }
  return 0;
}
