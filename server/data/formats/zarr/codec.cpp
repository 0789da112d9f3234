// Decompression by C libraries into a buffer of known size, then the filters in reverse order.
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

namespace windsplat::data::zarr {

namespace {

using Bytes = std::vector<unsigned char>;

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

Result<Bytes> decompress(Compressor compressor, Bytes stored, std::size_t bytes) {
  if (compressor == Compressor::none) {
    return stored.size() == bytes ? Result<Bytes>(std::move(stored))
                                  : wrong_size(stored.size(), bytes);
  }
  Bytes out;
  const bool done = compressor == Compressor::blosc  ? decompress_blosc(stored, bytes, out)
                    : compressor == Compressor::zstd ? decompress_zstd(stored, bytes, out)
                    : compressor == Compressor::lz4
                        ? decompress_lz4(stored, bytes, out)
                        : inflate_all(stored, compressor == Compressor::gzip, bytes, out);
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

Bytes unscale(const Bytes& in, const Filter& filter) {
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

// Bytes of an item before compression.
std::size_t encoded_item_bytes(const ArrayMetadata& array) {
  std::size_t bytes = array.dtype.bytes;
  for (const Filter& filter : array.filters) {
    if (filter.kind != Filter::Kind::shuffle) bytes = filter.encoded.bytes;
  }
  return bytes;
}

}  // namespace

std::size_t stored_bytes_max(const ArrayMetadata& array) {
  return stored_chunk_bytes_max(array.chunk_items() * encoded_item_bytes(array));
}

Result<Bytes> decode_chunk(const ArrayMetadata& array, Bytes stored) {
  if (stored.size() > stored_bytes_max(array)) {
    return wrong_size(stored.size(), stored_bytes_max(array));
  }
  const std::size_t encoded_bytes = array.chunk_items() * encoded_item_bytes(array);
  auto bytes = decompress(array.compressor, std::move(stored), encoded_bytes);
  if (!bytes) return bytes.error();
  for (auto filter = array.filters.rbegin(); filter != array.filters.rend(); ++filter) {
    if (filter->kind == Filter::Kind::shuffle) {
      if (bytes->size() % filter->element_bytes != 0) {
        return broken_chunk("is not a whole number of shuffled elements");
      }
      *bytes = unshuffle(*bytes, filter->element_bytes);
    } else if (filter->kind == Filter::Kind::delta) {
      with_type(filter->decoded, [&](auto item) { sum_up<decltype(item)>(*bytes); });
    } else {
      *bytes = unscale(*bytes, *filter);
    }
  }
  if (array.dtype.big_endian && array.dtype.bytes > 1) turn_bytes(*bytes, array.dtype.bytes);
  return bytes;
}

}  // namespace windsplat::data::zarr
