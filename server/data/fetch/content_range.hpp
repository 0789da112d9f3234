// The header Content-Range of an answer with a part of a file.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace windsplat::data::fetch {

struct ContentRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;
  std::uint64_t total = 0;
};

// "bytes 0-99/1000" (RFC 9110, 14.4). Empty: anything else, also if the total is unknown ('*').
std::optional<ContentRange> parse_content_range(std::string_view text);

// The number of bytes of an answer that has [first, first + count) of a file of `total` bytes (0:
// of any size), as far as the file has them. Empty: it has others, or none.
std::optional<std::uint64_t> bytes_of_part(std::string_view text, std::uint64_t first,
                                           std::uint64_t count, std::uint64_t total);

}  // namespace windsplat::data::fetch
