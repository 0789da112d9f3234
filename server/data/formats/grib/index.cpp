// Iterates over messages by total length, and over sections by section length.
#include "server/data/formats/grib/index.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <string_view>

#include "server/data/formats/grib/open.hpp"

namespace windsplat::data::grib {

namespace {

constexpr std::uint64_t message_bytes_max = std::uint64_t{1} << 30;
constexpr std::size_t fields_max = 1'000'000;
constexpr std::size_t heading_max = 128;
constexpr std::uint64_t gap_max = std::uint64_t{64} << 20;  // headings and padding
constexpr std::uint64_t window_bytes = 65536;

std::uint64_t big_endian(const unsigned char* at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | at[i];
  return value;
}

// Offset of the next "GRIB" at or after an offset; the size of the file if there is none. Errors:
// bad_data if there are more than gap_max bytes before it.
Result<std::uint64_t> next_message(const InputFile& input, std::uint64_t offset) {
  constexpr std::string_view mark = "GRIB";
  std::uint64_t reach = 16;  // most messages follow each other without a gap
  for (std::uint64_t at = offset; at < input.size();) {
    if (at - offset > gap_max) {
      return input.fault("has more than " + std::to_string(gap_max) +
                         " bytes that are no GRIB message after byte " + std::to_string(offset));
    }
    std::vector<char> window(std::min(input.size() - at, reach));
    if (auto done = input.read(at, window.data(), window.size()); !done) return done.error();
    const auto found = std::string_view(window.data(), window.size()).find(mark);
    if (found != std::string_view::npos) return at + found;
    if (window.size() < reach) break;  // the end of the file
    at += window.size() - (mark.size() - 1);
    reach = window_bytes;
  }
  return input.size();
}

// Sections 0 to 2 of a message of edition 1.
Result<Part> head_1(const InputFile& input, const Part& message) {
  std::array<unsigned char, 8> product{};  // the first octets of section 1
  std::array<unsigned char, 3> grid{};
  const std::uint64_t begin = message.offset + 8;
  const std::uint64_t end = message.offset + message.bytes;
  if (auto done = input.read(begin, product.data(), product.size()); !done) return done.error();
  const std::uint64_t at = begin + big_endian(product.data(), 3);
  constexpr unsigned has_grid = 0x80;  // table 1
  if ((product[7] & has_grid) == 0 || at + grid.size() > end) return Part{};
  if (auto done = input.read(at, grid.data(), grid.size()); !done) return done.error();
  const std::uint64_t after = at + big_endian(grid.data(), 3);
  return after > end ? Part{} : Part{message.offset, after - message.offset};
}

// The bitmap that a section 6 stands for. `last`: the last bitmap of the message, which is updated.
Result<Part> bitmap_of(const InputFile& input, const Part& section, Part& last) {
  constexpr unsigned char same_as_before = 254;  // code table 6.0
  constexpr unsigned char none = 255;
  unsigned char indicator = none;
  if (section.bytes > 5) {
    if (auto done = input.read(section.offset + 5, &indicator, 1); !done) return done.error();
  }
  if (indicator == same_as_before) {
    if (last.bytes == 0) {
      return input.fault("has a GRIB message that refers to a bitmap before its first one");
    }
    return last;
  }
  if (indicator != none) last = section;
  return section;
}

// Splits a message of edition 2 into fields; each ends with a section 7.
Result<void> split(const InputFile& input, const Part& message, std::vector<FieldPlace>& out) {
  std::array<Part, 8> known{};
  Part last_bitmap;
  Part header;
  std::vector<FieldPlace> found;
  std::uint64_t at = message.offset + 16;
  const std::uint64_t end = message.offset + message.bytes - 4;
  while (at < end) {
    std::array<unsigned char, 5> head{};
    if (end - at < head.size()) return input.fault("has a malformed section of a GRIB message");
    if (auto done = input.read(at, head.data(), head.size()); !done) return done;
    const std::uint64_t bytes = big_endian(head.data(), 4);
    const std::size_t number = head[4];
    if (bytes < head.size() || bytes > end - at || number < 1 || number > 7) {
      return input.fault("has a malformed section of a GRIB message at byte " + std::to_string(at));
    }
    known.at(number) = {at, bytes};
    if (number == 6) {
      const auto bitmap = bitmap_of(input, {at, bytes}, last_bitmap);
      if (!bitmap) return bitmap.error();
      known[6] = *bitmap;
    }
    at += bytes;
    if (number == 4) header = {message.offset, at - message.offset};
    if (number != 7) continue;
    FieldPlace field{2, {}, true, {}};
    for (const Part& part : known) {
      if (part.bytes > 0) field.parts.push_back(part);
    }
    found.push_back(std::move(field));
    if (out.size() + found.size() > fields_max) break;
  }
  if (found.size() == 1) found.front() = {2, {message}, false, header};
  out.insert(out.end(), found.begin(), found.end());
  return {};
}

}  // namespace

bool is_grib(const InputFile& input) {
  const auto head = input.head(heading_max + 8);
  return head && is_grib(std::string_view(*head));
}

bool is_grib(std::string_view head) {
  const auto at = head.find("GRIB");
  if (at >= heading_max || at + 8 > head.size()) return false;  // npos is also beyond these limits
  const bool is_heading = std::all_of(
      head.begin(), head.begin() + static_cast<long>(at),
      [](char c) { return (c >= ' ' && c <= '~') || c == '\r' || c == '\n' || c == 1 || c == 3; });
  return is_heading && (head[at + 7] == 1 || head[at + 7] == 2);
}

Result<std::vector<FieldPlace>> find_fields(const InputFile& input) {
  std::vector<FieldPlace> out;
  std::uint64_t offset = 0;
  while (offset < input.size()) {
    const auto start = next_message(input, offset);
    if (!start) return start.error();
    if (*start == input.size()) break;
    std::array<unsigned char, 16> head{};
    if (input.size() - *start < head.size()) return input.fault("is truncated in a GRIB message");
    if (auto done = input.read(*start, head.data(), head.size()); !done) return done.error();
    const int edition = head[7];
    if (edition != 1 && edition != 2) {
      return input.fault("has a GRIB message of edition " + std::to_string(edition) +
                         "; 1 and 2 are supported");
    }
    const std::uint64_t bytes =
        edition == 1 ? big_endian(head.data() + 4, 3) : big_endian(head.data() + 8, 8);
    if (edition == 1 && bytes >= 0x800000) {
      return input.fault("has a GRIB 1 message of more than 8 MiB, which is not supported");
    }
    const std::string place = " at byte " + std::to_string(*start);
    if (bytes < 24 || bytes > message_bytes_max) {
      return input.fault("has a GRIB message" + place + " of " + std::to_string(bytes) +
                         " bytes; 24 to " + std::to_string(message_bytes_max) + " are supported");
    }
    std::array<char, 4> tail{};
    if (bytes > input.size() - *start) return input.fault("is truncated in the message" + place);
    if (auto done = input.read(*start + bytes - 4, tail.data(), 4); !done) return done.error();
    if (std::memcmp(tail.data(), "7777", 4) != 0) {
      return input.fault("has a GRIB message" + place + " without its end marker");
    }
    const Part message{*start, bytes};
    if (edition == 1) {
      const auto head = head_1(input, message);
      if (!head) return head.error();
      out.push_back({1, {message}, false, *head});
    } else if (auto done = split(input, message, out); !done) {
      return done.error();
    }
    if (out.size() > fields_max) {
      return input.fault("has more than " + std::to_string(fields_max) + " GRIB fields");
    }
    offset = *start + bytes;
  }
  return out;
}

Result<std::vector<unsigned char>> read_head(const InputFile& input, const FieldPlace& field) {
  constexpr std::uint64_t bytes_max = 4096;
  std::vector<unsigned char> out(field.head.bytes > bytes_max ? 0 : field.head.bytes);
  if (out.empty()) return out;
  if (auto done = input.read(field.head.offset, out.data(), out.size()); !done) {
    return done.error();
  }
  return out;
}

Result<std::vector<unsigned char>> read_message(const InputFile& input, const FieldPlace& field) {
  std::uint64_t bytes = field.split ? 20 : 0;
  for (const Part& part : field.parts) bytes += part.bytes;
  if (bytes > message_bytes_max) return input.fault("has a GRIB field of more than 1 GiB");
  std::vector<unsigned char> out(bytes);
  std::size_t at = field.split ? 16 : 0;
  for (const Part& part : field.parts) {
    if (auto done = input.read(part.offset, out.data() + at, part.bytes); !done) {
      return done.error();
    }
    at += part.bytes;
  }
  if (field.split) {
    // Section 0 has the discipline of the original message.
    std::memcpy(out.data(), "GRIB\xff\xff", 6);
    if (auto done = input.read(field.parts.front().offset - 10, out.data() + 6, 2); !done) {
      return done.error();
    }
    for (std::size_t i = 0; i < 8; ++i) {
      out[8 + i] = static_cast<unsigned char>(bytes >> (8 * (7 - i)));
    }
    std::memcpy(out.data() + at, "7777", 4);
  }
  return out;
}

}  // namespace windsplat::data::grib
