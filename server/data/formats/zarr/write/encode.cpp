#include "server/data/formats/zarr/write/encode.hpp"

#include <blosc.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>

#include "server/base/check.hpp"
#include "server/data/formats/zarr/crc32c.hpp"

namespace windsplat::data::zarr {

namespace {

static_assert(std::endian::native == std::endian::little);

// Bit patterns are compared, since compilers may assume of floats what they like.
template <class Bits>
bool are_all_nan(std::span<const unsigned char> items, Bits infinity) {
  for (std::size_t at = 0; at < items.size(); at += sizeof(Bits)) {
    Bits bits{};
    std::memcpy(&bits, items.data() + at, sizeof bits);
    if ((bits & static_cast<Bits>(~Bits{0} >> 1U)) <= infinity) return false;
  }
  return true;
}

}  // namespace

bool may_be_absent(const WrittenArray& array, std::span<const unsigned char> items) {
  if (array.dtype.kind == 'f') {
    return array.dtype.bytes == 4 ? are_all_nan<std::uint32_t>(items, 0x7f800000U)
                                  : are_all_nan<std::uint64_t>(items, 0x7ff0000000000000U);
  }
  // In version 2 a fill_value of 0 would mask the zeros of a count (xarray), so it has none.
  return array.format == StoreFormat::v3 &&
         std::all_of(items.begin(), items.end(), [](unsigned char byte) { return byte == 0; });
}

Result<ChunkBytes> encode_chunk(const WrittenArray& array, std::span<const unsigned char> items) {
  const Compression& how = array.compression;
  ChunkBytes out;
  if (how.kind == Compression::Kind::none) {
    out.assign(items.begin(), items.end());
  } else {
    out.resize(items.size() + BLOSC_MAX_OVERHEAD);
    const char* const name =
        how.kind == Compression::Kind::zstd ? BLOSC_ZSTD_COMPNAME : BLOSC_LZ4_COMPNAME;
    const int bytes = blosc_compress_ctx(how.level, BLOSC_SHUFFLE, array.dtype.bytes, items.size(),
                                         items.data(), out.data(), out.size(), name, 0, 1);
    if (bytes <= 0) {
      return make_error(ErrorKind::internal, "compressing a chunk of " + in_quotes(array.path) +
                                                 " failed (" + std::to_string(bytes) + ')');
    }
    out.resize(static_cast<std::size_t>(bytes));
  }
  if (array.format == StoreFormat::v3) append_number(crc32c(out.data(), out.size()), 4, out);
  return out;
}

void append_number(std::uint64_t number, std::size_t bytes, ChunkBytes& to) {
  for (std::size_t i = 0; i < bytes; ++i) {
    to.push_back(static_cast<unsigned char>(number >> (8 * i)));
  }
}

}  // namespace windsplat::data::zarr
