// Reads blocks from chunks; decoded chunks are cached for the next block.
#include "server/data/formats/zarr/chunks.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/formats/zarr/codec.hpp"
#include "server/data/formats/zarr/half.hpp"
#include "server/data/formats/zarr/look_ahead.hpp"
#include "server/data/formats/zarr/shard.hpp"
#include "server/data/formats/zarr/store.hpp"

namespace windsplat::data::zarr {

namespace {

// Cache limits: the first one in general, the second one for the chunks of a single block.
constexpr std::size_t kept_bytes_least = std::size_t{64} << 20;
constexpr std::size_t kept_bytes_most = std::size_t{512} << 20;
// Indices of shards; an open file counts as 2 MiB, so that at most 32 are open.
constexpr std::size_t kept_shards_bytes = std::size_t{64} << 20;
constexpr std::size_t open_file_bytes = std::size_t{2} << 20;

std::size_t count_along(std::size_t length, std::size_t part) {
  return length / part + (length % part != 0 ? 1 : 0);
}

std::uint64_t files_along(const ArrayMetadata& array, std::size_t d) {
  return count_along(array.shape[d], array.file_shape()[d]);
}

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

std::size_t product(const std::vector<std::size_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), std::size_t{1}, std::multiplies<>());
}

// Items of a chunk that lie in the array.
std::size_t items_of(const ArrayMetadata& array, const std::vector<std::size_t>& place) {
  return product(
      overlap_of(array, place, std::vector<std::size_t>(place.size(), 0), array.shape).count);
}

// Items between neighbours along each dimension; order: dimensions, slowest first.
std::vector<std::size_t> strides_of(const std::vector<std::size_t>& lengths,
                                    const std::vector<std::size_t>& order) {
  std::vector<std::size_t> out(lengths.size(), 1);
  std::size_t stride = 1;
  for (std::size_t i = order.size(); i-- > 0;) {
    const std::size_t d = order[i];
    out[d] = stride;
    stride *= lengths[d];
  }
  return out;
}

std::vector<std::size_t> in_order(std::size_t rank) {
  std::vector<std::size_t> out(rank);
  std::iota(out.begin(), out.end(), std::size_t{0});
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
void copy_overlap(const ArrayMetadata& array, const ChunkBytes& bytes, const Overlap& part,
                  const std::vector<std::size_t>& block, Out* out) {
  const std::size_t rank = block.size();
  const std::size_t item = array.dtype.bytes;
  const auto from = strides_of(array.chunks, array.order);
  const auto to = strides_of(block, in_order(rank));
  const CopyRow<Out> copy = copier<Out>(array.dtype);
  const auto absent = static_cast<Out>(absent_value(array, std::is_same_v<Out, float>));
  const std::size_t row = rank == 0 ? 1 : part.count.back();
  const std::size_t row_stride = rank == 0 ? item : from.back() * item;
  std::vector<std::size_t> place(rank, 0);
  ChunkRange all{std::vector<std::size_t>(rank, 0), part.count};
  for (std::size_t& last : all.last) --last;
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
  } while (rank > 0 && advance(place, all, rank - 1));
}

}  // namespace

bool advance(std::vector<std::size_t>& place, const ChunkRange& range, std::size_t dimensions) {
  for (std::size_t d = dimensions; d-- > 0;) {
    if (++place[d] <= range.last[d]) return true;
    place[d] = range.first[d];
  }
  return false;
}

ChunkRange range_of(const std::vector<std::size_t>& shape, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count) {
  ChunkRange out;
  for (std::size_t d = 0; d < shape.size(); ++d) {
    out.first.push_back(start[d] / shape[d]);
    out.last.push_back((start[d] + count[d] - 1) / shape[d]);
  }
  return out;
}

std::uint64_t number_of_file(const ArrayMetadata& array, const std::vector<std::size_t>& file) {
  std::uint64_t out = 0;
  for (std::size_t d = 0; d < file.size(); ++d) out = out * files_along(array, d) + file[d];
  return out;
}

ChunkRange chunks_in(const ArrayMetadata& array, const std::vector<std::size_t>& file,
                     const ChunkRange& chunks) {
  ChunkRange out = chunks;
  for (std::size_t d = 0; d < file.size(); ++d) {
    const std::size_t along = array.file_shape()[d] / array.chunks[d];
    out.first[d] = std::max(out.first[d], file[d] * along);
    out.last[d] = std::min(out.last[d], file[d] * along + along - 1);
  }
  return out;
}

ChunkPlace place_of(const ArrayMetadata& array, const std::vector<std::size_t>& place) {
  ChunkPlace out;
  const std::vector<std::size_t>& shape = array.file_shape();
  std::vector<std::size_t> along;  // chunks of a file
  for (std::size_t d = 0; d < place.size(); ++d) {
    along.push_back(shape[d] / array.chunks[d]);
    out.file = out.file * files_along(array, d) + place[d] / along[d];
    out.per_file *= along[d];
  }
  const auto strides = strides_of(along, array.shard ? array.shard->order : in_order(place.size()));
  for (std::size_t d = 0; d < place.size(); ++d) {
    out.in_file += place[d] % along[d] * strides[d];
  }
  return out;
}

