// Limits on the animations of a server.
#pragma once

#include <cstdint>

namespace windsplat::protocol::limits {

inline constexpr int animation_frames_max = 3600;
inline constexpr std::int64_t animation_pixels_max = 4000000000;  // of all frames
inline constexpr std::int64_t animation_bytes_max = 268435456;    // of the file
inline constexpr std::int64_t video_pixels_max = 9437184;         // of a frame: 4096 x 2304

}  // namespace windsplat::protocol::limits
