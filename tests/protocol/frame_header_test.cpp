// The 64 bytes of the frame header, compared with vectors written by hand.
#include "protocol/frame_header.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support.hpp"

namespace windsplat::protocol::testing {
namespace {

std::span<const std::uint8_t> as_bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

float float_or_nan(const Json& value) {
  return value.is_null() ? std::numeric_limits<float>::quiet_NaN() : value.get<float>();
}

FrameHeader header_of(const Json& fields) {
  FrameHeader header;
  header.version = fields.at("version");
  header.kind = fields.at("kind");
  header.seq = fields.at("seq");
  header.rev = fields.at("rev");
  header.step = fields.at("step");
  header.flags = fields.at("flags");
  header.width = fields.at("width");
  header.height = fields.at("height");
  header.codec = static_cast<Codec>(fields.at("codec").get<int>());
  header.quality = fields.at("quality");
  header.method = static_cast<MethodCode>(fields.at("method").get<int>());
  header.level = fields.at("level");
  header.error = float_or_nan(fields.at("error"));
  header.jpeg_error = float_or_nan(fields.at("jpegError"));
  header.queue_us = fields.at("queueUs");
  header.render_us = fields.at("renderUs");
  header.encode_us = fields.at("encodeUs");
  header.payload_bytes = fields.at("payloadBytes");
  header.t = fields.at("t");
  return header;
}

TEST(FrameHeader, EncodesToTheBytesOfTheVectors) {
  int seen = 0;
  for (const Vector& vector : read_vectors("valid")) {
    if (vector.kind() != "frameHeader") continue;
    ++seen;
    const std::string expected = bytes_from_hex(vector.body.at("hex").get<std::string>());
    ASSERT_EQ(expected.size(), frame_header_bytes) << vector.name();
    const auto bytes = encode_frame_header(header_of(vector.body.at("fields")));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      EXPECT_EQ(bytes[i], as_bytes(expected)[i]) << vector.name() << " byte " << i;
    }
  }
  EXPECT_GE(seen, 3);
}

TEST(FrameHeader, ParsesTheBytesOfTheVectors) {
  for (const Vector& vector : read_vectors("valid")) {
    if (vector.kind() != "frameHeader") continue;
    const std::string bytes = bytes_from_hex(vector.body.at("hex").get<std::string>());
    const auto header = parse_frame_header(as_bytes(bytes));
    ASSERT_TRUE(header.has_value()) << vector.name() << ": " << header.error().message;
    const FrameHeader expected = header_of(vector.body.at("fields"));
    EXPECT_EQ(header->seq, expected.seq);
    EXPECT_EQ(header->rev, expected.rev);
    EXPECT_EQ(header->step, expected.step);
    EXPECT_EQ(header->flags, expected.flags);
    EXPECT_EQ(header->width, expected.width);
    EXPECT_EQ(header->height, expected.height);
    EXPECT_EQ(header->codec, expected.codec);
    EXPECT_EQ(header->quality, expected.quality);
    EXPECT_EQ(header->method, expected.method);
    EXPECT_EQ(header->level, expected.level);
    EXPECT_TRUE(header->error == expected.error ||
                (std::isnan(header->error) && std::isnan(expected.error)));
    EXPECT_TRUE(header->jpeg_error == expected.jpeg_error ||
                (std::isnan(header->jpeg_error) && std::isnan(expected.jpeg_error)));
    EXPECT_EQ(header->queue_us, expected.queue_us);
    EXPECT_EQ(header->render_us, expected.render_us);
    EXPECT_EQ(header->encode_us, expected.encode_us);
    EXPECT_EQ(header->payload_bytes, expected.payload_bytes);
    EXPECT_EQ(header->t, expected.t);
  }
}

TEST(FrameHeader, RefusesInvalidHeaders) {
  int seen = 0;
  for (const Vector& vector : read_vectors("invalid")) {
    if (vector.kind() != "frameHeader") continue;
    ++seen;
    const std::string bytes = bytes_from_hex(vector.body.at("hex").get<std::string>());
    const auto header = parse_frame_header(as_bytes(bytes));
    ASSERT_FALSE(header.has_value()) << vector.name();
    EXPECT_EQ(header.error().kind, ErrorKind::malformed) << vector.name();
  }
  EXPECT_GE(seen, 8);
}

TEST(FrameHeader, PayloadMayFollow) {
  const auto bytes = encode_frame_header(FrameHeader{});
  std::string message(bytes.begin(), bytes.end());
  message += "\xff\xd8 and a picture";
  EXPECT_TRUE(parse_frame_header(as_bytes(message)).has_value());
}

}  // namespace
}  // namespace windsplat::protocol::testing
