// Stores that are written: read back by the project's reader and by programs of others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "server/data/formats/zarr/crc32c.hpp"
#include "server/data/formats/zarr/store.hpp"
#include "server/data/formats/zarr/write/encode.hpp"
#include "server/data/formats/zarr/write/shard_writer.hpp"
#include "server/data/formats/zarr/write/write_store.hpp"
#include "tests/unit/data/netcdf_maker.hpp"
#include "tests/unit/disk.hpp"

namespace windsplat::data::test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using zarr::Compression;
using zarr::ShardWriter;
using zarr::StoreFormat;
using zarr::WrittenArray;
using zarr::WrittenFile;

std::uint32_t crc_of(const std::vector<unsigned char>& bytes) {
  return zarr::crc32c(bytes.data(), bytes.size());
}

// RFC 3720, B.4, and the check value of the polynomial.
TEST(Crc32c, GivesTheSumsOfRfc3720) {
  std::vector<unsigned char> rising(32);
  std::vector<unsigned char> falling(32);
  for (std::size_t i = 0; i < 32; ++i) {
    rising[i] = static_cast<unsigned char>(i);
    falling[i] = static_cast<unsigned char>(31 - i);
  }
  std::vector<unsigned char> command(48);
  command[0] = 0x01;
  command[1] = 0xc0;
  command[16] = 0x14;
  command[22] = 0x04;
  command[27] = 0x14;
  command[31] = 0x18;
  command[32] = 0x28;
  command[40] = 0x02;
  EXPECT_EQ(crc_of(std::vector<unsigned char>(32, 0)), 0x8a9136aaU);
  EXPECT_EQ(crc_of(std::vector<unsigned char>(32, 0xff)), 0x62a8ab43U);
  EXPECT_EQ(crc_of(rising), 0x46dd794eU);
  EXPECT_EQ(crc_of(falling), 0x113fdb5cU);
  EXPECT_EQ(crc_of(command), 0xd9963a56U);
  EXPECT_EQ(crc_of({'1', '2', '3', '4', '5', '6', '7', '8', '9'}), 0xe3069283U);
  EXPECT_EQ(crc_of({}), 0U);
}

// Of any length, from any place in memory.
TEST(Crc32c, OfPartsGoesOnFromTheSumBefore) {
  std::vector<unsigned char> bytes(61);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<unsigned char>(i * i + 7);
  std::uint32_t by_bytes = 0;
  for (std::size_t n = 0; n <= bytes.size(); ++n) {
    const std::uint32_t whole = zarr::crc32c(bytes.data(), n);
    EXPECT_EQ(whole, by_bytes) << n;
    for (std::size_t cut = 0; cut <= n; ++cut) {
      const std::uint32_t before = zarr::crc32c(bytes.data(), cut);
      EXPECT_EQ(zarr::crc32c(bytes.data() + cut, n - cut, before), whole) << n << ' ' << cut;
    }
    if (n < bytes.size()) by_bytes = zarr::crc32c(bytes.data() + n, 1, by_bytes);
  }
}

using ArrayLengths = std::vector<std::size_t>;

WrittenArray array_of(const std::string& path, ArrayLengths shape, ArrayLengths chunk,
                      ArrayLengths shard = {}) {
  WrittenArray out;
  out.path = path;
  out.shape = std::move(shape);
  out.chunk = std::move(chunk);
  out.shard = std::move(shard);
  for (std::size_t d = 0; d < out.shape.size(); ++d) {
    out.dimensions.push_back(path.substr(path.rfind('/') + 1) + std::to_string(d));
  }
  out.attributes["units"] = "m";
  return out;
}

