// FrameHeader <-> 64 bytes. Explicit offsets and little-endian order, independent of compiler and
// machine.
#include "protocol/frame_header.hpp"

#include <cstring>
#include <string>

namespace windsplat::protocol {

namespace {

constexpr std::array<std::uint8_t, 4> magic{'W', 'S', 'P', 'L'};
constexpr std::uint8_t version_known = 1;
constexpr std::uint8_t kind_frame = 1;

void put_u16(std::uint8_t* at, std::uint16_t value) {
  at[0] = static_cast<std::uint8_t>(value & 0xffU);
  at[1] = static_cast<std::uint8_t>(value >> 8U);
}

void put_u32(std::uint8_t* at, std::uint32_t value) {
  for (unsigned i = 0; i < 4; ++i) at[i] = static_cast<std::uint8_t>((value >> (8U * i)) & 0xffU);
}

void put_u64(std::uint8_t* at, std::uint64_t value) {
  for (unsigned i = 0; i < 8; ++i) at[i] = static_cast<std::uint8_t>((value >> (8U * i)) & 0xffU);
}

std::uint16_t get_u16(const std::uint8_t* at) {
  return static_cast<std::uint16_t>(at[0] | (at[1] << 8));
}

std::uint32_t get_u32(const std::uint8_t* at) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(at[i]) << (8U * i);
  return value;
}

std::uint64_t get_u64(const std::uint8_t* at) {
  std::uint64_t value = 0;
  for (unsigned i = 0; i < 8; ++i) value |= static_cast<std::uint64_t>(at[i]) << (8U * i);
  return value;
}

template <class To, class From>
To same_bits(From value) {
  static_assert(sizeof(To) == sizeof(From));
  To out;
  std::memcpy(&out, &value, sizeof(out));
  return out;
}

Error bad_header(const std::string& why) {
  return make_error(ErrorKind::malformed, "not a frame: " + why);
}

}  // namespace

std::array<std::uint8_t, frame_header_bytes> encode_frame_header(const FrameHeader& header) {
  std::array<std::uint8_t, frame_header_bytes> bytes{};
  std::uint8_t* at = bytes.data();
  std::memcpy(at, magic.data(), magic.size());
  at[4] = header.version;
  at[5] = header.kind;
  put_u16(at + 6, frame_header_bytes);
  put_u32(at + 8, header.seq);
  put_u32(at + 12, header.rev);
  put_u32(at + 16, header.step);
  put_u32(at + 20, header.flags);
  put_u16(at + 24, header.width);
  put_u16(at + 26, header.height);
  at[28] = static_cast<std::uint8_t>(header.codec);
  at[29] = header.quality;
  at[30] = static_cast<std::uint8_t>(header.method);
  at[31] = header.level;
  put_u32(at + 32, same_bits<std::uint32_t>(header.error));
  put_u32(at + 36, same_bits<std::uint32_t>(header.jpeg_error));
  put_u32(at + 40, header.queue_us);
  put_u32(at + 44, header.render_us);
  put_u32(at + 48, header.encode_us);
  put_u32(at + 52, header.payload_bytes);
  put_u64(at + 56, same_bits<std::uint64_t>(header.t));
  return bytes;
}

Result<FrameHeader> parse_frame_header(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < frame_header_bytes) {
    return bad_header("has " + std::to_string(bytes.size()) + " bytes; a header has 64");
  }
  const std::uint8_t* at = bytes.data();
  if (std::memcmp(at, magic.data(), magic.size()) != 0) {
    return bad_header("does not begin with WSPL");
  }
  if (at[4] != version_known) return bad_header("version " + std::to_string(at[4]) + ", not 1");
  if (at[5] != kind_frame) return bad_header("kind " + std::to_string(at[5]) + ", not 1");
  if (get_u16(at + 6) != frame_header_bytes) {
    return bad_header("header length " + std::to_string(get_u16(at + 6)) + ", not 64");
  }
  if (at[28] < 1 || at[28] > 3) return bad_header("codec " + std::to_string(at[28]));
  if (at[30] < 1 || at[30] > 3) return bad_header("method " + std::to_string(at[30]));
  FrameHeader header;
  header.version = at[4];
  header.kind = at[5];
  header.seq = get_u32(at + 8);
  header.rev = get_u32(at + 12);
  header.step = get_u32(at + 16);
  header.flags = get_u32(at + 20);
  header.width = get_u16(at + 24);
  header.height = get_u16(at + 26);
  header.codec = static_cast<Codec>(at[28]);
  header.quality = at[29];
  header.method = static_cast<MethodCode>(at[30]);
  header.level = at[31];
  header.error = same_bits<float>(get_u32(at + 32));
  header.jpeg_error = same_bits<float>(get_u32(at + 36));
  header.queue_us = get_u32(at + 40);
  header.render_us = get_u32(at + 44);
  header.encode_us = get_u32(at + 48);
  header.payload_bytes = get_u32(at + 52);
  header.t = same_bits<double>(get_u64(at + 56));
  return header;
}

}  // namespace windsplat::protocol
