// std::from_chars does not depend on the locale.
#include "server/data/bytes/text.hpp"

#include <charconv>
#include <limits>

#include "server/base/ascii.hpp"

namespace windsplat::data::bytes {

namespace {

template <class Number>
std::optional<Number> to_number(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  Number out{};
  const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (fault != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return out;
}

}  // namespace

std::vector<std::string_view> words_of(std::string_view text) {
  std::vector<std::string_view> out;
  for (;;) {
    text = trim(text);
    if (text.empty()) return out;
    std::size_t end = 0;
    while (end < text.size() && !is_blank(text[end])) ++end;
    out.push_back(text.substr(0, end));
    text.remove_prefix(end);
  }
}

std::optional<double> to_double(std::string_view text) { return to_number<double>(text); }

std::optional<std::int64_t> to_integer(std::string_view text) {
  return to_number<std::int64_t>(text);
}

std::optional<double> to_sample(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (stop != text.data() + text.size() || text.empty()) return {};
  if (fault == std::errc()) return value;
  if (fault != std::errc::result_out_of_range) return {};
  const auto exponent = text.find_first_of("eE");
  const bool small =
      exponent != std::string_view::npos && text.substr(exponent + 1).starts_with('-');
  const double size = small ? 0.0 : std::numeric_limits<double>::infinity();
  return text.starts_with('-') ? -size : size;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char lower = static_cast<char>(c | 0x20);
  return lower >= 'a' && lower <= 'f' ? lower - 'a' + 10 : -1;
}

std::optional<std::string> numbered_name(std::string_view pattern, std::int64_t number) {
  const std::size_t from = pattern.find('%');
  if (from == std::string_view::npos) return std::nullopt;
  std::size_t at = from + 1;
  const bool zeros = at < pattern.size() && pattern[at] == '0';
  std::size_t width = 0;
  for (; at < pattern.size() && pattern[at] >= '0' && pattern[at] <= '9' && width < 100; ++at) {
    width = width * 10 + static_cast<std::size_t>(pattern[at] - '0');
  }
  const bool understood = at < pattern.size() && pattern[at] == 'd' && width <= 20 &&
                          pattern.find('%', at) == std::string_view::npos;
  if (!understood) return std::nullopt;
  std::string digits = std::to_string(number < 0 ? -number : number);
  const std::size_t sign = number < 0 ? 1 : 0;
  if (zeros && digits.size() + sign < width) digits.insert(0, width - sign - digits.size(), '0');
  if (sign != 0) digits.insert(0, 1, '-');
  if (digits.size() < width) digits.insert(0, width - digits.size(), ' ');
  std::string out(pattern.substr(0, from));
  out += digits;
  out += pattern.substr(at + 1);
  return out;
}

}  // namespace windsplat::data::bytes
