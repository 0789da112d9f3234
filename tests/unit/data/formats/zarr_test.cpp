// Zarr stores written here byte by byte, compressed by the C libraries: values, masks, orientation,
// omissions, refusals.
#include <blosc.h>
#include <gmock/gmock.h>
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
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr float kMasked = std::numeric_limits<float>::quiet_NaN();

void write(const std::string& path, const std::string& bytes) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  write_bytes(path, bytes);
}

template <class T>
std::string bytes_of_items(const std::vector<T>& items) {
  std::string out(items.size() * sizeof(T), ' ');
  std::memcpy(out.data(), items.data(), out.size());
  return out;
}

std::string array_json(const std::string& shape, const std::string& chunks,
                       const std::string& dtype, const std::string& fill = "null",
                       const std::string& compressor = "null", const std::string& more = "") {
  return R"({"zarr_format":2,"order":"C","filters":null,"shape":)" + shape + R"(,"chunks":)" +
         chunks + R"(,"dtype":")" + dtype + R"(","fill_value":)" + fill + R"(,"compressor":)" +
         compressor + more + "}";
}

// A store with one array f[y=2, x=3] without named axes, and the additions of a test.
class Store {
 public:
  explicit Store(const std::string& name = "s.zarr") : root_(folder_ / name) {
    write(root_ + "/.zgroup", R"({"zarr_format":2})");
  }
  [[nodiscard]] const std::string& path() const { return root_; }
  void put(const std::string& name, const std::string& bytes) const {
    write(root_ + "/" + name, bytes);
  }
  void axis(const std::string& name, const std::vector<double>& values,
            const std::string& units) const {
    std::string length = "[";
    length += std::to_string(values.size());
    length += "]";
    put(name + "/.zarray", array_json(length, length, "<f8", "\"NaN\""));
    put(name + "/.zattrs", R"({"_ARRAY_DIMENSIONS":[")" + name + R"("],"units":")" + units + "\"}");
    put(name + "/0", bytes_of_items(values));
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

void expect_same(const std::vector<float>& found, const std::vector<float>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (std::isnan(expected[i])) {
      EXPECT_TRUE(std::isnan(found[i])) << i << ": " << found[i];
    } else {
      EXPECT_EQ(found[i], expected[i]) << i;
    }
  }
}

std::string zlib_stream(const std::string& plain, int window_bits) {
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

std::string zstd_frame(const std::string& plain) {
  std::string out(ZSTD_compressBound(plain.size()), ' ');
  out.resize(ZSTD_compress(out.data(), out.size(), plain.data(), plain.size(), 3));
  return out;
}

// Format of numcodecs: the length in four bytes, then the block.
std::string lz4_block(const std::string& plain) {
  const auto size = static_cast<int>(plain.size());
  std::string out(4 + static_cast<std::size_t>(LZ4_compressBound(size)), '\0');
  out[0] = static_cast<char>(size & 0xff);
  out[1] = static_cast<char>(size >> 8);
  out.resize(4 + static_cast<std::size_t>(LZ4_compress_default(plain.data(), out.data() + 4, size,
                                                               static_cast<int>(out.size() - 4))));
  return out;
}

std::string blosc_buffer(const std::string& plain, const char* codec, int shuffle) {
  std::string out(plain.size() + BLOSC_MAX_OVERHEAD, ' ');
  const int bytes = blosc_compress_ctx(5, shuffle, 4, plain.size(), plain.data(), out.data(),
                                       out.size(), codec, 0, 1);
  EXPECT_GT(bytes, 0) << codec;
  out.resize(static_cast<std::size_t>(bytes));
  return out;
}

// 24 x 40 compressible floats, in one chunk.
std::vector<float> ramp() {
  std::vector<float> out(24 * 40);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(i % 40) * 0.25F;
  return out;
}

std::string compressor_json(const std::string& id) {
  std::string out = R"({"id":")";
  out += id;
  out += "\"}";
  return out;
}

void expect_decoded(const std::string& compressor, const std::string& stored) {
  const Store store;
  store.put("f/.zarray",
            array_json("[24,40]", "[24,40]", "<f4", "null", compressor_json(compressor)));
  store.put("f/0.0", stored);
  expect_same(store.values(), ramp());
  // The same bytes truncated, or longer than the array requires, cause errors.
  store.put("f/0.0", stored.substr(0, stored.size() / 2));
  EXPECT_THAT(store.fault(), HasSubstr("'f/0.0' ")) << compressor;
  store.put("f/.zarray",
            array_json("[24,40]", "[24,41]", "<f4", "null", compressor_json(compressor)));
  store.put("f/0.0", stored);
  EXPECT_THAT(store.fault(), HasSubstr("'f/0.0' ")) << compressor;
}

