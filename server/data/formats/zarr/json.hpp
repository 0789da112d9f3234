// JSON of a Zarr store: text of bounded depth -> a tree.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data::zarr {

struct Json {
  enum class Kind { null, boolean, number, text, list, object };
  Kind kind = Kind::null;
  double number = 0;        // for a boolean 0 or 1
  bool is_integer = false;  // a number written without fraction that fits `integer`
  std::int64_t integer = 0;
  std::string text = {};
  std::vector<Json> list = {};
  std::map<std::string, Json, std::less<>> object = {};

  // A member of an object; null if it is absent or this is not an object.
  [[nodiscard]] const Json* find(std::string_view key) const;
  // The text of a member; empty if it is absent or not text.
  [[nodiscard]] std::string text_at(std::string_view key) const;
};

// Accepts the unquoted NaN, Infinity and -Infinity of Python as strings. Errors: bad_data for other
// invalid JSON, duplicate keys, or more than 32 levels of nesting.
Result<Json> parse_json(std::string_view text);

}  // namespace windsplat::data::zarr