// Arrays with absent chunks and shards, and with ends within chunks and shards.
std::vector<WrittenArray> some_arrays(StoreFormat format) {
  std::vector<WrittenArray> out{
      array_of("line", {7}, {3}),
      array_of("whole", {5}, {5}),
      array_of("larger", {5}, {8}, {16}),
      array_of("pairs", {7}, {2}, {4}),
      array_of("plane", {5, 9}, {2, 4}, {2, 8}),
      array_of("block", {5, 6, 7}, {2, 3, 7}, {4, 6, 7}),
      array_of("steps", {3, 9, 10, 11}, {1, 4, 4, 8}, {1, 8, 8, 16}),
      array_of("files", {3, 3, 4, 5}, {1, 2, 2, 4}),
  };
  const std::vector<zarr::Dtype> types{{'f', 4}, {'f', 8}, {'u', 4}};
  const std::vector<Compression> ways{
      {}, {Compression::Kind::zstd, 1}, {Compression::Kind::none, 5}, {Compression::Kind::lz4, 9}};
  const std::size_t shapes = out.size();
  for (std::size_t n = 0; n < 2 * shapes; ++n) {
    out.push_back(out[n]);
    out.back().path = out[n % shapes].path + (n < shapes ? "_second" : "_third");
  }
  for (std::size_t n = 0; n < out.size(); ++n) {
    out[n].format = format;
    out[n].dtype = types[n / shapes];
    out[n].compression = ways[n % ways.size()];
  }
  return out;
}

// Absent in the second chunk along the first dimension, and in the first of the others, and every
// fifth item elsewhere.
template <class T>
std::vector<T> items_of(const WrittenArray& array) {
  std::vector<T> out;
  ArrayLengths at(array.shape.size());
  for (bool more = true; more;) {
    bool is_first = true;
    for (std::size_t d = 1; d < at.size(); ++d) is_first = is_first && at[d] < array.chunk[d];
    const bool is_absent =
        at[0] / array.chunk[0] == 1 || (at.size() > 1 && is_first) || out.size() % 5 == 0;
    const double wave = 1000 * (1.5 + std::sin(0.37 * static_cast<double>(out.size())));
    const T absent = std::is_floating_point_v<T> ? std::numeric_limits<T>::quiet_NaN() : T{};
    out.push_back(is_absent ? absent : static_cast<T>(wave));
    more = false;
    for (std::size_t d = at.size(); d-- > 0 && !more;) {
      at[d] = at[d] + 1 < array.shape[d] ? at[d] + 1 : 0;
      more = at[d] > 0;
    }
  }
  return out;
}

// The items as their bytes.
template <class T>
std::string written_items(const std::string& store, const WrittenArray& array,
                          std::vector<WrittenFile>& files) {
  const std::vector<T> items = items_of<T>(array);
  const auto done = zarr::write_array(store, array, std::span<const T>(items));
  EXPECT_TRUE(done) << done.error().message;
  if (done) files.insert(files.end(), done->begin(), done->end());
  return {reinterpret_cast<const char*>(items.data()), items.size() * sizeof(T)};
}

std::string write_one(const std::string& store, const WrittenArray& array,
                      std::vector<WrittenFile>& files) {
  if (array.dtype.kind == 'u') return written_items<std::uint32_t>(store, array, files);
  return array.dtype.bytes == 8 ? written_items<double>(store, array, files)
                                : written_items<float>(store, array, files);
}

template <class T>
void expect_items(const zarr::Store& store, int variable, const WrittenArray& array) {
  const std::vector<T> expected = items_of<T>(array);
  std::vector<double> found(expected.size());
  const auto done =
      store.read(variable, ArrayLengths(array.shape.size(), 0), array.shape, found.data());
  ASSERT_TRUE(done) << done.error().message;
  for (std::size_t n = 0; n < found.size(); ++n) {
    const auto wanted = static_cast<double>(expected[n]);
    ASSERT_TRUE(found[n] == wanted || (std::isnan(found[n]) && std::isnan(wanted)))
        << array.path << ' ' << n << ": " << found[n] << ", not " << wanted;
  }
}

class WrittenStores : public testing::TestWithParam<StoreFormat> {};

