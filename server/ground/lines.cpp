#include "server/ground/lines.hpp"

#include <zlib.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "server/base/check.hpp"

extern "C" const char windsplat_lines_begin[];
extern "C" const char windsplat_lines_end[];

namespace windsplat::ground {

namespace {

constexpr std::size_t bytes_max = std::size_t{512} << 10U;

// The file is part of the program: what is not of its form is a fault of the build.
class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}
  std::int64_t number() {
    std::int64_t value = 0;
    for (unsigned shift = 0;; shift += 7) {
      WINDSPLAT_CHECK(at_ < bytes_.size() && shift < 63);
      const auto byte = static_cast<std::uint8_t>(bytes_[at_++]);
      value |= static_cast<std::int64_t>(byte & 127U) << shift;
      if (byte < 128) return value;
    }
  }
  std::int64_t change() {
    const std::int64_t coded = number();
    return coded % 2 == 0 ? coded / 2 : -(coded + 1) / 2;
  }
  [[nodiscard]] bool is_at_end() const { return at_ == bytes_.size(); }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

struct Lines {
  std::vector<Segment> segments;
  std::size_t coasts = 0;  // the first of them
};

// Of the level that follows. Coasts come before borders. Not `wanted`: passed over.
Lines next_level(Reader& from, bool wanted) {
  const auto steps = static_cast<double>(from.number());
  Lines out;
  std::int64_t x = 0;
  std::int64_t y = 0;
  for (std::int64_t left = from.number(); left > 0; --left) {
    const bool coast = from.number() == 0;
    std::array<float, 2> last{};
    const std::int64_t points = from.number();
    for (std::int64_t n = 0; n < points; ++n) {
      x += from.change();
      y += from.change();
      if (!wanted) continue;
      const std::array<float, 2> here{static_cast<float>(static_cast<double>(x) / steps),
                                      static_cast<float>(static_cast<double>(y) / steps)};
      if (n > 0) out.segments.push_back({last, here});
      last = here;
    }
    if (coast) out.coasts = out.segments.size();
  }
  out.segments.shrink_to_fit();
  return out;
}

}  // namespace

std::string embedded_lines() {
  std::string bytes(bytes_max, '\0');
  uLongf length = bytes.size();
  const int done = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &length,
                              reinterpret_cast<const Bytef*>(windsplat_lines_begin),
                              static_cast<uLong>(windsplat_lines_end - windsplat_lines_begin));
  WINDSPLAT_CHECK(done == Z_OK);
  bytes.resize(length);
  return bytes;
}

Level read_level(std::size_t number) {
  // Rows of cells from pole to pole, in the order of the file.
  constexpr std::array<int, levels> rows{720, 360, 120};
  const std::string bytes = embedded_lines();
  Reader from(bytes);
  Lines lines;
  for (std::size_t n = 0; n < levels; ++n) {
    Lines next = next_level(from, n == number);
    if (n == number) lines = std::move(next);
  }
  WINDSPLAT_CHECK(from.is_at_end());
  return {std::move(lines.segments), lines.coasts, rows.at(number), tolerances.at(number)};
}

}  // namespace windsplat::ground