TEST(Zarr, EveryCompressorGivesTheSameValues) {
  const std::string plain = bytes_of_items(ramp());
  expect_decoded("zlib", zlib_stream(plain, 15));
  expect_decoded("gzip", zlib_stream(plain, 31));
  expect_decoded("zstd", zstd_frame(plain));
  expect_decoded("lz4", lz4_block(plain));
  for (const char* codec : {"blosclz", "lz4", "lz4hc", "zlib", "zstd"}) {
    for (const int shuffle : {BLOSC_NOSHUFFLE, BLOSC_SHUFFLE, BLOSC_BITSHUFFLE}) {
      expect_decoded("blosc", blosc_buffer(plain, codec, shuffle));
    }
  }
}

TEST(Zarr, EdgeChunksAreCroppedAndBothSeparatorsAndOrdersRead) {
  // f[2, 3] in chunks of 2 x 2: the second one has a column beyond the edge.
  for (const char* separator : {".", "/"}) {
    for (const bool columns_first : {false, true}) {
      const Store store;
      std::string json = array_json("[2,3]", "[2,2]", ">i2", "null", "null",
                                    std::string(R"(,"dimension_separator":")") + separator + "\"");
      if (columns_first) json.replace(json.find("\"C\""), 3, "\"F\"");
      store.put("f/.zarray", json);
      const auto chunk = [&](char a, char b, char c, char d) {
        return columns_first ? std::string{0, a, 0, c, 0, b, 0, d}
                             : std::string{0, a, 0, b, 0, c, 0, d};
      };
      store.put(std::string("f/0") + separator + "0", chunk(1, 2, 4, 5));
      store.put(std::string("f/0") + separator + "1", chunk(3, 99, 6, 99));
      expect_same(store.values(), {1, 2, 3, 4, 5, 6});
    }
  }
}

TEST(Zarr, TypesOfEveryWidth) {
  const auto row = [](const std::string& dtype, const std::string& bytes) {
    const Store store;
    store.put("f/.zarray", array_json("[1,2]", "[1,2]", dtype));
    store.put("f/0.0", bytes);
    return store.values();
  };
  expect_same(row("|b1", std::string{1, 0}), {1, 0});
  expect_same(row("|i1", std::string{'\xff', 5}), {-1, 5});
  expect_same(row("|u1", std::string{'\xff', 5}), {255, 5});
  expect_same(row("<u2", bytes_of_items<std::uint16_t>({65535, 3})), {65535, 3});
  expect_same(row("<i8", bytes_of_items<std::int64_t>({-7, 1 << 20})), {-7, 1 << 20});
  expect_same(row("<f8", bytes_of_items<double>({0.5, -2.25})), {0.5, -2.25});
  // binary16: 1.5 = 0x3e00, the smallest subnormal number = 2^-24.
  expect_same(row("<f2", bytes_of_items<std::uint16_t>({0x3e00, 1})),
              {1.5F, std::ldexp(1.0F, -24)});
}

TEST(Zarr, MissingChunkIsTheFillValueAndNeverZeroByChance) {
  const auto without_second = [](const std::string& dtype, const std::string& fill,
                                 const std::string& attributes) {
    const Store store;
    store.put("f/.zarray", array_json("[1,4]", "[1,2]", dtype, fill));
    store.put("f/.zattrs", attributes);
    store.put("f/0.0", bytes_of_items<std::int16_t>({7, 0}));
    return store.values();
  };
  const std::string named = R"({"_ARRAY_DIMENSIONS":["y","x"]})";
  expect_same(without_second("<i2", "-9", "{}"), {7, 0, kMasked, kMasked});
  expect_same(without_second("<i2", "null", "{}"), {7, 0, kMasked, kMasked});
  // In stores of xarray 0 then means missing; in one without dimension names it is Zarr's default
  // fill value.
  expect_same(without_second("<i2", "0", named), {7, kMasked, kMasked, kMasked});
  expect_same(without_second("<i2", "0", "{}"), {7, 0, 0, 0});
  // Default fill values of netCDF do not apply here: -32767 is the default of a short.
  const Store store;
  store.put("f/.zarray", array_json("[1,2]", "[1,2]", "<i2"));
  store.put("f/0.0", bytes_of_items<std::int16_t>({-32767, 1}));
  expect_same(store.values(), {-32767, 1});
}