TEST_P(WrittenStores, AreReadBackByTheReader) {
  const Folder folder;
  const std::string path = folder / "s.zarr";
  const auto arrays = some_arrays(GetParam());
  std::vector<WrittenFile> files;
  for (const WrittenArray& array : arrays) {
    write_one(path, array, files);
  }
  ASSERT_TRUE(zarr::check_arrays(arrays)) << zarr::check_arrays(arrays).error().message;
  ASSERT_TRUE(zarr::write_metadata(path, arrays, {}));
  const auto location = locate(path);
  ASSERT_TRUE(location);
  const auto store = zarr::Store::open(direct_files(*location));
  ASSERT_TRUE(store) << store.error().message;
  EXPECT_EQ((*store)->format(), GetParam() == StoreFormat::v2 ? "Zarr v2" : "Zarr v3");
  const auto& variables = (*store)->contents().variables;
  EXPECT_EQ(variables.size(), arrays.size());
  for (std::size_t v = 0; v < variables.size(); ++v) {
    for (const WrittenArray& array : arrays) {
      if (array.path != variables[v].name) continue;
      EXPECT_EQ(variables[v].units, "m");
      const int variable = static_cast<int>(v);
      if (array.dtype.kind == 'u') {
        expect_items<std::uint32_t>(**store, variable, array);
      } else if (array.dtype.bytes == 8) {
        expect_items<double>(**store, variable, array);
      } else {
        expect_items<float>(**store, variable, array);
      }
    }
  }
}

// Version 3 by a decoder of the test's own, version 2 by zarr-python and xarray.
TEST_P(WrittenStores, AreReadByProgramsOfOthers) {
  const Folder folder;
  const std::string path = folder / "s.zarr";
  auto arrays = some_arrays(GetParam());
  for (std::size_t n = 0; n < arrays.size(); ++n) {
    arrays[n].path = (n % 3 == 0 ? "" : n % 3 == 1 ? "0/" : "statistics/0/") + arrays[n].path;
  }
  std::vector<WrittenFile> files;
  std::vector<std::string> expected;
  for (const WrittenArray& array : arrays) expected.push_back(write_one(path, array, files));
  ASSERT_TRUE(zarr::write_metadata(path, arrays, {{"0", {{"Conventions", "CF-1.8"}}}}));
  const std::string command = "/usr/bin/python3 " WINDSPLAT_SOURCE_DIR
                              "/tests/unit/data/formats/read_zarr.py " +
                              path + " " + folder / "out" + " > " + folder / "printed" + " 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << bytes_of(folder / "printed");
  for (std::size_t n = 0; n < arrays.size(); ++n) {
    std::string name = arrays[n].path;
    for (char& c : name) c = c == '/' ? '.' : c;
    EXPECT_TRUE(bytes_of(folder / "out" + "/" + name) == expected[n]) << arrays[n].path;
  }
  std::set<std::string> told;
  for (const WrittenFile& file : files) {
    told.insert(file.path + ' ' + std::to_string(file.bytes) + ' ' + std::to_string(file.crc32c));
  }
  std::set<std::string> there;
  std::istringstream printed(bytes_of(folder / "printed"));
  for (std::string line; std::getline(printed, line);) there.insert(line);
  EXPECT_EQ(told, there);
  EXPECT_EQ(told.size(), files.size());
}

INSTANTIATE_TEST_SUITE_P(OfEachVersion, WrittenStores,
                         testing::Values(StoreFormat::v2, StoreFormat::v3), [](const auto& info) {
                           return info.param == StoreFormat::v2 ? "V2" : "V3";
                         });

std::string text_at(const std::vector<std::pair<std::string, std::string>>& files,
                    const std::string& path) {
  for (const auto& [name, text] : files) {
    if (name == path) return text;
  }
  return "no " + path;
}

