// Appends encoded chunks to files by plain descriptors, and notes where they are.
#include "server/data/formats/zarr/write/shard_writer.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <limits>
#include <numeric>
#include <system_error>
#include <type_traits>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/disk_error.hpp"
#include "server/data/formats/zarr/crc32c.hpp"
#include "server/data/formats/zarr/write/encode.hpp"

namespace windsplat::data::zarr {

namespace {

namespace fs = std::filesystem;

constexpr mode_t mode_of_chunk_files = 0666;  // before umask

Error write_error(const fs::path& path, int fault) {
  return disk_error(fault, "cannot write " + in_quotes(path.native()));
}

std::size_t count_of(const std::vector<std::size_t>& lengths) {
  return std::accumulate(lengths.begin(), lengths.end(), std::size_t{1}, std::multiplies<>());
}

// The indices of entry `number`, counted with the last dimension fastest.
std::vector<std::size_t> indices_of(std::size_t number, const std::vector<std::size_t>& lengths) {
  std::vector<std::size_t> out(lengths.size());
  for (std::size_t d = lengths.size(); d-- > 0; number /= lengths[d]) {
    out[d] = number % lengths[d];
  }
  return out;
}

std::vector<std::size_t> quotients(const std::vector<std::size_t>& a,
                                   const std::vector<std::size_t>& b) {
  std::vector<std::size_t> out;
  for (std::size_t d = 0; d < a.size(); ++d) out.push_back((a[d] - 1) / b[d] + 1);
  return out;
}

// The items of the chunk that begins at `first`, which may reach beyond the array.
template <class T>
std::vector<T> cut_chunk(const WrittenArray& array, const std::vector<std::size_t>& first,
                         std::span<const T> items) {
  const T absent = array.dtype.kind == 'f' ? std::numeric_limits<T>::quiet_NaN() : T{};
  std::vector<T> out(count_of(array.chunk), absent);
  const std::size_t last = array.shape.size() - 1;
  const std::size_t row = std::min(array.chunk[last], array.shape[last] - first[last]);
  std::vector<std::size_t> rows = array.chunk;
  rows[last] = 1;
  for (std::size_t n = 0; n < count_of(rows); ++n) {
    const std::vector<std::size_t> at = indices_of(n, rows);
    std::size_t from = 0;
    bool is_within = true;
    for (std::size_t d = 0; d <= last; ++d) {
      is_within = is_within && first[d] + at[d] < array.shape[d];
      from = from * array.shape[d] + first[d] + at[d];
    }
    if (is_within) std::copy_n(items.data() + from, row, out.data() + n * array.chunk[last]);
  }
  return out;
}

template <class T>
Result<std::vector<WrittenFile>> write_items(const fs::path& store, const WrittenArray& array,
                                             std::span<const T> items) {
  WINDSPLAT_CHECK(items.size() == count_of(array.shape));
  std::vector<WrittenFile> out;
  const std::vector<std::size_t> regions = quotients(array.shape, array.region());
  const std::vector<std::size_t> chunks = quotients(array.region(), array.chunk);
  for (std::size_t r = 0; r < count_of(regions); ++r) {
    const std::vector<std::size_t> place = indices_of(r, regions);
    ShardWriter writer(store, array, place);
    for (std::size_t c = 0; c < count_of(chunks); ++c) {
      std::vector<std::size_t> first = indices_of(c, chunks);
      bool is_within = true;
      for (std::size_t d = 0; d < first.size(); ++d) {
        first[d] = (place[d] * chunks[d] + first[d]) * array.chunk[d];
        is_within = is_within && first[d] < array.shape[d];
      }
      if (!is_within) continue;
      const std::vector<T> chunk = cut_chunk(array, first, items);
      if (auto done = writer.add(c, std::span<const T>(chunk)); !done) return done.error();
    }
    auto files = writer.close();
    if (!files) return files;
    out.insert(out.end(), files->begin(), files->end());
  }
  return out;
}

}  // namespace

ShardWriter::ShardWriter(fs::path store, const WrittenArray& array,
                         const std::vector<std::size_t>& place)
    : store_(std::move(store)),
      array_(&array),
      place_(place),
      chunks_(quotients(array.region(), array.chunk)),
      index_(count_of(chunks_), Span{absent_span, absent_span}) {
  WINDSPLAT_CHECK(place.size() == array.shape.size());
  for (std::size_t d = 0; d < place.size(); ++d) {
    WINDSPLAT_CHECK(place[d] < quotients(array.shape, array.region())[d]);
  }
}

ShardWriter::ShardWriter(ShardWriter&& other) noexcept
    : store_(std::move(other.store_)),
      array_(other.array_),
      place_(std::move(other.place_)),
      chunks_(std::move(other.chunks_)),
      index_(std::move(other.index_)),
      files_(std::move(other.files_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      is_closed_(std::exchange(other.is_closed_, true)) {}

ShardWriter::~ShardWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (is_closed_) return;
  std::error_code ignored;
  for (const WrittenFile& file : files_) fs::remove(store_ / file.path, ignored);
}

Result<void> ShardWriter::add(std::size_t chunk, std::span<const float> items) {
  return add_items(chunk, items);
}
Result<void> ShardWriter::add(std::size_t chunk, std::span<const double> items) {
  return add_items(chunk, items);
}
Result<void> ShardWriter::add(std::size_t chunk, std::span<const std::uint32_t> items) {
  return add_items(chunk, items);
}

template <class T>
Result<void> ShardWriter::add_items(std::size_t chunk, std::span<const T> items) {
  const Dtype type{std::is_floating_point_v<T> ? 'f' : 'u', sizeof(T)};
  WINDSPLAT_CHECK(!is_closed_ && array_->dtype == type);
  WINDSPLAT_CHECK(items.size() == count_of(array_->chunk));
  Span& span = index_.at(chunk);
  WINDSPLAT_CHECK(span.bytes == absent_span);
  const std::span bytes(reinterpret_cast<const unsigned char*>(items.data()), items.size_bytes());
  if (may_be_absent(*array_, bytes)) return {};
  auto stored = encode_chunk(*array_, bytes);
  if (!stored) return stored.error();
  const bool is_shard = !array_->shard.empty() && array_->format == StoreFormat::v3;
  if (!is_shard || files_.empty()) {
    if (auto done = open(path_of(chunk)); !done) return done;
  }
  span = {files_.back().bytes, stored->size()};
  if (auto done = append(*stored); !done) return done;
  return is_shard ? Result<void>() : finish_file();
}

Result<std::vector<WrittenFile>> ShardWriter::close() {
  WINDSPLAT_CHECK(!is_closed_);
  if (descriptor_ >= 0) {
    ChunkBytes index;
    for (const Span& span : index_) {
      append_number(span.offset, 8, index);
      append_number(span.bytes, 8, index);
    }
    append_number(crc32c(index.data(), index.size()), 4, index);
    if (auto done = append(index); !done) return done.error();
    if (auto done = finish_file(); !done) return done.error();
  }
  is_closed_ = true;
  return std::move(files_);
}

// The file of a chunk: its own, or that of the region.
std::string ShardWriter::path_of(std::size_t chunk) const {
  const bool v2 = array_->format == StoreFormat::v2;
  std::string out = array_->path + (v2 ? "/" : "/c");
  const std::vector<std::size_t> within = indices_of(chunk, chunks_);
  for (std::size_t d = 0; d < place_.size(); ++d) {
    const std::size_t index = v2 ? place_[d] * chunks_[d] + within[d] : place_[d];
    if (!v2 || d > 0) out += v2 ? "." : "/";
    out += std::to_string(index);
  }
  return out;
}

Result<void> ShardWriter::open(const std::string& path) {
  const fs::path file = store_ / path;
  std::error_code fault;
  fs::create_directories(file.parent_path(), fault);
  if (fault) {
    return disk_error(fault.value(), "cannot create " + in_quotes(file.parent_path().native()));
  }
  descriptor_ = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW,
                       mode_of_chunk_files);
  if (descriptor_ < 0) return write_error(file, errno);
  files_.push_back({path, 0, 0});
  return {};
}

Result<void> ShardWriter::append(std::span<const unsigned char> bytes) {
  WrittenFile& file = files_.back();
  file.bytes += bytes.size();
  file.crc32c = crc32c(bytes.data(), bytes.size(), file.crc32c);
  while (!bytes.empty()) {
    const ssize_t wrote = ::write(descriptor_, bytes.data(), bytes.size());
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote < 0) return write_error(store_ / file.path, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(wrote));
  }
  return {};
}

Result<void> ShardWriter::finish_file() {
  int fault = ::fdatasync(descriptor_) == 0 ? 0 : errno;
  if (::close(std::exchange(descriptor_, -1)) != 0 && fault == 0) fault = errno;
  if (fault != 0) return write_error(store_ / files_.back().path, fault);
  return {};
}

Result<std::vector<WrittenFile>> write_array(const fs::path& store, const WrittenArray& array,
                                             std::span<const float> items) {
  return write_items(store, array, items);
}
Result<std::vector<WrittenFile>> write_array(const fs::path& store, const WrittenArray& array,
                                             std::span<const double> items) {
  return write_items(store, array, items);
}
Result<std::vector<WrittenFile>> write_array(const fs::path& store, const WrittenArray& array,
                                             std::span<const std::uint32_t> items) {
  return write_items(store, array, items);
}

}  // namespace windsplat::data::zarr