TEST(Zarr, DanglingChunkLinkIsAnErrorNotAMissingChunk) {
  namespace fs = std::filesystem;
  const Store store;
  store.put("f/.zarray", array_json("[1,4]", "[1,2]", "<i2", "-9"));
  store.put("f/0.0", bytes_of_items<std::int16_t>({7, 0}));
  fs::create_symlink("moved", store.path() + "/f/0.1");
  EXPECT_THAT(store.fault(), HasSubstr("'f/0.1': dangling link"));
  store.put("f/moved", bytes_of_items<std::int16_t>({1, 2}));
  expect_same(store.values(), {7, 0, 1, 2});

  const Store nested("n.zarr");
  nested.put("f/.zarray",
             array_json("[2,2]", "[1,2]", "<i2", "-9", "null", R"(,"dimension_separator":"/")"));
  nested.put("f/0/0", bytes_of_items<std::int16_t>({7, 0}));
  fs::create_symlink("moved", nested.path() + "/f/1");
  EXPECT_THAT(nested.fault(), HasSubstr("dangling link"));
  fs::create_directory(nested.path() + "/f/moved");
  expect_same(nested.values(), {7, 0, kMasked, kMasked});
}

TEST(Zarr, AttributesOfXarrayPackMaskAndOrient) {
  for (const bool consolidated : {false, true}) {
    const Store store("named.zarr");
    store.axis("lat", {10, 0}, "degrees_north");
    store.axis("lon", {0, 20, 40}, "degrees_east");
    const std::string array = array_json("[2,3]", "[2,3]", "<i2", "-1");
    // Python writes a bare NaN.
    const std::string attributes =
        R"({"_ARRAY_DIMENSIONS":["lat","lon"],"scale_factor":0.5,"add_offset":100,)"
        R"("missing_value":NaN,"units":"K","valid_max":50})";
    store.put("t/.zarray", array);
    store.put("t/.zattrs", attributes);
    store.put("t/0.0", bytes_of_items<std::int16_t>({0, 1, 2, -1, 50, 51}));
    if (consolidated) {
      const auto member = [&](const std::string& name) {
        std::string out = "\"";
        out += name;
        out += "\":";
        out += bytes_of(store.path() + "/" + name);
        return out;
      };
      store.put(".zmetadata", R"({"metadata":{".zattrs":{"title":"Heat"},)" +
                                  member("lat/.zarray") + "," + member("lat/.zattrs") + "," +
                                  member("lon/.zarray") + "," + member("lon/.zattrs") + "," +
                                  member("t/.zarray") + "," + member("t/.zattrs") + "}}");
      std::filesystem::remove(store.path() + "/t/.zarray");
    }
    // Reversed so that rows run from south to north.
    expect_same(store.values("t"), {kMasked, 125, kMasked, 100, 100.5, 101});
    auto source = open_file(store.path());
    ASSERT_TRUE(source);
    const DatasetInfo& info = (*source)->info();
    EXPECT_EQ(info.format, "Zarr v2");
    EXPECT_EQ(info.id, "named");
    EXPECT_EQ(info.title, consolidated ? "Heat" : "named");
    EXPECT_THAT(info.grid.axes[1].coordinates, ElementsAre(0, 10));
    EXPECT_EQ(info.fields.at(0).units, "K");
  }
}

TEST(Zarr, FiltersAreReversedLastFirst) {
  const Store store;
  std::string json = array_json("[1,4]", "[1,4]", "<f8");
  json.replace(json.find("\"filters\":null"), 14,
               R"("filters":[{"id":"fixedscaleoffset","dtype":"<f8","astype":"<i2","scale":4,)"
               R"("offset":10},{"id":"delta","dtype":"<i2"},{"id":"shuffle","elementsize":2}])");
  store.put("f/.zarray", json);
  // 10, 10.25, 10, 138 -> times 4: 0, 1, 0, 512 -> differences: 0, 1, -1, 512 -> low bytes, high.
  store.put("f/0.0", std::string{0, 1, '\xff', 0, 0, 0, '\xff', 2});
  expect_same(store.values(), {10, 10.25, 10, 138});
}

