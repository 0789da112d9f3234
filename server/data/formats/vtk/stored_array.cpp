// Bytes of a file, plain or base64 -> blocks, decompressed if necessary -> numbers of either byte
// order; or numbers as text.
#include "server/data/formats/vtk/stored_array.hpp"

#include <lz4.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/base/check.hpp"
#include "server/data/bytes/text.hpp"

namespace windsplat::data::vtk {

namespace {

constexpr std::size_t part_bytes_max = std::size_t{1} << 18;
constexpr std::uint64_t block_bytes_max = std::uint64_t{256} << 20;
// Upper bound on the compression ratio: deflate 1032, LZ4 255.
constexpr std::uint64_t growth_max = 1040;
constexpr std::size_t token_max = 128;

// 0 to 63; 64: padding; 65: invalid.
constexpr std::array<unsigned char, 256> base64_values = [] {
  std::array<unsigned char, 256> table{};
  table.fill(65);
  constexpr std::string_view letters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < letters.size(); ++i) {
    table[static_cast<unsigned char>(letters[i])] = static_cast<unsigned char>(i);
  }
  table['='] = 64;
  return table;
}();

// Buffered reader of a file, starting at an offset.
class FileBytes {
 public:
  FileBytes(std::shared_ptr<const InputFile> file, std::uint64_t offset, std::uint64_t room)
      : file_(std::move(file)), at_(offset), left_(room) {}

  // The next byte; -1 at the end of the array. Sets `bad` if the file cannot be read.
  int next(Result<void>& bad) {
    if (used_ == buffer_.size() && !refill(bad)) return -1;
    return buffer_[used_++];
  }

  Result<void> read(unsigned char* out, std::size_t count) {
    while (count > 0) {
      Result<void> bad;
      if (used_ == buffer_.size() && !refill(bad)) {
        return bad ? Result<void>(file_->fault("ends within an array")) : bad;
      }
      const std::size_t part = std::min(count, buffer_.size() - used_);
      std::memcpy(out, buffer_.data() + used_, part);
      used_ += part;
      out += part;
      count -= part;
    }
    return {};
  }

 private:
  bool refill(Result<void>& bad) {
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(left_, part_bytes_max));
    buffer_.resize(size);
    used_ = 0;
    if (size == 0) return false;
    bad = file_->read(at_, buffer_.data(), size);
    if (!bad) {
      buffer_.clear();
      return false;
    }
    at_ += size;
    left_ -= size;
    return true;
  }

  std::shared_ptr<const InputFile> file_;
  std::uint64_t at_;
  std::uint64_t left_;
  std::vector<unsigned char> buffer_;
  std::size_t used_ = 0;
};

class FileStream final : public ArrayStream {
 public:
  using ArrayStream::read;
  FileStream(std::shared_ptr<const InputFile> file, const StoredArray& array)
      : file_(std::move(file)),
        array_(array),
        value_bytes_(bytes::size_of(array.type)),
        left_(array.values()),
        bytes_(file_, array.offset, array.room) {}

  Result<void> begin() {
    if (array_.offset > file_->size() || array_.room > file_->size() - array_.offset) {
      return fault("begins beyond the end of the file");
    }
    if (left_ > (std::uint64_t{1} << 56)) return fault("is too large");
    if (array_.encoding == Encoding::text) {
      return array_.room + 1 >= 2 * left_
                 ? Result<void>()
                 : fault("has more values than the text of the file can hold");
    }
    const std::uint64_t wanted = left_ * value_bytes_;
    if (!array_.coding.has_header) {
      return wanted <= array_.room ? Result<void>() : fault("runs past the end of the file");
    }
    return array_.coding.compressor == Compressor::none ? begin_plain(wanted)
                                                        : begin_blocks(wanted);
  }

  Result<void> read(double* out, std::size_t count) override {
    WINDSPLAT_CHECK(count <= left_);
    left_ -= count;
    if (array_.encoding == Encoding::text) return read_text(out, count);
    while (count > 0) {
      const std::size_t part = std::min(count, part_bytes_max / value_bytes_);
      scratch_.resize(part * value_bytes_);
      if (auto done = payload(scratch_.data(), scratch_.size()); !done) return done;
      bytes::decode(array_.type, array_.coding.big_endian, scratch_.data(), value_bytes_, part,
                    out);
      out += part;
      count -= part;
    }
    return {};
  }

