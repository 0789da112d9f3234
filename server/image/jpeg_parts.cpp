// JPEGs of strips -> one JPEG: parses segments by their lengths and copies scans unchanged.
#include "server/image/jpeg_parts.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>

#include "server/base/check.hpp"

namespace windsplat::image {
namespace {

constexpr std::uint8_t start_of_image = 0xD8;
constexpr std::uint8_t end_of_image = 0xD9;
constexpr std::uint8_t start_of_baseline = 0xC0;
constexpr std::uint8_t huffman_tables = 0xC4;
constexpr std::uint8_t start_of_scan = 0xDA;
constexpr std::uint8_t quantization_tables = 0xDB;
constexpr std::uint8_t restart_interval = 0xDD;
constexpr std::uint8_t first_restart = 0xD0;  // first of 8 markers that are used cyclically
constexpr std::uint8_t first_application = 0xE0;
constexpr std::uint8_t last_application = 0xEF;

struct Layout {
  std::size_t frame = 0;  // offset of the SOF0 marker
  std::size_t scan = 0;   // offset of the SOS marker
  std::size_t data = 0;   // offset after the SOS segment
};

Error broken(const char* what) {
  return make_error(ErrorKind::internal, std::string("JPEG: a strip ") + what);
}

bool is_marker(std::span<const std::uint8_t> jpeg, std::size_t at, std::uint8_t code) {
  return at + 2 <= jpeg.size() && jpeg[at] == 0xFF && jpeg[at + 1] == code;
}

Result<Layout> layout_of(std::span<const std::uint8_t> jpeg) {
  if (!is_marker(jpeg, 0, start_of_image)) return broken("has no start marker");
  if (jpeg.size() < 4 || !is_marker(jpeg, jpeg.size() - 2, end_of_image)) {
    return broken("has no end marker");
  }
  Layout layout;
  for (std::size_t at = 2; at + 4 <= jpeg.size();) {
    if (jpeg[at] != 0xFF) return broken("lacks a marker");
    const std::uint8_t code = jpeg[at + 1];
    const std::size_t length = (std::size_t{jpeg[at + 2]} << 8U) + jpeg[at + 3];
    const std::size_t next = at + 2 + length;
    if (length < 2 || next + 2 > jpeg.size()) return broken("is truncated");
    const bool application = code >= first_application && code <= last_application;
    if (code == start_of_scan) {
      if (layout.frame == 0) return broken("has no frame");
      layout.scan = at;
      layout.data = next;
      return layout;
    }
    if (code == start_of_baseline) {
      if (length < 8) return broken("has a short frame");
      layout.frame = at;
    } else if (!application && code != huffman_tables && code != quantization_tables) {
      return broken("has a segment that no baseline strip has");
    }
    at = next;
  }
  return broken("has no scan");
}

// Whether two strips have the same headers except for the height; different tables could not be
// decoded in one scan.
bool same_header(std::span<const std::uint8_t> first, const Layout& a,
                 std::span<const std::uint8_t> other, const Layout& b) {
  if (a.frame != b.frame || a.scan != b.scan || a.data != b.data) return false;
  const std::size_t height = a.frame + 5;
  const auto same = [&](std::size_t from, std::size_t to) {
    return std::ranges::equal(first.subspan(from, to - from), other.subspan(from, to - from));
  };
  return same(0, height) && same(height + 2, a.data);
}

void append(Bytes& bytes, std::span<const std::uint8_t> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

void put_number(Bytes& bytes, std::size_t at, int number) {
  bytes[at] = static_cast<std::uint8_t>(number >> 8);
  bytes[at + 1] = static_cast<std::uint8_t>(number & 0xFF);
}

}  // namespace

Result<void> stitch(std::span<const std::span<const std::uint8_t>> strips,
                    const Stitching& stitching, Bytes& bytes) {
  WINDSPLAT_CHECK(!strips.empty());
  WINDSPLAT_CHECK(stitching.strip_mcus > 0 && stitching.strip_mcus <= 0xFFFF);
  std::size_t size = 6;
  for (const auto& strip : strips) size += strip.size();
  bytes.clear();
  bytes.reserve(size);
  Layout first;
  for (std::size_t s = 0; s < strips.size(); ++s) {
    const auto& strip = strips[s];
    const auto layout = layout_of(strip);
    if (!layout) return layout.error();
    if (s == 0) first = *layout;
    if (!same_header(strips[0], first, strip, *layout)) {
      return broken("has a header that differs from that of the first");
    }
    if (s == 0) {
      append(bytes, strip.first(layout->scan));
      put_number(bytes, layout->frame + 5, stitching.height);
      put_number(bytes, layout->frame + 7, stitching.width);
      if (strips.size() > 1) {
        append(bytes, std::array<std::uint8_t, 6>{0xFF, restart_interval, 0, 4, 0, 0});
        put_number(bytes, bytes.size() - 2, stitching.strip_mcus);
      }
      append(bytes, strip.subspan(layout->scan, layout->data - layout->scan));
    } else {
      const auto restart = static_cast<std::uint8_t>(first_restart + (s - 1) % 8);
      append(bytes, std::array<std::uint8_t, 2>{0xFF, restart});
    }
    append(bytes, strip.subspan(layout->data, strip.size() - 2 - layout->data));
  }
  append(bytes, std::array<std::uint8_t, 2>{0xFF, end_of_image});
  return {};
}

}  // namespace windsplat::image