std::uint64_t file_count(const ArrayMetadata& array) {
  std::uint64_t count = 1;
  for (std::size_t d = 0; d < array.shape.size(); ++d) count *= files_along(array, d);
  return count;
}

std::string file_key(const ArrayMetadata& array, std::uint64_t number) {
  const std::size_t rank = array.shape.size();
  std::vector<std::uint64_t> place(rank);
  for (std::size_t d = rank; d-- > 0;) {
    place[d] = number % files_along(array, d);
    number /= files_along(array, d);
  }
  std::string key = array.prefixed_keys ? "c" : "";
  for (const std::uint64_t index : place) {
    if (!key.empty()) key += array.separator;
    key += std::to_string(index);
  }
  return key.empty() ? "0" : key;
}

std::vector<std::size_t> Store::chunk(int variable) const {
  return array_of(variable).metadata.chunks;
}

void Store::forget_chunks(int variable) const {
  const std::lock_guard lock(mutex_);
  kept_.forget(variable);
  shards_.forget(variable);
  std::erase_if(expected_, [variable](const auto& one) { return one.first.first == variable; });
}

Result<Store::File> Store::open_file(const Array& array, std::uint64_t number) const {
  const std::string path = array.path + file_key(array.metadata, number);
  auto input = array.metadata.shard ? files_->open_parts(path) : files_->open(path);
  if (!input && input.error().kind != ErrorKind::not_found) return input.error();
  File out;
  out.path = path;
  if (input) out.input = std::move(*input);
  return out;
}

Error Store::fault(const std::string& path, const std::string& what) const {
  return make_error(ErrorKind::bad_data,
                    in_quotes(contents_.name) + ": the chunk " + in_quotes(path) + " " + what);
}

Result<const Store::OpenShard*> Store::shard_at(const Array& array, std::uint64_t number) const {
  if (OpenShard* const kept = shards_.find(number)) return reopened(array, number, *kept);
  auto known = expected_.extract({variable_of(array), number});
  auto shard = known ? std::move(known.mapped()) : open_shard(array, number);
  if (!shard) return shard.error();
  const std::size_t bytes = shard->index.size() * sizeof(Span) + open_file_bytes;
  shards_.evict_for(bytes, kept_shards_bytes);
  return shards_.add(number, std::move(*shard), bytes);
}

Result<Store::OpenShard> Store::open_shard(const Array& array, std::uint64_t number) const {
  auto file = open_file(array, number);
  if (!file) return file.error();
  OpenShard shard;
  shard.file = std::move(*file);
  if (shard.file.input) {
    auto index = read_index(array.metadata, *shard.file.input);
    if (!index) return fault(shard.file.path, index.error().message);
    shard.index = std::move(*index);
    shard.identity = shard.file.input->identity();
  }
  return shard;
}

Result<const Store::OpenShard*> Store::reopened(const Array& array, std::uint64_t number,
                                                OpenShard& kept) const {
  if (kept.file.input || kept.index.empty()) return &kept;
  auto file = open_file(array, number);
  if (!file) return file.error();
  bool is_same = file->input && file->input->identity() == kept.identity;
  // A file that is fetched as a whole by now has another identity.
  if (!is_same && file->input && file->input->parts().number == 0) {
    const auto index = read_index(array.metadata, *file->input);
    is_same = index && *index == kept.index;
  }
  if (!is_same) return fault(kept.file.path, "has changed since it was opened; open it again");
  kept.file = std::move(*file);
  return &kept;
}

// What is on disk of a file in parts may then be removed, where room is needed.
void Store::close_parts(int variable, std::uint64_t number) const {
  if (!shards_.has(variable, number)) return;
  OpenShard& shard = *shards_.find(number);
  if (shard.file.input && shard.file.input->parts().number != 0) shard.file.input.reset();
}

Result<ChunkBytes> Store::load(const Array& array, std::uint64_t file_number,
                               std::size_t in_file) const {
  File file;
  Span span;
  std::string place;
  if (array.metadata.shard) {
    const auto shard = shard_at(array, file_number);
    if (!shard) return shard.error();
    file = (*shard)->file;
    if ((*shard)->is_absent(in_file)) return ChunkBytes();
    if (auto same = file.input->check_unchanged(); !same) return same.error();
    span = (*shard)->index.at(in_file);
    place = "is damaged: its part " + std::to_string(in_file) + " ";
  } else {
    auto opened = open_file(array, file_number);
    if (!opened) return opened.error();
    file = std::move(*opened);
    if (!file.input) return ChunkBytes();
    span.bytes = file.input->size();
  }
  if (span.bytes > stored_bytes_max(array.metadata)) {
    return fault(file.path, place + "has more bytes than its array can need");
  }
  ChunkBytes stored(span.bytes);
  if (auto done = file.input->read(span.offset, stored.data(), stored.size()); !done) {
    return done.error();
  }
  auto bytes = decode_chunk(array.metadata, std::move(stored));
  if (!bytes) return fault(file.path, place + bytes.error().message);
  return bytes;
}

