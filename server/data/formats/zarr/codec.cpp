// Decodes a chunk by its codecs in reverse order. Compressors are C libraries that write into a
// buffer of known size.
#include "server/data/formats/zarr/codec.hpp"

#include <blosc.h>
#include <lz4.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <climits>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/formats/zarr/crc32c.hpp"
#include "server/data/formats/zarr/metadata_parts.hpp"

namespace windsplat::data::zarr {

namespace {

using Bytes = ChunkBytes;

Error broken_chunk(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

Error wrong_size(std::size_t found, std::size_t expected) {
  return broken_chunk("has " + std::to_string(found) + " bytes; its array requires " +
                      std::to_string(expected));
}

// zlib and gzip streams; several gzip members may follow each other.
bool inflate_all(const Bytes& stored, bool gzip, std::size_t bytes, Bytes& out) {
  out.resize(bytes);
  z_stream stream{};
  if (inflateInit2(&stream, gzip ? MAX_WBITS + 16 : MAX_WBITS) != Z_OK) return false;
  stream.next_in = const_cast<unsigned char*>(stored.data());
  stream.avail_in = static_cast<uInt>(stored.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  int status = inflate(&stream, Z_FINISH);
  while (gzip && status == Z_STREAM_END && stream.avail_in > 0 && stream.avail_out > 0 &&
         inflateReset(&stream) == Z_OK) {
    status = inflate(&stream, Z_FINISH);
  }
  inflateEnd(&stream);
  return status == Z_STREAM_END && stream.avail_out == 0;
}

bool decompress_blosc(const Bytes& stored, std::size_t bytes, Bytes& out) {
  std::size_t claimed = 0;
  if (stored.size() < BLOSC_MIN_HEADER_LENGTH ||
      blosc_cbuffer_validate(stored.data(), stored.size(), &claimed) != 0 || claimed != bytes) {
    return false;
  }
  out.resize(bytes);
  return blosc_decompress_ctx(stored.data(), out.data(), out.size(), 1) ==
         static_cast<int>(out.size());
}

// numcodecs stores the length before the block.
bool decompress_lz4(const Bytes& stored, std::size_t bytes, Bytes& out) {
  if (stored.size() < 4 || stored.size() > INT_MAX) return false;
  const std::uint64_t claimed = stored[0] | std::uint64_t{stored[1]} << 8U |
                                std::uint64_t{stored[2]} << 16U | std::uint64_t{stored[3]} << 24U;
  if (claimed != bytes) return false;
  out.resize(bytes);
  const auto capacity = static_cast<int>(bytes);
  return LZ4_decompress_safe(reinterpret_cast<const char*>(stored.data() + 4),
                             reinterpret_cast<char*>(out.data()),
                             static_cast<int>(stored.size() - 4), capacity) == capacity;
}

bool decompress_zstd(const Bytes& stored, std::size_t bytes, Bytes& out) {
  out.resize(bytes);
  return ZSTD_decompress(out.data(), out.size(), stored.data(), stored.size()) == out.size();
}

Result<Bytes> decompress(Codec::Kind kind, const Bytes& stored, std::size_t bytes) {
  Bytes out;
  const bool done = kind == Codec::Kind::blosc  ? decompress_blosc(stored, bytes, out)
                    : kind == Codec::Kind::zstd ? decompress_zstd(stored, bytes, out)
                    : kind == Codec::Kind::lz4
                        ? decompress_lz4(stored, bytes, out)
                        : inflate_all(stored, kind == Codec::Kind::gzip, bytes, out);
  if (!done) {
    return broken_chunk("does not decompress to the " + std::to_string(bytes) +
                        " bytes of its array");
  }
  return out;
}

// Shuffle: all first bytes of the elements, then all second bytes, and so on.
Bytes unshuffle(const Bytes& in, std::size_t element_bytes) {
  Bytes out(in.size());
  const std::size_t count = in.size() / element_bytes;
  for (std::size_t byte = 0; byte < element_bytes; ++byte) {
    for (std::size_t i = 0; i < count; ++i) {
      out[i * element_bytes + byte] = in[byte * count + i];
    }
  }
  return out;
}

// Calls use(T{}) with the type of the items; false for unsupported types.
template <class Use>
void with_type(const Dtype& type, const Use& use) {
  const bool is_signed = type.kind == 'i';
  switch (type.bytes) {
    case 1:
      return is_signed ? use(std::int8_t{}) : use(std::uint8_t{});
    case 2:
      return is_signed ? use(std::int16_t{}) : use(std::uint16_t{});
    case 4:
      return type.kind == 'f' ? use(float{})
             : is_signed      ? use(std::int32_t{})
                              : use(std::uint32_t{});
    default:
      return type.kind == 'f' ? use(double{})
             : is_signed      ? use(std::int64_t{})
                              : use(std::uint64_t{});
  }
}

template <class T>
T load(const unsigned char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

// Cumulative sums; integers wrap around as in NumPy.
template <class T>
void sum_up(Bytes& bytes) {
  if constexpr (std::is_floating_point_v<T>) {
    T sum = 0;
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(T)) {
      sum += load<T>(bytes.data() + at);
      std::memcpy(bytes.data() + at, &sum, sizeof sum);
    }
  } else {
    std::uint64_t sum = 0;
    for (std::size_t at = 0; at < bytes.size(); at += sizeof(T)) {
      sum += static_cast<std::uint64_t>(load<T>(bytes.data() + at));
      const auto value = static_cast<T>(sum);
      std::memcpy(bytes.data() + at, &value, sizeof value);
    }
  }
}

Bytes unscale(const Bytes& in, const Codec& filter) {
  const std::size_t count = in.size() / filter.encoded.bytes;
  Bytes out(count * filter.decoded.bytes);
  with_type(filter.encoded, [&](auto encoded) {
    using T = decltype(encoded);
    for (std::size_t i = 0; i < count; ++i) {
      const auto stored = static_cast<double>(load<T>(in.data() + i * sizeof(T)));
      const double value = stored / filter.scale + filter.offset;
      if (filter.decoded.bytes == 8) {
        std::memcpy(out.data() + i * 8, &value, 8);
      } else {
        const auto narrow = static_cast<float>(value);
        std::memcpy(out.data() + i * 4, &narrow, 4);
      }
    }
  });
  return out;
}

void turn_bytes(Bytes& bytes, std::size_t item) {
  for (std::size_t at = 0; at + item <= bytes.size(); at += item) {
    std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                 bytes.begin() + static_cast<std::ptrdiff_t>(at + item));
  }
}

// Removes and checks the sum that follows the bytes.
Result<Bytes> check_sum(Bytes bytes) {
  if (bytes.size() < crc32c_bytes) return broken_chunk("is shorter than its CRC-32C");
  const std::size_t count = bytes.size() - crc32c_bytes;
  if (!ends_in_crc32c(bytes)) return broken_chunk("does not match its CRC-32C");
  bytes.resize(count);
  return bytes;
}

// Bytes before each codec, and after the last, as if no compressor changed them.
std::vector<std::size_t> encoded_sizes(const ArrayMetadata& array) {
  const std::size_t items = array.chunk_items();
  std::vector<std::size_t> out{items * array.dtype.bytes};
  for (const Codec& codec : array.codecs) {
    const std::size_t bytes = out.back();
    out.push_back(codec.kind == Codec::Kind::fixed_scale_offset ? items * codec.encoded.bytes
                  : codec.kind == Codec::Kind::crc32c           ? bytes + crc32c_bytes
                                                                : bytes);
  }
  return out;
}

Result<Bytes> decode(const Codec& codec, Bytes bytes, std::size_t decoded_bytes) {
  switch (codec.kind) {
    case Codec::Kind::swap_bytes:
      turn_bytes(bytes, codec.element_bytes);
      return bytes;
    case Codec::Kind::shuffle:
      if (bytes.size() % codec.element_bytes != 0) {
        return broken_chunk("is not a whole number of shuffled elements");
      }
      return unshuffle(bytes, codec.element_bytes);
    case Codec::Kind::delta:
      with_type(codec.decoded, [&](auto item) { sum_up<decltype(item)>(bytes); });
      return bytes;
    case Codec::Kind::fixed_scale_offset:
      return unscale(bytes, codec);
    case Codec::Kind::crc32c:
      return check_sum(std::move(bytes));
    default:
      return decompress(codec.kind, bytes, decoded_bytes);
  }
}

}  // namespace

bool ends_in_crc32c(std::span<const unsigned char> bytes) {
  if (bytes.size() < crc32c_bytes) return false;
  const unsigned char* const sum = bytes.data() + bytes.size() - crc32c_bytes;
  const std::uint32_t stored = std::uint32_t{sum[0]} | std::uint32_t{sum[1]} << 8U |
                               std::uint32_t{sum[2]} << 16U | std::uint32_t{sum[3]} << 24U;
  return crc32c(bytes.data(), bytes.size() - crc32c_bytes) == stored;
}

std::size_t stored_bytes_max(const ArrayMetadata& array) {
  return stored_chunk_bytes_max(encoded_sizes(array).back());
}

Result<Bytes> decode_chunk(const ArrayMetadata& array, Bytes stored) {
  const auto sizes = encoded_sizes(array);
  if (stored.size() > stored_bytes_max(array)) {
    return wrong_size(stored.size(), stored_bytes_max(array));
  }
  const auto compressor =
      std::find_if(array.codecs.begin(), array.codecs.end(),
                   [](const Codec& codec) { return is_compressor(codec.kind); });
  // Sizes are known up to the compressor.
  const auto known = static_cast<std::size_t>(compressor - array.codecs.begin());
  for (std::size_t i = array.codecs.size(); i-- > 0;) {
    if (i < known && stored.size() != sizes[i + 1]) return wrong_size(stored.size(), sizes[i + 1]);
    auto bytes = decode(array.codecs[i], std::move(stored), sizes[i]);
    if (!bytes) return bytes;
    stored = std::move(*bytes);
  }
  if (stored.size() != sizes.front()) return wrong_size(stored.size(), sizes.front());
  return stored;
}

}  // namespace windsplat::data::zarr
