#include "server/data/formats/zarr/shard.hpp"

#include <string>

#include "server/data/formats/zarr/codec.hpp"

namespace windsplat::data::zarr {

namespace {

Error broken_index(const std::string& what) { return make_error(ErrorKind::bad_data, what); }

std::uint64_t number_at(const unsigned char* bytes, bool big_endian) {
  std::uint64_t out = 0;
  for (unsigned i = 0; i < 8; ++i) {
    out |= std::uint64_t{bytes[big_endian ? 7 - i : i]} << (8 * i);
  }
  return out;
}

}  // namespace

std::size_t index_bytes(const ArrayMetadata& array) {
  const Shard& shard = *array.shard;
  std::size_t count = 1;
  for (std::size_t d = 0; d < shard.shape.size(); ++d) count *= shard.shape[d] / array.chunks[d];
  return count * sizeof(Span) + (shard.index_checked ? crc32c_bytes : 0);
}

Result<std::vector<Span>> read_index(const ArrayMetadata& array, const InputFile& file) {
  const Shard& shard = *array.shard;
  const std::size_t bytes = index_bytes(array);
  const std::size_t count = bytes / sizeof(Span);
  if (file.size() < bytes) {
    return broken_index("is truncated: it has " + std::to_string(file.size()) +
                        " bytes, and its index " + std::to_string(bytes));
  }
  std::vector<unsigned char> stored(bytes);
  const std::uint64_t offset = shard.index_at_start ? 0 : file.size() - bytes;
  if (auto done = file.read(offset, stored.data(), bytes); !done) return done.error();
  if (shard.index_checked && !ends_in_crc32c(stored)) {
    return broken_index("is damaged: its index does not match its CRC-32C");
  }
  std::vector<Span> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    const unsigned char* const entry = stored.data() + i * sizeof(Span);
    Span& span = out[i];
    span.offset = number_at(entry, shard.index_big_endian);
    span.bytes = number_at(entry + 8, shard.index_big_endian);
    if (span.offset == absent_span && span.bytes == absent_span) continue;
    if (span.offset > file.size() || span.bytes > file.size() - span.offset) {
      return broken_index("is damaged: its part " + std::to_string(i) + " is outside of the file");
    }
  }
  return out;
}

}  // namespace windsplat::data::zarr
