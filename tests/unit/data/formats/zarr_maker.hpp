// Zarr stores written byte by byte, and compressed by the C libraries, for the tests of both
// versions.
#pragma once

#include <blosc.h>
#include <gtest/gtest.h>
#include <lz4.h>
#include <zlib.h>
#include <zstd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {

inline constexpr float kMasked = std::numeric_limits<float>::quiet_NaN();

inline void write(const std::string& path, const std::string& bytes) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  write_bytes(path, bytes);
}

template <class T>
std::string bytes_of_items(const std::vector<T>& items) {
  std::string out(items.size() * sizeof(T), ' ');
  std::memcpy(out.data(), items.data(), out.size());
  return out;
}

// A store of a root group with the metadata of a test.
class ZarrStore {
 public:
  explicit ZarrStore(const std::string& name = "s.zarr", const std::string& metadata = ".zgroup",
                     const std::string& json = R"({"zarr_format":2})")
      : root_(folder_ / name) {
    put(metadata, json);
  }
  [[nodiscard]] const std::string& path() const { return root_; }
  void put(const std::string& name, const std::string& bytes) const {
    write(root_ + "/" + name, bytes);
  }
  [[nodiscard]] std::vector<float> values(const std::string& field = "f") const {
    auto source = open_file(path());
    EXPECT_TRUE(source) << source.error().message;
    if (!source) return {};
    const FieldInfo* info = (*source)->info().find(field);
    EXPECT_NE(info, nullptr);
    if (info == nullptr) return {};
    auto volume =
        (*source)->read(static_cast<std::size_t>(info - (*source)->info().fields.data()), 0);
    EXPECT_TRUE(volume) << volume.error().message;
    if (!volume) return {};
    return {volume->values.begin(), volume->values.end()};
  }

  // The error of opening, or of reading the first field.
  [[nodiscard]] std::string fault() const {
    auto source = open_file(path());
    if (!source) return source.error().message;
    auto volume = (*source)->read(0, 0);
    return volume ? "" : volume.error().message;
  }

 private:
  Folder folder_;
  std::string root_;
};

inline void expect_same(const std::vector<float>& found, const std::vector<float>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::isnan(expected[i])) {
      EXPECT_TRUE(std::isnan(found[i])) << i << ": " << found[i];
    } else {
      EXPECT_EQ(found[i], expected[i]) << i;
    }
  }
}

inline std::string zlib_stream(const std::string& plain, int window_bits) {
  z_stream stream{};
  deflateInit2(&stream, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
  std::string out(plain.size() + 128, ' ');
  std::string in = plain;
  stream.next_in = reinterpret_cast<unsigned char*>(in.data());
  stream.avail_in = static_cast<uInt>(in.size());
  stream.next_out = reinterpret_cast<unsigned char*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

inline std::string zstd_frame(const std::string& plain) {
  std::string out(ZSTD_compressBound(plain.size()), ' ');
  out.resize(ZSTD_compress(out.data(), out.size(), plain.data(), plain.size(), 3));
  return out;
}

// Format of numcodecs: the length in four bytes, then the block.
inline std::string lz4_block(const std::string& plain) {
  const auto size = static_cast<int>(plain.size());
  std::string out(4 + static_cast<std::size_t>(LZ4_compressBound(size)), '\0');
  out[0] = static_cast<char>(size & 0xff);
  out[1] = static_cast<char>(size >> 8);
  out.resize(4 + static_cast<std::size_t>(LZ4_compress_default(plain.data(), out.data() + 4, size,
                                                               static_cast<int>(out.size() - 4))));
  return out;
}

inline std::string blosc_buffer(const std::string& plain, const char* codec, int shuffle) {
  std::string out(plain.size() + BLOSC_MAX_OVERHEAD, ' ');
  const int bytes = blosc_compress_ctx(5, shuffle, 4, plain.size(), plain.data(), out.data(),
                                       out.size(), codec, 0, 1);
  EXPECT_GT(bytes, 0) << codec;
  out.resize(static_cast<std::size_t>(bytes));
  return out;
}

// 24 x 40 compressible floats, in one chunk.
inline std::vector<float> ramp() {
  std::vector<float> out(24 * 40);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(i % 40) * 0.25F;
  return out;
}

}  // namespace windsplat::data::test
