// DejaVu Sans, embedded when windsplat is built (embed_font.cmake).
#pragma once

#include <span>

namespace windsplat::annotate {

std::span<const unsigned char> font_bytes();

}  // namespace windsplat::annotate