TEST(StoreMetadata, OfVersion3HasItsKeysInAFixedOrder) {
  WrittenArray array = array_of("0/cloud", {2, 9, 10, 11}, {1, 4, 4, 8}, {1, 8, 8, 16});
  array.dimensions = {"time", "lev", "lat", "lon"};
  array.attributes = {{"units", "g/kg"}, {"standard_name", "cloud"}};
  const auto files = zarr::metadata_files({array}, {{"", {{"windsplat", {{"store", 1}}}}}});
  const std::string node =
      R"({"zarr_format":3,"node_type":"array","shape":[2,9,10,11],"data_type":"float32",)"
      R"("chunk_grid":{"name":"regular","configuration":{"chunk_shape":[1,8,8,16]}},)"
      R"("chunk_key_encoding":{"name":"default","configuration":{"separator":"/"}},)"
      R"("fill_value":"NaN","codecs":[{"name":"sharding_indexed","configuration":)"
      R"({"chunk_shape":[1,4,4,8],"codecs":[{"name":"bytes","configuration":)"
      R"({"endian":"little"}},{"name":"blosc","configuration":{"typesize":4,"cname":"lz4",)"
      R"("clevel":5,"shuffle":"shuffle","blocksize":0}},{"name":"crc32c"}],"index_codecs":)"
      R"([{"name":"bytes","configuration":{"endian":"little"}},{"name":"crc32c"}],)"
      R"("index_location":"end"}}],"attributes":{"units":"g/kg","standard_name":"cloud"},)"
      R"("dimension_names":["time","lev","lat","lon"]})";
  EXPECT_EQ(text_at(files, "0/cloud/zarr.json"), node + "\n");
  const std::string consolidated =
      R"("consolidated_metadata":{"kind":"inline","must_understand":false,"metadata":)";
  EXPECT_EQ(text_at(files, "0/zarr.json"),
            R"({"zarr_format":3,"node_type":"group","attributes":{},)" + consolidated +
                R"({"cloud":)" + node + "}}}\n");
  EXPECT_EQ(files.back().first, "zarr.json");
  EXPECT_EQ(files.back().second,
            R"({"zarr_format":3,"node_type":"group","attributes":{"windsplat":{"store":1}},)" +
                consolidated +
                R"({"0":{"zarr_format":3,"node_type":"group","attributes":{}},"0/cloud":)" + node +
                "}}}\n");
  EXPECT_EQ(files.size(), 3U);
}

TEST(StoreMetadata, OfVersion2NamesDimensionsAsXarrayDoes) {
  WrittenArray array = array_of("0/count", {9, 10}, {4, 5}, {8, 10});
  array.format = StoreFormat::v2;
  array.dtype = {'u', 4};
  array.compression = {Compression::Kind::zstd, 3};
  const auto files = zarr::metadata_files({array}, {});
  EXPECT_EQ(text_at(files, "0/count/.zarray"),
            R"({"zarr_format":2,"shape":[9,10],"chunks":[4,5],"dtype":"<u4","compressor":)"
            R"({"id":"blosc","cname":"zstd","clevel":3,"shuffle":1,"blocksize":0},)"
            R"("fill_value":null,"order":"C","filters":null,"dimension_separator":"."})"
            "\n");
  EXPECT_EQ(text_at(files, "0/count/.zattrs"),
            R"({"units":"m","_ARRAY_DIMENSIONS":["count0","count1"]})"
            "\n");
  EXPECT_EQ(text_at(files, "0/.zgroup"), "{\"zarr_format\":2}\n");
  EXPECT_EQ(text_at(files, ".zgroup"), "{\"zarr_format\":2}\n");
  EXPECT_EQ(files.back().first, ".zmetadata");
  EXPECT_THAT(files.back().second, StartsWith(R"({"metadata":{".zattrs":{},".zgroup":)"));
}

TEST(StoreMetadata, ReplacesBytesThatAreNoText) {
  WrittenArray array = array_of("a", {1}, {1});
  array.attributes = {{"units", "\xb0"}};
  EXPECT_THAT(text_at(zarr::metadata_files({array}, {}), "a/zarr.json"),
              HasSubstr("{\"units\":\"\xef\xbf\xbd\"}"));
}

