// Construction of errors, and the exception for misuse of a Result.
#include "server/base/error.hpp"

#include <array>
#include <cstdio>
#include <stdexcept>
#include <string_view>

namespace windsplat {

void throw_exception_from_error(const Error& error, const boost::source_location& where) {
  throw std::logic_error(std::string(where.file_name()) + ":" + std::to_string(where.line()) +
                         ": value() of a failed Result: " + error.message);
}

Error make_error_at(ErrorKind kind, std::string pointer, std::string detail) {
  std::string message = (pointer.empty() ? "the document" : printable(pointer)) + ": " + detail;
  Error error{kind, std::move(message), {}};
  error.at.push_back(FieldError{std::move(pointer), std::move(detail)});
  return error;
}

namespace {

// Length and code point of the well-formed UTF-8 sequence (Unicode table 3-7) at the start of
// `text`; length 0 if there is none.
struct Sequence {
  std::size_t bytes = 0;
  char32_t code = 0;
};

Sequence first_sequence(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return {1, lead};
  std::size_t bytes = 0;
  if (lead >= 0xc2 && lead <= 0xdf) bytes = 2;
  if (lead >= 0xe0 && lead <= 0xef) bytes = 3;
  if (lead >= 0xf0 && lead <= 0xf4) bytes = 4;
  if (bytes == 0 || text.size() < bytes) return {};
  char32_t code = lead & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if ((next & 0xc0U) != 0x80) return {};
    code = code << 6 | (next & 0x3fU);
  }
  const bool overlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  if (overlong || surrogate || code > 0x10ffff) return {};
  return {bytes, code};
}

bool shows_as_itself(char32_t code) {
  const bool control = code < 0x20 || (code >= 0x7f && code < 0xa0);
  const bool bidirectional = code == 0x061c || code == 0x200e || code == 0x200f ||
                             (code >= 0x202a && code <= 0x202e) ||
                             (code >= 0x2066 && code <= 0x2069);
  const bool line_break = code == 0x2028 || code == 0x2029;
  return !control && !bidirectional && !line_break;
}

std::string escaped(std::string_view bytes) {
  std::string out;
  for (const char byte : bytes) {
    std::array<char, 5> hex{};
    std::snprintf(hex.data(), hex.size(), "\\x%02x", static_cast<unsigned char>(byte));
    out += hex.data();
  }
  return out;
}

}  // namespace

std::string printable(std::string_view text, std::size_t bytes_max) {
  constexpr std::string_view cut = "...";
  std::string out;
  std::size_t fits = 0;  // length of `out` that leaves room for "..."
  while (!text.empty()) {
    const Sequence sequence = first_sequence(text);
    const std::string_view piece = text.substr(0, sequence.bytes == 0 ? 1 : sequence.bytes);
    const bool plain = sequence.bytes != 0 && shows_as_itself(sequence.code);
    out += plain ? std::string(piece) : escaped(piece);
    if (out.size() > bytes_max) {
      out.resize(fits);
      return out.append(cut.substr(0, bytes_max - fits));
    }
    if (out.size() + cut.size() <= bytes_max) fits = out.size();
    text.remove_prefix(piece.size());
  }
  return out;
}

std::string in_quotes(std::string_view name) {
  std::string out(1, '\'');
  out += printable(name);
  out += '\'';
  return out;
}

}  // namespace windsplat
