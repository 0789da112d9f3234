// A view under a short id, as a server keeps it and tells it. Mirrors messages.schema.json.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

// Five bits a character, without i, l, o and u (Crockford's base 32): fit for a URL, a file's name,
// and to be read aloud. 50 bits of chance are not found by trying.
inline constexpr std::string_view view_id_letters = "0123456789abcdefghjkmnpqrstvwxyz";
inline constexpr std::size_t view_id_chars = 10;
bool is_view_id(std::string_view text);

struct SavedView {
  std::string id;
  std::string created;  // UTC, "2001-01-01T03:00:00Z"
  ViewDocument view;
};

// What clients are told; `kept`: "memory" or "disk".
std::string encode_saved_view(const SavedView& saved, std::string_view kept);

// What is written to a file, and read back from one. Errors as for every parser, see codec.hpp.
std::string encode_view_file(const SavedView& saved);
Result<SavedView> parse_view_file(std::string_view json);

}  // namespace windsplat::protocol