 private:
  [[nodiscard]] Error fault(const std::string& what) const {
    return file_->fault("is malformed: the array " + in_quotes(array_.name) + " " + what);
  }

  // Number of bytes available after base64 decoding.
  [[nodiscard]] std::uint64_t capacity() const {
    return array_.encoding == Encoding::base64 ? array_.room / 4 * 3 + 3 : array_.room;
  }

  Result<std::uint64_t> header_number() {
    std::array<unsigned char, 8> bytes{};
    const auto width = static_cast<std::size_t>(array_.coding.header_bytes);
    if (auto done = stored(bytes.data(), width); !done) return done.error();
    std::uint64_t number = 0;
    for (std::size_t i = 0; i < width; ++i) {
      number = number << 8 | bytes.at(array_.coding.big_endian ? i : width - 1 - i);
    }
    return number;
  }

  Result<void> begin_plain(std::uint64_t wanted) {
    const auto claimed = header_number();
    if (!claimed) return claimed.error();
    if (*claimed != wanted) {
      return fault("has " + std::to_string(*claimed) + " bytes instead of " +
                   std::to_string(wanted));
    }
    const auto header = static_cast<std::uint64_t>(array_.coding.header_bytes);
    if (wanted > capacity() || wanted + header > capacity()) {
      return fault("runs past the end of the file");
    }
    return {};
  }

  // Reads the table: number of blocks, bytes of each and of the last, compressed bytes of each.
  Result<void> begin_blocks(std::uint64_t wanted) {
    std::array<std::uint64_t, 3> head{};
    for (std::uint64_t& number : head) {
      const auto read = header_number();
      if (!read) return read.error();
      number = *read;
    }
    const auto [count, size, last] = head;
    if (count == 0) return wanted == 0 ? Result<void>() : fault("has no blocks");
    const auto width = static_cast<std::uint64_t>(array_.coding.header_bytes);
    if (count > capacity() / width || size > block_bytes_max || last > size || size == 0) {
      return fault("has a table of blocks that exceeds the file or the limit of 256 MiB per block");
    }
    if ((count - (last != 0 ? 1 : 0)) * size + last != wanted) {
      return fault("has blocks whose total size differs from its values");
    }
    std::uint64_t packed = (3 + count) * width;
    for (std::uint64_t b = 0; b < count; ++b) {
      const auto bytes = header_number();
      if (!bytes) return bytes.error();
      const std::uint64_t plain = b + 1 == count && last != 0 ? last : size;
      packed += *bytes;
      if (*bytes > capacity() || packed > capacity() || plain > *bytes * growth_max) {
        return fault("has a block that its compressed data cannot hold");
      }
      blocks_.push_back({*bytes, plain});
    }
    return {};
  }

  // Reads stored bytes after base64 decoding. Padding ends a unit; another unit may follow.
  Result<void> stored(unsigned char* out, std::size_t count) {
    if (array_.encoding == Encoding::raw) return bytes_.read(out, count);
    while (count > 0) {
      if (quad_.used == quad_.size) {
        if (auto done = next_quad(); !done) return done;
      }
      *out++ = quad_.bytes[quad_.used++];
      --count;
    }
    return {};
  }

  Result<void> next_quad() {
    std::uint32_t bits = 0;
    std::size_t padding = 0;
    for (int letters = 0; letters < 4;) {
      Result<void> bad;
      const int byte = bytes_.next(bad);
      if (!bad) return bad;
      if (byte >= 0 && is_blank(static_cast<char>(byte)) && byte != 0) continue;
      const unsigned char value = byte < 0 ? 65 : base64_values[static_cast<std::size_t>(byte)];
      if (value == 65 || (value == 64 && letters < 2) || (padding > 0 && value != 64)) {
        return fault("ends too early, or is not base64");
      }
      padding += value == 64 ? 1 : 0;
      bits = bits << 6 | (value & 63U);
      ++letters;
    }
    quad_.bytes = {static_cast<unsigned char>(bits >> 16), static_cast<unsigned char>(bits >> 8),
                   static_cast<unsigned char>(bits)};
    quad_.size = 3 - padding;
    quad_.used = 0;
    return {};
  }

