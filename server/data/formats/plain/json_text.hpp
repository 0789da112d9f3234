// JSON in files -> checked values: limits on size and depth, no duplicate or unknown keys. Faults
// are thrown as `Refused` and become errors in parse().
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::json_text {

using Json = nlohmann::json;

struct Refused {
  std::string what;
};
// Throws Refused; an empty pointer is the document itself.
[[noreturn]] void refuse(const std::string& pointer, const std::string& what);

// Parses the text and calls `use`, which may throw Refused. Errors: bad_data, whose message is
// a predicate ("is invalid: /files: ...").
Result<void> parse(std::string_view text, const std::function<void(const Json&)>& use);

// The shortest decimal text that reads back as the same number.
std::string number_text(double value);

// An object and its JSON pointer. Values of other types or lengths are refused.
class Object {
 public:
  Object(const Json& value, std::string pointer, std::initializer_list<std::string_view> keys);

  [[nodiscard]] std::string below(const std::string& key) const { return pointer_ + '/' + key; }
  [[nodiscard]] bool has(const char* key) const { return value_.contains(key); }
  [[nodiscard]] const Json& at(const char* key) const;

  [[nodiscard]] std::string text(const char* key, const std::string& otherwise) const;
  [[nodiscard]] std::int64_t integer(const char* key, std::int64_t least, std::int64_t most) const;
  [[nodiscard]] std::int64_t integer(const char* key, std::int64_t least, std::int64_t most,
                                     std::int64_t otherwise) const;
  [[nodiscard]] double number(const char* key, double otherwise) const;

  static std::string text_of(const Json& value, const std::string& pointer);
  static std::int64_t integer_of(const Json& value, const std::string& pointer, std::int64_t least,
                                 std::int64_t most);
  static double number_of(const Json& value, const std::string& pointer);
  static std::vector<double> numbers_of(const Json& value, const std::string& pointer,
                                        std::size_t most);

 private:
  const Json& value_;
  std::string pointer_;
};

}  // namespace windsplat::data::json_text
