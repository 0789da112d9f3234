#include "support.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "protocol/messages.hpp"

namespace windsplat::protocol::testing {

namespace {

const Json& schema_file(const std::string& name) {
  static std::map<std::string, Json> files;
  const auto found = files.find(name);
  if (found != files.end()) return found->second;
  return files.emplace(name, read_protocol_json(name)).first->second;
}

class Validator {
 public:
  void check(const std::string& file, const Json& schema, const Json& value,
             const std::string& at) {
    for (const auto& [keyword, rule] : schema.items()) {
      check_keyword(file, schema, keyword, rule, value, at);
    }
  }
  std::vector<std::string> complaints;

 private:
  void complain(const std::string& at, const std::string& what) {
    complaints.push_back(at + ": " + what);
  }

  void check_keyword(const std::string& file, const Json& schema, const std::string& keyword,
                     const Json& rule, const Json& value, const std::string& at) {
    static const std::set<std::string> annotations{"$schema", "$id",         "$defs",
                                                   "title",   "description", "default"};
    if (annotations.contains(keyword)) return;
    if (keyword == "$ref") return follow(file, rule, value, at);
    if (keyword == "anyOf" || keyword == "oneOf") return branches(file, keyword, rule, value, at);
    if (keyword == "type") return check_type(rule, value, at);
    if (keyword == "enum") {
      if (std::find(rule.begin(), rule.end(), value) == rule.end()) complain(at, "not in enum");
    } else if (keyword == "const") {
      if (value != rule) complain(at, "not the constant");
    } else if (keyword == "minimum") {
      if (value.is_number() && value.get<double>() < rule.get<double>()) complain(at, "minimum");
    } else if (keyword == "maximum") {
      if (value.is_number() && value.get<double>() > rule.get<double>()) complain(at, "maximum");
    } else if (keyword == "minLength" || keyword == "maxLength" || keyword == "pattern") {
      check_string(keyword, rule, value, at);
    } else if (keyword == "minItems") {
      if (value.is_array() && value.size() < rule.get<std::size_t>()) complain(at, "minItems");
    } else if (keyword == "maxItems") {
      if (value.is_array() && value.size() > rule.get<std::size_t>()) complain(at, "maxItems");
    } else if (keyword == "minProperties") {
      if (value.is_object() && value.size() < rule.get<std::size_t>()) complain(at, keyword);
    } else if (keyword == "maxProperties") {
      if (value.is_object() && value.size() > rule.get<std::size_t>()) complain(at, keyword);
    } else if (keyword == "items" || keyword == "prefixItems") {
      check_items(file, schema, keyword, rule, value, at);
    } else if (keyword == "required") {
      if (!value.is_object()) return;
      for (const auto& key : rule) {
        if (!value.contains(key)) complain(under(at, key.get<std::string>()), "required");
      }
    } else if (keyword == "properties" || keyword == "additionalProperties") {
      check_members(file, schema, keyword, rule, value, at);
    } else {
      complain(at, "the schema has " + keyword + ", which this validator does not support");
    }
  }

  void follow(const std::string& file, const std::string& target, const Json& value,
              const std::string& at) {
    const auto hash = target.find('#');
    const std::string name = hash == 0 ? file : target.substr(0, hash);
    const std::string inner = hash == std::string::npos ? "" : target.substr(hash + 1);
    check(name, schema_file(name).at(Json::json_pointer(inner)), value, at);
  }

  void branches(const std::string& file, const std::string& keyword, const Json& rule,
                const Json& value, const std::string& at) {
    std::size_t passed = 0;
    std::vector<std::string> nearest;
    for (const Json& branch : rule) {
      Validator inner;
      inner.check(file, branch, value, at);
      if (inner.complaints.empty()) ++passed;
      nearest.insert(nearest.end(), inner.complaints.begin(), inner.complaints.end());
    }
    if (passed == 0 || (keyword == "oneOf" && passed > 1)) {
      complain(at, keyword + " passed by " + std::to_string(passed));
      complaints.insert(complaints.end(), nearest.begin(), nearest.end());
    }
  }

  void check_type(const Json& rule, const Json& value, const std::string& at) {
    const auto is = [&](const std::string& type) {
      if (type == "null") return value.is_null();
      if (type == "boolean") return value.is_boolean();
      if (type == "string") return value.is_string();
      if (type == "array") return value.is_array();
      if (type == "object") return value.is_object();
      if (type == "number") return value.is_number();
      return type == "integer" && value.is_number() &&
             std::trunc(value.get<double>()) == value.get<double>();
    };
    const bool good = rule.is_array() ? std::any_of(rule.begin(), rule.end(),
                                                    [&](const Json& type) { return is(type); })
                                      : is(rule);
    if (!good) complain(at, "not of type " + rule.dump());
  }