TEST(Zarr, UnsupportedArraysAreReportedWithReason) {
  const Store store;
  store.put("f/.zarray", array_json("[1,2]", "[1,2]", "|u1"));
  store.put("f/0.0", "ab");
  const auto reason_of = [&](const std::string& name, const std::string& json) -> std::string {
    if (!json.empty()) store.put(name + "/.zarray", json);
    auto source = open_file(store.path());
    if (!source) return source.error().message;
    for (const LeftOut& left : (*source)->info().left_out) {
      if (left.name == name) return left.reason;
    }
    return "";
  };
  EXPECT_THAT(reason_of("g", array_json("[2,3]", "[2,3]", "<f4", "0", R"({"id":"bz2"})")),
              HasSubstr("'bz2'"));
  EXPECT_THAT(reason_of("h", array_json("[2,3]", "[2,3]", "<M8[ns]")), HasSubstr("'<M8[ns]'"));
  EXPECT_THAT(reason_of("i", array_json("[2,3]", "[2,3]", "<U5")), HasSubstr("text"));
  std::string filtered = array_json("[2,3]", "[2,3]", "<f4");
  filtered.replace(filtered.find("\"filters\":null"), 14, R"("filters":[{"id":"vlen-utf8"}])");
  EXPECT_THAT(reason_of("j", filtered), HasSubstr("'vlen-utf8'"));
  EXPECT_THAT(reason_of("k", array_json("[40000,40000]", "[40000,40000]", "<f4")),
              HasSubstr("1073741824 bytes"));
  store.put("sub/.zgroup", R"({"zarr_format":2})");
  EXPECT_THAT(reason_of("sub", ""), HasSubstr("group: to see it, open its folder"));
}

TEST(Zarr, BrokenMetadataIsRefused) {
  const auto fault_of = [](const std::string& json) {
    const Store store;
    store.put("f/.zarray", json);
    return store.fault();
  };
  const std::string good = array_json("[2,3]", "[2,3]", "<f4");
  EXPECT_THAT(fault_of(good), "");
  EXPECT_THAT(fault_of(array_json("[2,3]", "[2,0]", "<f4")), HasSubstr("'chunks'"));
  EXPECT_THAT(fault_of(array_json("[2,-3]", "[2,3]", "<f4")), HasSubstr("'shape'"));
  EXPECT_THAT(fault_of(array_json("[2,3.5]", "[2,3]", "<f4")), HasSubstr("'shape'"));
  EXPECT_THAT(fault_of(array_json("[2,3]", "[2]", "<f4")), HasSubstr("rank"));
  EXPECT_THAT(fault_of(array_json("[1099511627776,1099511627776]", "[1,1]", "<f4")),
              HasSubstr("'shape' has more than"));
  EXPECT_THAT(fault_of(array_json("[18446744073709551615,1]", "[1,1]", "<f4")),
              HasSubstr("'shape'"));
  EXPECT_THAT(fault_of(array_json("[1,1,1,1,1,1,1,1,1]", "[1,1,1,1,1,1,1,1,1]", "<f4")),
              HasSubstr("at most 8"));
  EXPECT_THAT(fault_of(good.substr(0, 40)), HasSubstr("not valid JSON"));
  EXPECT_THAT(fault_of(good.substr(0, good.size() - 1) + R"(,"order":"C"})"),
              HasSubstr("duplicate key 'order'"));
  EXPECT_THAT(fault_of(std::string(100000, '[')), HasSubstr("32 levels"));
}

TEST(Zarr, VersionThreeIsRefusedByName) {
  const Folder folder;
  write(folder / "v3/zarr.json", R"({"zarr_format":3,"node_type":"group"})");
  auto source = open_file(folder / "v3");
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("version 3"));
}

TEST(Zarr, TheDigestChangesWithAChunk) {
  const Store store;
  store.put("f/.zarray", array_json("[1,2]", "[1,2]", "|u1"));
  const auto digest = [&] { return open_file(store.path()).value()->info().digest; };
  const std::string absent = digest();
  store.put("f/0.0", "ab");
  const std::string present = digest();
  EXPECT_NE(absent, present);
  EXPECT_EQ(digest(), present);
}

}  // namespace
}  // namespace windsplat::data::test
