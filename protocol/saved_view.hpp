// A view stored by the server under a short id. Mirrors messages.schema.json.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "protocol/codec.hpp"
#include "server/base/error.hpp"

namespace windsplat::protocol {

// Crockford's base 32, without i, l, o and u: safe in URLs and file names, and unambiguous to read.
// Ids have 50 random bits, too many to guess.
inline constexpr std::string_view view_id_letters = "0123456789abcdefghjkmnpqrstvwxyz";
inline constexpr std::size_t view_id_chars = 10;
bool is_view_id(std::string_view text);

struct SavedView {
  std::string id;
  std::string created;  // UTC, "2001-01-01T03:00:00Z"
  ViewDocument view;
};

// The response to clients; `kept`: "memory" or "disk".
std::string encode_saved_view(const SavedView& saved, std::string_view kept);

// The file format of saved views. Errors of parsers: see codec.hpp.
std::string encode_view_file(const SavedView& saved);
Result<SavedView> parse_view_file(std::string_view json);

}  // namespace windsplat::protocol