std::string array_fault(const std::function<void(WrittenArray&)>& change) {
  WrittenArray array = array_of("0/a", {4, 4}, {2, 2}, {4, 2});
  change(array);
  const auto fine = zarr::check_array(array);
  return fine ? "" : fine.error().message;
}

TEST(StoreMetadata, RefusesArraysThatAreNotRead) {
  EXPECT_EQ(array_fault([](WrittenArray&) {}), "");
  for (const char* path : {"", "/a", "a/", "a//b", "../a", "0/.zattrs", "0/zarr.json", "__a"}) {
    EXPECT_THAT(array_fault([&](WrittenArray& a) { a.path = path; }), HasSubstr("its path"))
        << path;
  }
  EXPECT_THAT(array_fault([](WrittenArray& a) { a.path = std::string(256, 'a'); }),
              HasSubstr("its path"));
  EXPECT_EQ(array_fault([](WrittenArray& a) {
              a.chunk = {3, 2};
            }),
            "the array '0/a' cannot be written: a shard is not of whole chunks");
  EXPECT_THAT(array_fault([](WrittenArray& a) { a.chunk = {2}; }), HasSubstr("one rank"));
  EXPECT_THAT(array_fault([](WrittenArray& a) { a.dimensions = {"y"}; }), HasSubstr("one rank"));
  EXPECT_THAT(array_fault([](WrittenArray& a) { a.shape = {4, 0}; }), HasSubstr("a length is 0"));
  EXPECT_THAT(array_fault([](WrittenArray& a) { a.dtype = {'i', 4}; }), HasSubstr("only float32"));
  EXPECT_THAT(array_fault([](WrittenArray& a) {
                a.chunk = a.shard = {1 << 14, 1 << 15};
              }),
              HasSubstr("more than 1024 MiB"));
  EXPECT_THAT(array_fault([](WrittenArray& a) {
                a.chunk = {1, 1};
                a.shard = {1 << 11, 1 << 10};
              }),
              HasSubstr("more than 1048576 chunks"));
  EXPECT_THAT(array_fault([](WrittenArray& a) { a.compression.level = 0; }), HasSubstr("1 to 9"));
}

TEST(StoreMetadata, RefusesTwoArraysOfOneName) {
  const WrittenArray array = array_of("0/a", {4}, {2});
  EXPECT_TRUE(zarr::check_arrays({array, array_of("1/a", {4}, {2})}));
  const auto fine = zarr::check_arrays({array, array_of("1/a", {4}, {2}), array});
  ASSERT_FALSE(fine);
  EXPECT_EQ(fine.error().message, "two arrays cannot be written as '0/a'");
}

std::vector<float> alike_items(float value) { return std::vector<float>(8, value); }

TEST(ShardWriters, WriteChunksInTheOrderOfTheCalls) {
  const Folder folder;
  WrittenArray array = array_of("a", {32}, {8}, {32});
  array.compression.kind = Compression::Kind::none;
  const float masked = std::numeric_limits<float>::quiet_NaN();
  ShardWriter writer(folder / "s", array, {0});
  ASSERT_TRUE(writer.add(3, std::span<const float>(alike_items(3))));
  ASSERT_TRUE(writer.add(1, std::span<const float>(alike_items(masked))));
  ASSERT_TRUE(writer.add(0, std::span<const float>(alike_items(0))));
  const auto files = writer.close();
  ASSERT_TRUE(files) << files.error().message;
  ASSERT_EQ(files->size(), 1U);
  const std::string bytes = bytes_of(folder / "s/a/c/0");
  EXPECT_EQ(files->front().path, "a/c/0");
  EXPECT_EQ(files->front().bytes, bytes.size());
  constexpr std::size_t chunk = 8 * sizeof(float) + 4;
  ASSERT_EQ(bytes.size(), 2 * chunk + 4 * 16 + 4);
  std::array<std::uint64_t, 8> index{};
  std::memcpy(index.data(), bytes.data() + 2 * chunk, sizeof index);
  constexpr auto absent = zarr::absent_span;
  EXPECT_EQ(index,
            (std::array<std::uint64_t, 8>{chunk, chunk, absent, absent, absent, absent, 0, chunk}));
  EXPECT_EQ(std::memcmp(bytes.data(), alike_items(3).data(), 32), 0);
}