Result<Store::Chunk*> Store::chunk_at(int variable, const std::vector<std::size_t>& place,
                                      std::size_t kept_bytes_max) const {
  const Array& array = array_of(variable);
  const ChunkPlace at = place_of(array.metadata, place);
  kept_.select(variable);
  shards_.select(variable);
  if (Chunk* const kept = kept_.find(at.number())) return kept;
  kept_.evict_for(array.metadata.chunk_items() * array.metadata.dtype.bytes, kept_bytes_max);
  auto loaded = load(array, at.file, at.in_file);
  if (!loaded) return loaded.error();
  const std::size_t bytes = loaded->size();
  return kept_.add(at.number(), {std::move(*loaded), items_of(array.metadata, place)}, bytes);
}

cf::Unwritten Store::unwritten(int variable, std::size_t most) const {
  const Array& array = array_of(variable);
  const ArrayMetadata& metadata = array.metadata;
  if (!std::isnan(absent_value(metadata, false))) return {};
  if (files_->location().fetched) return {};  // indices are fetched when chunks are read
  std::size_t chunks = 1;
  ChunkRange all{std::vector<std::size_t>(metadata.shape.size(), 0), {}};
  for (std::size_t d = 0; d < metadata.shape.size(); ++d) {
    const std::size_t along = count_along(metadata.shape[d], metadata.chunks[d]);
    if (along == 0) return {};
    chunks *= along;
    all.last.push_back(along - 1);
  }
  cf::Unwritten out;
  out.looked_at = std::min(chunks, most);
  out.is_all = out.looked_at == chunks;
  if (!metadata.shard) {
    // Files were looked at when the store was opened.
    return out.is_all ? cf::Unwritten{array.absent_files, chunks, true} : cf::Unwritten{};
  }
  const std::lock_guard lock(mutex_);
  shards_.select(variable);
  std::vector<std::size_t> place = all.first;
  for (std::size_t i = 0; i < out.looked_at; ++i) {
    const ChunkPlace at = place_of(metadata, place);
    const auto shard = shard_at(array, at.file);
    if (!shard) return {};  // the error is that of reading it
    out.chunks += (*shard)->is_absent(at.in_file) ? 1 : 0;
    advance(place, all, place.size());
  }
  return out;
}

template <class Out>
Result<void> Store::read_block(int variable, const std::vector<std::size_t>& start,
                               const std::vector<std::size_t>& count, Out* out) const {
  const Array& of = array_of(variable);
  if (of.line) {
    for (std::size_t i = 0; i < count[0]; ++i) out[i] = static_cast<Out>(of.line->at(start[0] + i));
    return {};
  }
  const ArrayMetadata& array = of.metadata;
  const std::size_t rank = start.size();
  if (std::find(count.begin(), count.end(), 0) != count.end()) return {};
  const ChunkRange chunks = range_of(array.chunks, start, count);
  const ChunkRange files = range_of(array.file_shape(), start, count);
  std::size_t needed = array.chunk_items() * array.dtype.bytes + kept_.bookkeeping_bytes;
  for (std::size_t d = 0; d < rank; ++d) {
    const std::size_t along = chunks.last[d] - chunks.first[d] + 1;
    needed = needed > kept_bytes_most / along ? kept_bytes_most : needed * along;
  }
  const std::lock_guard lock(mutex_);
  kept_.select(variable);
  shards_.select(variable);
  std::vector<std::size_t> file = files.first;
  Outlook outlook(files, chunks);
  do {  // one file after the other
    if (files_->location().fetched) look_ahead(of, outlook);
    const ChunkRange here = chunks_in(array, file, chunks);
    std::vector<std::size_t> place = here.first;
    do {
      const auto chunk = chunk_at(variable, place, std::max(needed, kept_bytes_least));
      if (!chunk) return chunk.error();
      const Overlap part = overlap_of(array, place, start, count);
      copy_overlap(array, (*chunk)->bytes, part, count, out);
      // The next chunk takes the memory of one that was read to its end, which is still in the
      // processor's cache.
      const std::size_t items = product(part.count);
      (*chunk)->unread_items -= std::min(items, (*chunk)->unread_items);
      if ((*chunk)->unread_items == 0) kept_.drop_newest();
    } while (advance(place, here, rank));
    if (array.shard) close_parts(variable, number_of_file(array, file));
  } while (advance(file, files, rank));
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
