#include "server/ground/lines.hpp"

#include <zlib.h>

#include <cstdint>
#include <utility>

#include "server/base/check.hpp"

extern "C" const char windsplat_lines_begin[];
extern "C" const char windsplat_lines_end[];

namespace windsplat::ground {

namespace {

constexpr std::size_t bytes_max = std::size_t{1} << 20U;

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

// Coasts come before borders.
Level read_level(Reader& from, int rows, double tolerance) {
  const auto steps = static_cast<double>(from.number());
  std::vector<Segment> segments;
  std::size_t coasts = 0;
  std::int64_t x = 0;
  std::int64_t y = 0;
  for (std::int64_t left = from.number(); left > 0; --left) {
    const bool coast = from.number() == 0;
    std::array<float, 2> last{};
    const std::int64_t points = from.number();
    for (std::int64_t n = 0; n < points; ++n) {
      x += from.change();
      y += from.change();
      const std::array<float, 2> here{static_cast<float>(static_cast<double>(x) / steps),
                                      static_cast<float>(static_cast<double>(y) / steps)};
      if (n > 0) segments.push_back({last, here});
      last = here;
    }
    if (coast) coasts = segments.size();
  }
  segments.shrink_to_fit();
  return {std::move(segments), coasts, rows, tolerance};
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

std::array<Level, levels> read_levels() {
  const std::string bytes = embedded_lines();
  Reader from(bytes);
  // In the order of the file; tolerances as in scripts/ground_data.
  Level fine = read_level(from, 720, 0.015);
  Level middle = read_level(from, 360, 0.05);
  Level coarse = read_level(from, 120, 0.2);
  WINDSPLAT_CHECK(from.is_at_end());
  return {std::move(fine), std::move(middle), std::move(coarse)};
}

}  // namespace windsplat::ground