TEST(ShardWriters, MakeNoFileOfAbsentChunks) {
  const Folder folder;
  const WrittenArray array = array_of("a", {32}, {8}, {32});
  ShardWriter writer(folder / "s", array, {0});
  const float masked = std::numeric_limits<float>::quiet_NaN();
  ASSERT_TRUE(writer.add(2, std::span<const float>(alike_items(masked))));
  const auto files = writer.close();
  ASSERT_TRUE(files);
  EXPECT_TRUE(files->empty());
  // Also where chunks reach beyond the array.
  WrittenArray odd = array_of("a", {5, 3}, {4, 2});
  const std::vector<float> all(15, masked);
  const auto floats = zarr::write_array(folder / "s", odd, std::span<const float>(all));
  ASSERT_TRUE(floats);
  EXPECT_TRUE(floats->empty());
  odd.dtype = {'u', 4};
  const std::vector<std::uint32_t> none(15, 0);
  const auto counts = zarr::write_array(folder / "s", odd, std::span<const std::uint32_t>(none));
  ASSERT_TRUE(counts);
  EXPECT_TRUE(counts->empty());
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
}

// What was left by an interrupted program is replaced.
TEST(ShardWriters, GiveEqualBytesEachTime) {
  const Folder folder;
  const WrittenArray array = array_of("a", {32}, {8}, {32});
  std::vector<std::string> found;
  for (int n = 0; n < 2; ++n) {
    ShardWriter writer(folder / "s", array, {0});
    ASSERT_TRUE(writer.add(2, std::span<const float>(alike_items(5))));
    ASSERT_TRUE(writer.close());
    found.push_back(bytes_of(folder / "s/a/c/0"));
    write_bytes(folder / "s/a/c/0", std::string(100'000, 'x'));
  }
  EXPECT_EQ(found[0], found[1]);
}

TEST(ShardWriters, RemoveFilesThatWereNotClosed) {
  const Folder folder;
  const std::string path = folder / "s/a/c/0";
  const WrittenArray array = array_of("a", {32}, {8}, {32});
  {
    ShardWriter writer(folder / "s", array, {0});
    ASSERT_TRUE(writer.add(2, std::span<const float>(alike_items(5))));
    ShardWriter moved(std::move(writer));
    ASSERT_TRUE(moved.add(3, std::span<const float>(alike_items(6))));
    EXPECT_TRUE(std::filesystem::exists(path));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ShardWriters, TellThatTheDiskIsFullAndWhere) {
  const Folder folder;
  WrittenArray array = array_of("a", {4096}, {1024}, {4096});
  array.compression.kind = Compression::Kind::none;
  const std::vector<float> chunk(1024, 1.0F);
  for (const bool in_index : {false, true}) {
    const windsplat::test::FullDisk disk(in_index ? 4100 : 1000);
    ShardWriter writer(folder / "s", array, {0});
    const auto added = writer.add(0, std::span<const float>(chunk));
    ASSERT_EQ(bool(added), in_index);
    const Error error = in_index ? writer.close().error() : added.error();
    EXPECT_EQ(error.kind, ErrorKind::out_of_memory);
    EXPECT_THAT(error.message, HasSubstr(folder / "s/a/c/0"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "s/a/c/0"));
  write_bytes(folder / "taken", "");
  const auto files = zarr::write_array(folder / "taken", array,
                                       std::span<const float>(std::vector<float>(4096, 1.0F)));
  ASSERT_FALSE(files);
  EXPECT_THAT(files.error().message, HasSubstr("cannot create"));
}

}  // namespace
}  // namespace windsplat::data::test