  void check_string(const std::string& keyword, const Json& rule, const Json& value,
                    const std::string& at) {
    if (!value.is_string()) return;
    const auto& text = value.get_ref<const std::string&>();
    if (keyword != "pattern") {
      const auto chars = static_cast<std::size_t>(std::count_if(
          text.begin(), text.end(), [](char c) { return (static_cast<int>(c) & 0xc0) != 0x80; }));
      const auto limit = rule.get<std::size_t>();
      if (keyword == "minLength" ? chars < limit : chars > limit) complain(at, keyword);
      return;
    }
    if (rule == R"(^[^\u0000-\u001f\u007f]*$)") {
      for (const char c : text) {
        if ((c >= 0 && c < 0x20) || c == 0x7f) return complain(at, "pattern");
      }
      return;
    }
    const bool upper = rule == "^#[0-9a-fA-F]{6}$";
    if (!upper && rule != "^#[0-9a-f]{6}$") {
      if (!std::regex_search(text, std::regex(rule.get<std::string>()))) complain(at, "pattern");
      return;
    }
    const std::string digits = upper ? "0123456789abcdefABCDEF" : "0123456789abcdef";
    if (text.size() != 7 || text[0] != '#' ||
        text.find_first_not_of(digits, 1) != std::string::npos) {
      complain(at, "pattern");
    }
  }

  void check_items(const std::string& file, const Json& schema, const std::string& keyword,
                   const Json& rule, const Json& value, const std::string& at) {
    if (!value.is_array()) return;
    const std::size_t prefix = schema.contains("prefixItems") ? schema["prefixItems"].size() : 0;
    const bool is_prefix = keyword == "prefixItems";
    for (std::size_t i = is_prefix ? 0 : prefix; i < value.size(); ++i) {
      if (is_prefix && i >= prefix) break;
      check(file, is_prefix ? rule[i] : rule, value[i], under(at, std::to_string(i)));
    }
  }

  void check_members(const std::string& file, const Json& schema, const std::string& keyword,
                     const Json& rule, const Json& value, const std::string& at) {
    if (!value.is_object()) return;
    for (const auto& [key, member] : value.items()) {
      const bool known = schema.contains("properties") && schema["properties"].contains(key);
      const std::string member_at = under(at, key);
      if (keyword == "properties") {
        if (known) check(file, rule[key], member, member_at);
      } else if (!known && rule.is_boolean()) {
        if (!rule.get<bool>()) complain(member_at, "unknown key");
      } else if (!known) {
        check(file, rule, member, member_at);
      }
    }
  }
};

}  // namespace

std::string read_protocol_file(const std::string& name) {
  std::ifstream file(std::string(WINDSPLAT_SOURCE_DIR "/protocol/") + name, std::ios::binary);
  EXPECT_TRUE(file.good()) << name;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

Json read_protocol_json(const std::string& name) { return Json::parse(read_protocol_file(name)); }

std::string bytes_from_hex(std::string_view hex) {
  std::string digits;
  for (const char c : hex) {
    if (c != ' ') digits += c;
  }
  std::string bytes;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
    bytes += static_cast<char>(std::stoi(digits.substr(i, 2), nullptr, 16));
  }
  return bytes;
}

std::string Vector::name() const { return file + ": " + body.at("description").get<std::string>(); }

std::string Vector::text() const {
  if (body.contains("text")) return body["text"];
  if (body.contains("bytes")) return bytes_from_hex(body["bytes"].get<std::string>());
  return body.at("document").dump();
}

std::vector<Vector> read_vectors(const std::string& folder) {
  std::vector<Vector> out;
  const std::string inner = "vectors/" + folder;
  const std::string root = WINDSPLAT_SOURCE_DIR "/protocol/";
  for (const auto& entry : std::filesystem::directory_iterator(root + inner)) {
    const std::string name = under(inner, entry.path().filename().string());
    for (const Json& body : read_protocol_json(name)) out.push_back(Vector{name, body});
  }
  EXPECT_GT(out.size(), 40U) << folder;
  return out;
}

std::vector<std::string> schema_complaints(const std::string& file, const std::string& pointer,
                                           const Json& document) {
  Validator validator;
  validator.check(file, Json{{"$ref", file + pointer}}, document, "");
  return validator.complaints;
}

std::string under(const std::string& pointer, const std::string& key) {
  std::string out = pointer;
  out += '/';
  out += key;
  return out;
}

int status_of(const Error& error) { return problem_from(error).status; }

void expect_shape(const std::string& shape, const std::string& json) {
  EXPECT_THAT(schema_complaints("messages.schema.json", "#/$defs/" + shape, Json::parse(json)),
              ::testing::IsEmpty())
      << json;
}

}  // namespace windsplat::protocol::testing
