// Resident bytes by level: variants of keys say which level they are of.
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "server/data/resident/budget.hpp"

namespace windsplat::data {

namespace {

constexpr std::string_view level_word = "level ";

// nullopt: the key is of no level.
std::optional<std::size_t> level_of(const ResidentKey& key) {
  std::string_view variant = std::get<3>(key);
  if (std::get<1>(key) == no_field) return std::nullopt;
  if (variant.empty() || variant == packed_variant) return 0;
  const bool is_part = variant.starts_with(part_variant);
  if (is_part) variant.remove_prefix(std::string_view(part_variant).size());
  if (!variant.starts_with(level_word)) {
    return is_part ? std::optional(std::size_t{0}) : std::nullopt;
  }
  variant.remove_prefix(level_word.size());
  std::size_t level = 0;
  const auto read = std::from_chars(variant.data(), variant.data() + variant.size(), level);
  return read.ec == std::errc() ? std::optional(level) : std::nullopt;
}

}  // namespace

std::string level_variant(std::size_t level) {
  return std::string(level_word) + std::to_string(level) + ' ';
}

std::vector<std::uint64_t> Budget::bytes_of_levels(std::uint64_t owner, std::size_t levels) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::uint64_t> bytes(levels);
  for (auto at = entries_.lower_bound({owner, 0, 0, ""});
       at != entries_.end() && std::get<0>(at->first) == owner; ++at) {
    const auto level = level_of(at->first);
    if (level && *level < levels && at->second->listed) bytes[*level] += at->second->bytes;
  }
  return bytes;
}

}  // namespace windsplat::data
