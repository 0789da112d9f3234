#include "server/data/fetch/content_range.hpp"

#include <algorithm>
#include <charconv>

namespace windsplat::data::fetch {

std::optional<ContentRange> parse_content_range(std::string_view text) {
  constexpr std::string_view unit = "bytes ";
  if (!text.starts_with(unit)) return {};
  text.remove_prefix(unit.size());
  ContentRange out;
  const auto take = [&text](std::uint64_t& number, std::string_view end) {
    const auto [at, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
    text.remove_prefix(static_cast<std::size_t>(at - text.data()));
    const bool sound = fault == std::errc() && text.starts_with(end);
    if (sound) text.remove_prefix(end.size());
    return sound;
  };
  const bool sound = take(out.first, "-") && take(out.last, "/") && take(out.total, "");
  return sound && text.empty() ? std::optional(out) : std::nullopt;
}

std::optional<std::uint64_t> bytes_of_part(std::string_view text, std::uint64_t first,
                                           std::uint64_t count, std::uint64_t total) {
  const auto got = parse_content_range(text);
  if (!got || (total != 0 && got->total != total) || first >= got->total) return {};
  const std::uint64_t bytes = std::min(count, got->total - first);
  const bool is_wanted = bytes > 0 && got->first == first && got->last == first + bytes - 1;
  return is_wanted ? std::optional(bytes) : std::nullopt;
}

}  // namespace windsplat::data::fetch
