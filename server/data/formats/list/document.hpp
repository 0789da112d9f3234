// The JSON text that lists the files of one dataset (docs/user/formats.md) -> plain data.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/input_file.hpp"
#include "server/data/files/selection.hpp"

namespace windsplat::data::list {

inline constexpr std::size_t parts_max = 64;

struct Document {
  std::string title;
  std::vector<std::string> files;  // 1 to parts_max names or patterns, relative to the folder
  std::string group;               // without the leading '/'; empty: none
  Selection selection;
};

// Whether the first bytes are a JSON object with "windsplat": "files".
bool looks_like(std::string_view head);

// Errors: bad_data with the JSON pointer of the invalid value.
Result<Document> parse_document(const InputFile& file);
// The same for a text without a file, in which the key "windsplat" may be absent.
Result<Document> parse_document(std::string_view text);

}  // namespace windsplat::data::list
