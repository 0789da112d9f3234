// Reads blocks from chunks; decoded chunks are cached for the next block.
#include "server/data/formats/zarr/chunks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/formats/zarr/codec.hpp"
#include "server/data/formats/zarr/store.hpp"

namespace windsplat::data::zarr {

namespace {

// Cache limits: the first always, the second for the chunks of one block.
constexpr std::size_t kept_bytes_least = std::size_t{64} << 20;
constexpr std::size_t kept_bytes_most = std::size_t{512} << 20;

std::uint64_t chunks_along(const ArrayMetadata& array, std::size_t d) {
  return array.shape[d] / array.chunks[d] + (array.shape[d] % array.chunks[d] != 0 ? 1 : 0);
}

// IEEE 754 binary16.
float widen(std::uint16_t half) {
  const int exponent = (half >> 10U) & 0x1f;
  const auto fraction = static_cast<float>(half & 0x3ffU);
  float value = 0;
  if (exponent == 31) {
    value = fraction != 0 ? std::numeric_limits<float>::quiet_NaN()
                          : std::numeric_limits<float>::infinity();
  } else if (exponent == 0) {
    value = std::ldexp(fraction, -24);
  } else {
    value = std::ldexp(fraction + 1024, exponent - 25);
  }
  return (half & 0x8000U) != 0 ? -value : value;
}

struct Half {
  std::uint16_t bits;
  explicit operator float() const { return widen(bits); }
  explicit operator double() const { return static_cast<double>(widen(bits)); }
};

template <class T, class Out>
void copy_row(const unsigned char* from, std::size_t stride_bytes, std::size_t count, Out* out) {
  if constexpr (std::is_same_v<T, Out>) {
    if (stride_bytes == sizeof(T)) {
      std::memcpy(out, from, count * sizeof(T));
      return;
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    T value;
    std::memcpy(&value, from + i * stride_bytes, sizeof value);
    out[i] = static_cast<Out>(value);
  }
}

template <class Out>
using CopyRow = void (*)(const unsigned char*, std::size_t, std::size_t, Out*);

template <class Out>
CopyRow<Out> copier(const Dtype& type) {
  const bool is_signed = type.kind == 'i';
  switch (type.bytes) {
    case 1:
      return is_signed ? copy_row<std::int8_t, Out> : copy_row<std::uint8_t, Out>;
    case 2:
      return type.kind == 'f' ? copy_row<Half, Out>
             : is_signed      ? copy_row<std::int16_t, Out>
                              : copy_row<std::uint16_t, Out>;
    case 4:
      return type.kind == 'f' ? copy_row<float, Out>
             : is_signed      ? copy_row<std::int32_t, Out>
                              : copy_row<std::uint32_t, Out>;
    default:
      return type.kind == 'f' ? copy_row<double, Out>
             : is_signed      ? copy_row<std::int64_t, Out>
                              : copy_row<std::uint64_t, Out>;
  }
}

// Advances an index within lengths, last dimension fastest; false after the last index.
bool advance(std::vector<std::size_t>& place, const std::vector<std::size_t>& first,
             const std::vector<std::size_t>& last, std::size_t dimensions) {
  for (std::size_t d = dimensions; d-- > 0;) {
    if (++place[d] <= last[d]) return true;
    place[d] = first[d];
  }
  return false;
}

// The part of one chunk that lies in a block.
struct Overlap {
  std::vector<std::size_t> in_chunk;  // its first item
  std::vector<std::size_t> in_block;
  std::vector<std::size_t> count;
};

Overlap overlap_of(const ArrayMetadata& array, const std::vector<std::size_t>& place,
                   const std::vector<std::size_t>& start, const std::vector<std::size_t>& count) {
  Overlap out;
  for (std::size_t d = 0; d < place.size(); ++d) {
    const std::size_t corner = place[d] * array.chunks[d];
    const std::size_t first = std::max(corner, start[d]);
    const std::size_t end = std::min(corner + array.chunks[d], start[d] + count[d]);
    out.in_chunk.push_back(first - corner);
    out.in_block.push_back(first - start[d]);
    out.count.push_back(end - first);
  }
  return out;
}

// Items between neighbours along each dimension.
std::vector<std::size_t> strides_of(const std::vector<std::size_t>& lengths, bool column_major) {
  const std::size_t rank = lengths.size();
  std::vector<std::size_t> out(rank, 1);
  std::size_t stride = 1;
  for (std::size_t i = 0; i < rank; ++i) {
    const std::size_t d = column_major ? i : rank - 1 - i;
    out[d] = stride;
    stride *= lengths[d];
  }
  return out;
}

// The value of absent chunks; NaN (masked) if undefined or not representable as float.
double absent_value(const ArrayMetadata& array, bool as_float) {
  constexpr double masked = std::numeric_limits<double>::quiet_NaN();
  const double fill = array.fill_value.value_or(masked);
  const bool fits = std::abs(fill) <= static_cast<double>(std::numeric_limits<float>::max());
  return as_float && !fits ? masked : fill;
}

// Copies an overlap into the block row by row, or fills it if the chunk is absent.
template <class Out>
void copy_overlap(const ArrayMetadata& array, const std::vector<unsigned char>& bytes,
                  const Overlap& part, const std::vector<std::size_t>& block, Out* out) {
  const std::size_t rank = block.size();
  const std::size_t item = array.dtype.bytes;
  const auto from = strides_of(array.chunks, array.column_major);
  const auto to = strides_of(block, false);
  const CopyRow<Out> copy = copier<Out>(array.dtype);
  const auto absent = static_cast<Out>(absent_value(array, std::is_same_v<Out, float>));
  const std::size_t row = rank == 0 ? 1 : part.count.back();
  const std::size_t row_stride = rank == 0 ? item : from.back() * item;
  std::vector<std::size_t> place(rank, 0);
  const std::vector<std::size_t> first(rank, 0);
  std::vector<std::size_t> last = part.count;
  for (std::size_t& end : last) --end;
  do {
    std::size_t source = 0;
    std::size_t target = 0;
    for (std::size_t d = 0; d < rank; ++d) {
      source += (part.in_chunk[d] + place[d]) * from[d];
      target += (part.in_block[d] + place[d]) * to[d];
    }
    if (bytes.empty()) {
      std::fill_n(out + target, row, absent);
    } else {
      copy(bytes.data() + source * item, row_stride, row, out + target);
    }
  } while (rank > 0 && advance(place, first, last, rank - 1));
}

}  // namespace

std::uint64_t chunk_count(const ArrayMetadata& array) {
  std::uint64_t count = 1;
  for (std::size_t d = 0; d < array.shape.size(); ++d) count *= chunks_along(array, d);
  return count;
}

std::string chunk_key(const ArrayMetadata& array, std::uint64_t number) {
  const std::size_t rank = array.shape.size();
  if (rank == 0) return "0";
  std::vector<std::uint64_t> place(rank);
  for (std::size_t d = rank; d-- > 0;) {
    place[d] = number % chunks_along(array, d);
    number /= chunks_along(array, d);
  }
  std::string key;
  for (const std::uint64_t index : place) {
    if (!key.empty()) key += array.separator;
    key += std::to_string(index);
  }
  return key;
}

std::vector<std::size_t> Store::chunk(int variable) const {
  return array_of(variable).metadata.chunks;
}

void Store::forget_chunks(int variable) const {
  const std::lock_guard lock(mutex_);
  kept_.forget(variable);
}

Result<ChunkBytes> Store::load(const Array& array, const std::string& path) const {
  const auto fault = [&](const std::string& what) {
    return make_error(ErrorKind::bad_data,
                      in_quotes(contents_.name) + ": the chunk " + in_quotes(path) + " " + what);
  };
  auto input = files_->open(path);
  if (!input && input.error().kind == ErrorKind::not_found) return ChunkBytes();
  if (!input) return input.error();
  if ((*input)->size() > stored_bytes_max(array.metadata)) {
    return fault("has more bytes than its array can need");
  }
  std::vector<unsigned char> stored((*input)->size());
  if (auto done = (*input)->read(0, stored.data(), stored.size()); !done) return done.error();
  auto bytes = decode_chunk(array.metadata, std::move(stored));
  if (!bytes) return fault(bytes.error().message);
  return bytes;
}

Result<const ChunkBytes*> Store::chunk_at(int variable, const std::vector<std::size_t>& place,
                                          std::size_t kept_bytes_max) const {
  const Array& array = array_of(variable);
  kept_.select(variable);
  std::uint64_t number = 0;
  for (std::size_t d = 0; d < place.size(); ++d) {
    number = number * chunks_along(array.metadata, d) + place[d];
  }
  if (const ChunkBytes* const kept = kept_.find(number)) return kept;
  kept_.evict_for(array.metadata.chunk_items() * array.metadata.dtype.bytes, kept_bytes_max);
  auto loaded = load(array, array.path + chunk_key(array.metadata, number));
  if (!loaded) return loaded.error();
  return kept_.add(number, std::move(*loaded));
}

template <class Out>
Result<void> Store::read_block(int variable, const std::vector<std::size_t>& start,
                               const std::vector<std::size_t>& count, Out* out) const {
  const ArrayMetadata& array = array_of(variable).metadata;
  std::vector<std::size_t> first;
  std::vector<std::size_t> last;
  std::size_t needed = array.chunk_items() * array.dtype.bytes + ChunkCache::bookkeeping_bytes;
  for (std::size_t d = 0; d < start.size(); ++d) {
    if (count[d] == 0) return {};
    first.push_back(start[d] / array.chunks[d]);
    last.push_back((start[d] + count[d] - 1) / array.chunks[d]);
    const std::size_t along = last[d] - first[d] + 1;
    needed = needed > kept_bytes_most / along ? kept_bytes_most : needed * along;
  }
  const std::lock_guard lock(mutex_);
  std::vector<std::size_t> place = first;
  do {
    const auto chunk = chunk_at(variable, place, std::max(needed, kept_bytes_least));
    if (!chunk) return chunk.error();
    copy_overlap(array, **chunk, overlap_of(array, place, start, count), count, out);
  } while (advance(place, first, last, place.size()));
  return {};
}

Result<void> Store::read(int variable, const std::vector<std::size_t>& start,
                         const std::vector<std::size_t>& count, double* out) const {
  return read_block(variable, start, count, out);
}

Result<void> Store::read(int variable, const std::vector<std::size_t>& start,
                         const std::vector<std::size_t>& count, float* out) const {
  return read_block(variable, start, count, out);
}

}  // namespace windsplat::data::zarr
