// The 64-byte little-endian header of a binary frame; see docs/design/wire-format.md.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/base/error.hpp"

namespace windsplat::protocol {

enum class Codec : std::uint8_t { jpeg = 1, png = 2, h264 = 3 };
enum class MethodCode : std::uint8_t { kernel = 1, slab = 2, reference = 3 };

inline constexpr std::uint32_t flag_final = 1;
inline constexpr std::uint32_t flag_error_measured = 2;
inline constexpr std::uint32_t flag_error_estimated = 4;
inline constexpr std::uint32_t flag_cached = 8;
inline constexpr std::uint32_t flag_key = 16;  // a picture of H.264 that refers to no other

inline constexpr std::size_t frame_header_bytes = 64;

struct FrameHeader {
  std::uint8_t version = 1;
  std::uint8_t kind = 1;  // 1 frame
  std::uint32_t seq = 0;  // 4 + 4: from 1
  std::uint32_t rev = 0;  // revision of the rendered view
  std::uint32_t step = 0;
  std::uint32_t flags = 0;
  std::uint16_t width = 0;
  std::uint16_t height = 0;
  Codec codec = Codec::jpeg;
  std::uint8_t quality = 0;
  MethodCode method = MethodCode::kernel;
  std::uint8_t level = 0;  // 0 full resolution, n = 1/2^n
  float error = 0;         // linear RMSE, NaN unknown
  float jpeg_error = 0;    // NaN unknown
  std::uint32_t queue_us = 0;
  std::uint32_t render_us = 0;
  std::uint32_t encode_us = 0;
  std::uint32_t payload_bytes = 0;
  double t = 0;  // echo of t of the newest patch
};

std::array<std::uint8_t, frame_header_bytes> encode_frame_header(const FrameHeader& header);
// Errors: malformed (too short, wrong magic or version).
Result<FrameHeader> parse_frame_header(std::span<const std::uint8_t> bytes);

}  // namespace windsplat::protocol
