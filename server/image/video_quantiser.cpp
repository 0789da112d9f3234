#include <algorithm>
#include <cmath>

#include "server/image/video_encoder.hpp"

namespace windsplat::image {

// A step of H.264 doubles every six values and is 16, that of libjpeg's luma for low frequencies at
// quality 50, at 28 (ITU-T H.264, 8.5.9). libjpeg scales its tables by 50 / quality or 2 - quality
// / 50.
int quantiser_of(int quality) {
  constexpr double at_fifty = 28;
  constexpr int least = 10;
  constexpr int most = 44;
  const double scale = quality < 50 ? 50.0 / std::max(quality, 1) : 2 - quality / 50.0;
  const double steps = 6 * std::log2(std::max(scale, 0.02));
  return std::clamp(static_cast<int>(std::lround(at_fifty + steps)), least, most);
}

}  // namespace windsplat::image