  // Reads the bytes of the array after decompression.
  Result<void> payload(unsigned char* out, std::size_t count) {
    if (!array_.coding.has_header || array_.coding.compressor == Compressor::none) {
      return stored(out, count);
    }
    while (count > 0) {
      if (block_used_ == block_.size()) {
        if (auto done = next_block(); !done) return done;
      }
      const std::size_t part = std::min(count, block_.size() - block_used_);
      std::memcpy(out, block_.data() + block_used_, part);
      block_used_ += part;
      out += part;
      count -= part;
    }
    return {};
  }

  Result<void> next_block() {
    WINDSPLAT_CHECK(next_block_ < blocks_.size());
    const auto [packed_bytes, plain_bytes] = blocks_[next_block_++];
    packed_.resize(packed_bytes);
    if (auto done = stored(packed_.data(), packed_.size()); !done) return done;
    block_.resize(plain_bytes);
    block_used_ = 0;
    bool whole = false;
    if (array_.coding.compressor == Compressor::zlib) {
      uLongf size = plain_bytes;
      whole = ::uncompress(block_.data(), &size, packed_.data(), packed_.size()) == Z_OK &&
              size == plain_bytes;
    } else {
      const int size = ::LZ4_decompress_safe(
          reinterpret_cast<const char*>(packed_.data()), reinterpret_cast<char*>(block_.data()),
          static_cast<int>(packed_.size()), static_cast<int>(block_.size()));
      whole = size >= 0 && static_cast<std::uint64_t>(size) == plain_bytes;
    }
    if (!whole) return fault("has a block that cannot be decompressed");
    return {};
  }

  Result<void> read_text(double* out, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      std::array<char, token_max> token;
      std::size_t length = 0;
      Result<void> bad;
      for (;;) {
        const int byte = bytes_.next(bad);
        if (!bad) return bad;
        if (byte < 0 || is_blank(static_cast<char>(byte))) {
          if (length > 0 || byte < 0) break;
          continue;
        }
        if (length == token.size()) return fault("has a word instead of a number");
        token.at(length++) = static_cast<char>(byte);
      }
      const std::string_view word(token.data(), length);
      if (word.empty()) return fault("has fewer values than declared");
      const auto value = bytes::to_sample(word);
      if (!value) return fault("has " + in_quotes(word) + " instead of a number");
      out[i] = *value;
    }
    return {};
  }

  struct Quad {  // four characters of base64, decoded
    std::array<unsigned char, 3> bytes{};
    std::size_t size = 0;
    std::size_t used = 0;
  };
  struct Block {
    std::uint64_t packed = 0;
    std::uint64_t plain = 0;
  };

  std::shared_ptr<const InputFile> file_;
  StoredArray array_;
  std::size_t value_bytes_;
  std::uint64_t left_;
  FileBytes bytes_;
  Quad quad_;
  std::vector<Block> blocks_;
  std::size_t next_block_ = 0;
  std::vector<unsigned char> packed_;
  std::vector<unsigned char> block_;
  std::size_t block_used_ = 0;
  std::vector<unsigned char> scratch_;
};

}  // namespace

Result<void> ArrayStream::read(float* out, std::size_t count) {
  constexpr std::size_t values_max = std::size_t{1} << 14;
  std::vector<double> values(std::min(count, values_max));
  while (count > 0) {
    const std::size_t part = std::min(count, values.size());
    if (auto done = read(values.data(), part); !done) return done;
    out = std::transform(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(part), out,
                         [](double value) { return static_cast<float>(value); });
    count -= part;
  }
  return {};
}

Result<ArrayReader> ArrayReader::open(std::shared_ptr<const InputFile> file,
                                      const StoredArray& array) {
  if (array.encoding == Encoding::hdf5) return ArrayReader(hdf_stream(array));
  auto stream = std::make_unique<FileStream>(std::move(file), array);
  if (auto done = stream->begin(); !done) return done.error();
  return ArrayReader(std::move(stream));
}

Result<std::vector<double>> read_all(const std::shared_ptr<const InputFile>& file,
                                     const StoredArray& array) {
  auto reader = ArrayReader::open(file, array);
  if (!reader) return reader.error();
  std::vector<double> values(array.values());
  if (auto done = reader->read(values.data(), values.size()); !done) return done.error();
  return values;
}

}  // namespace windsplat::data::vtk
