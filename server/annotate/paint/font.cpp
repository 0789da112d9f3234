#include "server/annotate/paint/font.hpp"

extern "C" {
extern const unsigned char windsplat_font_begin[];
extern const unsigned char windsplat_font_end[];
}

namespace windsplat::annotate {

std::span<const unsigned char> font_bytes() {
  return {&windsplat_font_begin[0],
          static_cast<std::size_t>(windsplat_font_end - windsplat_font_begin)};
}

}  // namespace windsplat::annotate
