// JSON as a Zarr store has it: text of bounded depth -> a plain tree.
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
  double number = 0;        // of a boolean 0 or 1
  bool is_integer = false;  // a number written without fraction that fits `integer`
  std::int64_t integer = 0;
  std::string text;
  std::vector<Json> list;
  std::map<std::string, Json, std::less<>> object;

  // A member of an object; null where there is none, or where this is no object.
  [[nodiscard]] const Json* find(std::string_view key) const;
};

// Python writes NaN, Infinity and -Infinity bare, which JSON has not: they become texts. Errors:
// bad_data for what else is no JSON, repeats a key or is nested more than 32 levels deep.
Result<Json> parse_json(std::string_view text);

}  // namespace windsplat::data::zarr
