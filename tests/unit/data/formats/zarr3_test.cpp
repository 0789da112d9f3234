// Zarr 3, written from its specification: codecs, shards, metadata, refusals.
#include <gmock/gmock.h>

#include <bit>
#include <cstdint>

#include "tests/unit/data/formats/zarr_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kLittle = R"({"name":"bytes","configuration":{"endian":"little"}})";
const std::string kNan = R"("NaN")";

class Zarr3 : public ZarrStore {
 public:
  explicit Zarr3(const std::string& more = "")
      : ZarrStore("s.zarr", "zarr.json", R"({"zarr_format":3,"node_type":"group")" + more + "}") {}
};

std::string regular(const std::string& shape) {
  return R"({"name":"regular","configuration":{"chunk_shape":)" + shape + "}}";
}

// zarr.json of an array with default keys.
std::string array3(const std::string& shape, const std::string& chunks, const std::string& type,
                   const std::string& codecs = kLittle, const std::string& fill = kNan,
                   const std::string& more = "") {
  return R"({"zarr_format":3,"node_type":"array","shape":)" + shape + R"(,"data_type":")" + type +
         R"(","chunk_grid":)" + regular(chunks) + R"(,"chunk_key_encoding":{"name":"default"})" +
         R"(,"fill_value":)" + fill + R"(,"codecs":[)" + codecs + "]" + more + "}";
}

std::string codec_json(const std::string& codec, const std::string& configuration = "") {
  return R"({"name":")" + codec + R"(","configuration":{)" + configuration + "}}";
}

std::string sharded(const std::string& chunks, const std::string& codecs = kLittle,
                    const std::string& location = "end", const std::string& endian = "little",
                    const std::string& index_more = R"(,{"name":"crc32c"})") {
  return codec_json("sharding_indexed", R"("chunk_shape":)" + chunks + R"(,"codecs":[)" + codecs +
                                            R"(],"index_codecs":[)" +
                                            codec_json("bytes", R"("endian":")" + endian + "\"") +
                                            index_more + R"(],"index_location":")" + location +
                                            "\"");
}

// CRC-32C bit by bit (RFC 3720, B.4), little-endian.
std::string sum_of(const std::string& bytes) {
  std::uint32_t rest = 0xffffffff;
  for (const char c : bytes) {
    rest ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1U) ^ ((rest & 1U) * 0x82f63b78U);
  }
  return bytes_of_items<std::uint32_t>({~rest});
}

constexpr std::uint64_t kAbsent = ~std::uint64_t{0};

// Parts in the order of the index, empty where absent, stored last part first behind three bytes
// that belong to none.
std::string shard_of(const std::vector<std::string>& parts, bool at_start = false,
                     bool big_endian = false) {
  const std::size_t index_bytes = parts.size() * 16 + 4;
  std::string data = "gap";
  std::vector<std::uint64_t> index(parts.size() * 2, kAbsent);
  for (std::size_t i = parts.size(); i-- > 0;) {
    if (parts[i].empty()) continue;
    index[2 * i] = data.size() + (at_start ? index_bytes : 0);
    index[2 * i + 1] = parts[i].size();
    data += parts[i];
  }
  std::string stored = bytes_of_items(index);
  for (std::size_t at = 0; big_endian && at < stored.size(); at += 8) {
    std::reverse(stored.begin() + static_cast<std::ptrdiff_t>(at),
                 stored.begin() + static_cast<std::ptrdiff_t>(at + 8));
  }
  stored += sum_of(stored);
  return at_start ? stored + data : data + stored;
}

std::string float_bytes(const std::vector<float>& values) { return bytes_of_items(values); }

// f[2, 2] in one chunk or shard.
std::string fault_of(const std::string& json,
                     const std::string& stored = float_bytes({1, 2, 3, 4})) {
  const Zarr3 store;
  store.put("f/zarr.json", json);
  store.put("f/c/0/0", stored);
  return store.fault();
}

void expect_decoded_as(const std::string& codecs, const std::string& stored) {
  const Zarr3 store;
  store.put("f/zarr.json", array3("[24,40]", "[24,40]", "float32", codecs));
  store.put("f/c/0/0", stored);
  expect_same(store.values(), ramp());
  store.put("f/c/0/0", stored.substr(0, stored.size() / 2));
  EXPECT_THAT(store.fault(), HasSubstr("'f/c/0/0' ")) << codecs;
  store.put("f/zarr.json", array3("[24,40]", "[24,39]", "float32", codecs));
  store.put("f/c/0/0", stored);
  EXPECT_THAT(store.fault(), HasSubstr("'f/c/0/0' ")) << codecs;
}

TEST(Zarr3, EveryCodecGivesTheSameValues) {
  const std::string plain = bytes_of_items(ramp());
  expect_decoded_as(kLittle, plain);
  expect_decoded_as(kLittle + "," + codec_json("gzip", R"("level":5)"), zlib_stream(plain, 31));
  expect_decoded_as(kLittle + "," + codec_json("zstd", R"("level":3,"checksum":false)"),
                    zstd_frame(plain));
  expect_decoded_as(kLittle + R"(,{"name":"crc32c"})", plain + sum_of(plain));
  const std::string packed = zstd_frame(plain);
  expect_decoded_as(kLittle + "," + codec_json("zstd") + "," + codec_json("crc32c"),
                    packed + sum_of(packed));
  for (const char* codec : {"blosclz", "lz4", "lz4hc", "zlib", "zstd"}) {
    expect_decoded_as(
        kLittle + "," + codec_json("blosc", std::string(R"("cname":")") + codec + "\""),
        blosc_buffer(plain, codec, BLOSC_SHUFFLE));
  }
  expect_decoded_as(kLittle + "," + codec_json("numcodecs.zlib", R"("level":1)"),
                    zlib_stream(plain, 15));
  expect_decoded_as(kLittle + "," + codec_json("numcodecs.lz4"), lz4_block(plain));
}

TEST(Zarr3, TheChecksumIsThatOfRfc3720) {
  const Zarr3 store;
  const std::string codecs = R"({"name":"bytes"},{"name":"crc32c"})";
  store.put("f/zarr.json", array3("[1,9]", "[1,9]", "uint8", codecs, "0"));
  store.put("f/c/0/0", "123456789\x83\x92\x06\xe3");  // the check value of CRC-32C, e3069283
  expect_same(store.values(), {49, 50, 51, 52, 53, 54, 55, 56, 57});
  store.put("f/c/0/0", "123456788\x83\x92\x06\xe3");
  EXPECT_THAT(store.fault(), HasSubstr("'f/c/0/0' does not match its CRC-32C"));
}

TEST(Zarr3, TypesOfEveryWidthInBothByteOrders) {
  const auto row = [](const std::string& type, const std::string& bytes, bool big = false) {
    const Zarr3 store;
    const std::string codecs = big ? codec_json("bytes", R"("endian":"big")") : kLittle;
    store.put("f/zarr.json", array3("[1,2]", "[1,2]", type, codecs, "0"));
    store.put("f/c/0/0", bytes);
    return store.values();
  };
  expect_same(row("bool", std::string{1, 0}), {1, 0});
  expect_same(row("int8", std::string{'\xff', 5}), {-1, 5});
  expect_same(row("uint8", std::string{'\xff', 5}), {255, 5});
  expect_same(row("int16", std::string{'\xff', '\xfe', 1, 2}, true), {-2, 258});
  expect_same(row("uint16", bytes_of_items<std::uint16_t>({65535, 3})), {65535, 3});
  expect_same(row("int32", std::string{0, 1, 0, 0, '\xff', '\xff', '\xff', '\xff'}, true),
              {65536, -1});
  expect_same(row("uint32", bytes_of_items<std::uint32_t>({1U << 31U, 3})), {2147483648.0F, 3});
  expect_same(row("int64", bytes_of_items<std::int64_t>({-7, 1 << 20})), {-7, 1 << 20});
  expect_same(row("uint64", bytes_of_items<std::uint64_t>({7, 1ULL << 63U})),
              {7, 9223372036854775808.0F});
  expect_same(row("float16", std::string{0x3e, 0, 0, 1}, true), {1.5F, std::ldexp(1.0F, -24)});
  expect_same(row("float32", std::string{0x3f, '\x80', 0, 0, '\xc0', 0, 0, 0}, true), {1, -2});
  expect_same(row("float64", bytes_of_items<double>({0.5, -2.25})), {0.5, -2.25});
}

TEST(Zarr3, TransposedChunksAreTurnedBack) {
  // f[2, 3, 4] in chunks of [2, 3, 2]: value 100 z + 10 y + x. A stored chunk is [x, z, y], in one
  // step, or in two: [y, x, z], of which the order [1, 2, 0] is taken.
  const std::string once = codec_json("transpose", R"("order":[2,0,1])");
  const std::string twice = codec_json("transpose", R"("order":[1,2,0])") + "," +
                            codec_json("transpose", R"("order":[1,2,0])");
  for (const std::string& order : {once, twice}) {
    const Zarr3 store;
    store.put("f/zarr.json", array3("[2,3,4]", "[2,3,2]", "float32", order + "," + kLittle));
    std::vector<float> expected;
    for (int i = 0; i < 24; ++i) {
      expected.push_back(static_cast<float>(100 * (i / 12) + 10 * (i / 4 % 3) + i % 4));
    }
    for (int half = 0; half < 2; ++half) {
      std::vector<float> stored;
      for (int x = 2 * half; x < 2 * half + 2; ++x) {
        for (int z = 0; z < 2; ++z) {
          for (int y = 0; y < 3; ++y) stored.push_back(static_cast<float>(100 * z + 10 * y + x));
        }
      }
      store.put("f/c/0/0/" + std::to_string(half), float_bytes(stored));
    }
    expect_same(store.values(), expected);
  }
}

TEST(Zarr3, KeysOfBothEncodingsAndSeparators) {
  const auto with = [](const std::string& encoding, const std::string& key) {
    const Zarr3 store;
    std::string json = array3("[2,3]", "[2,2]", "uint8", kLittle, "0");
    const std::string standard = R"({"name":"default"})";
    json.replace(json.find(standard), standard.size(), encoding);
    store.put("f/zarr.json", json);
    store.put("f/" + key + "0", std::string{1, 2, 4, 5});
    store.put("f/" + key + "1", std::string{3, 99, 6, 99});
    expect_same(store.values(), {1, 2, 3, 4, 5, 6});
  };
  with(codec_json("default", R"("separator":"/")"), "c/0/");
  with(codec_json("default", R"("separator":".")"), "c.0.");
  with(R"("default")", "c/0/");
  with(codec_json("v2"), "0.");
  with(codec_json("v2", R"("separator":"/")"), "0/");
}

TEST(Zarr3, ShardsWithTheIndexAtEitherEndAndAbsentChunks) {
  // f[4, 5] in shards of [4, 4] with chunks of [2, 2]: value 10 y + x.
  const auto part = [](int y, int x) {
    const auto at = static_cast<float>(10 * y + x);
    return float_bytes({at, at + 1, at + 10, at + 11});
  };
  for (const bool at_start : {false, true}) {
    for (const bool big_endian : {false, true}) {
      const Zarr3 store;
      store.put("f/zarr.json", array3("[4,5]", "[4,4]", "float32",
                                      sharded("[2,2]", kLittle, at_start ? "start" : "end",
                                              big_endian ? "big" : "little")));
      store.put("f/c/0/0",
                shard_of({part(0, 0), part(0, 2), "", part(2, 2)}, at_start, big_endian));
      store.put("f/c/0/1", shard_of({part(0, 4), "", part(2, 4), ""}, at_start, big_endian));
      expect_same(store.values(), {0,       1,       2,  3,  4,  10,      11,      12, 13, 14,  //
                                   kMasked, kMasked, 22, 23, 24, kMasked, kMasked, 32, 33, 34});
    }
  }
}

TEST(Zarr3, AbsentChunksOfShardsAreCountedWithoutThoseBeyondTheEdge) {
  // f[2, 3] in shards of [2, 2] with chunks of [1, 1]; the second shard reaches beyond the edge.
  const Zarr3 store;
  store.put("f/zarr.json", array3("[2,3]", "[2,2]", "float32", sharded("[1,1]")));
  store.put("f/c/0/0", shard_of({float_bytes({1}), "", "", float_bytes({5})}));
  store.put("f/c/0/1", shard_of({float_bytes({3}), "", "", ""}));
  expect_same(store.values(), {1, kMasked, 3, kMasked, 5, kMasked});
  auto source = open_file(store.path());
  ASSERT_TRUE(source);
  EXPECT_THAT((*source)->info().notes,
              testing::Contains(HasSubstr("never written are masked: 'f' (3 of 6 chunks)")));
}

TEST(Zarr3, ShardsOfTransposedAndCompressedChunks) {
  // f[2, 4] is transposed to shards of [4, 2] with chunks of [2, 2], which are transposed again.
  const Zarr3 store;
  const std::string inner = codec_json("transpose", R"("order":[1,0])") + "," + kLittle + "," +
                            codec_json("zstd") + "," + codec_json("crc32c");
  store.put("f/zarr.json", array3("[2,4]", "[2,4]", "float32",
                                  codec_json("transpose", R"("order":[1,0])") + "," +
                                      sharded("[2,1]", inner, "end", "little", "")));
  // The index counts [2, 2] chunks of [x pair, y]; each holds f[y][x], f[y][x + 1].
  std::vector<std::string> parts;
  for (const auto& pair : {std::vector<float>{1, 2}, {5, 6}, {3, 4}, {7, 8}}) {
    const std::string packed = zstd_frame(float_bytes(pair));
    parts.push_back(packed + sum_of(packed));
  }
  std::string shard = shard_of(parts);
  shard.resize(shard.size() - 4);  // this index has no checksum
  store.put("f/c/0/0", shard);
  expect_same(store.values(), {1, 2, 3, 4, 5, 6, 7, 8});
}

TEST(Zarr3, OnlyTheChunksOfTheStepAreRead) {
  const Zarr3 store;
  store.put("f/zarr.json", array3("[2,2,2]", "[2,2,2]", "float32", sharded("[1,2,2]"), kNan,
                                  R"(,"dimension_names":["time","y","x"])"));
  store.put("f/c/0/0/0", shard_of({float_bytes({1, 2, 3, 4}), "too short"}));
  expect_same(store.values(), {1, 2, 3, 4});
  auto source = open_file(store.path());
  ASSERT_TRUE(source);
  const auto second = (*source)->read(0, 1);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message,
              HasSubstr("'f/c/0/0/0' is damaged: its part 1 has 9 bytes; its array requires 16"));
}

TEST(Zarr3, DamagedShardsAreErrorsThatNameTheChunk) {
  const std::string json = array3("[2,2]", "[2,2]", "float32", sharded("[1,2]"));
  const std::string good = shard_of({float_bytes({1, 2}), float_bytes({3, 4})});
  EXPECT_THAT(fault_of(json, good), "");
  std::string flipped = good;
  flipped[flipped.size() - 30] ^= 1;
  EXPECT_THAT(fault_of(json, flipped), HasSubstr("'f/c/0/0' is damaged: its index does not match"));
  EXPECT_THAT(fault_of(json, good.substr(0, 35)), HasSubstr("'f/c/0/0' is truncated"));
  EXPECT_THAT(fault_of(json, good.substr(0, good.size() - 1)), HasSubstr("its index does not"));
  const auto with_index = [&](const std::vector<std::uint64_t>& index) {
    const std::string stored = bytes_of_items(index);
    return fault_of(json, float_bytes({1, 2, 3, 4}) + stored + sum_of(stored));
  };
  EXPECT_THAT(with_index({0, 8, 8, 8}), "");
  EXPECT_THAT(with_index({0, 8, 8, 1000}), HasSubstr("its part 1 is outside of the file"));
  EXPECT_THAT(with_index({0, 8, kAbsent - 3, 8}), HasSubstr("its part 1 is outside of the file"));
  EXPECT_THAT(with_index({kAbsent, 8, 8, 8}), HasSubstr("its part 0 is outside of the file"));
  EXPECT_THAT(with_index({0, kAbsent, 8, 8}), HasSubstr("its part 0 is outside of the file"));
  EXPECT_THAT(with_index({0, 8, 8, 0}), HasSubstr("its part 1 has 0 bytes"));
  // A chunk that decompresses to more than its array needs, or is stored in more than it can need.
  const std::string packed =
      array3("[2,2]", "[2,2]", "float32", sharded("[1,2]", kLittle + "," + codec_json("gzip")));
  const std::string bomb = zlib_stream(std::string(1 << 20, '\0'), 31);
  EXPECT_THAT(fault_of(packed, shard_of({bomb, ""})), HasSubstr("its part 0 does not decompress"));
  EXPECT_THAT(fault_of(packed, shard_of({std::string(70000, ' '), ""})),
              HasSubstr("its part 0 has more bytes"));
}

TEST(Zarr3, WhatIsNotSupportedIsRefusedByName) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string json = array3("[2,2]", "[2,2]", "float32");
    json.replace(json.find(from), from.size(), to);
    return fault_of(json);
  };
  EXPECT_THAT(with("}]", R"(},{"name":"brotli"}])"), HasSubstr("the codec 'brotli'"));
  EXPECT_THAT(with("}]", R"(},{"name":"brotli","must_understand":false}])"), "");
  EXPECT_THAT(with("}]", R"(},{"name":"gzip"},{"name":"zstd"}])"), HasSubstr("'zstd' after"));
  EXPECT_THAT(with("float32", "complex64"), HasSubstr("'complex64'"));
  EXPECT_THAT(with("float32", "r16"), HasSubstr("'r16'"));
  EXPECT_THAT(with("float32", "string"), HasSubstr("'string'"));
  EXPECT_THAT(with(R"("float32")", codec_json("numpy.datetime64", R"("unit":"s")")),
              HasSubstr("'numpy.datetime64': only times as numbers"));
  EXPECT_THAT(with(R"("regular")", R"("rectilinear")"), HasSubstr("'rectilinear'"));
  EXPECT_THAT(with(R"({"name":"default"})", R"({"name":"fanout"})"), HasSubstr("'fanout'"));
  EXPECT_THAT(with("}]", R"(}],"storage_transformers":[{"name":"cdf"}])"), HasSubstr("'cdf'"));
  EXPECT_THAT(with("}]", R"(}],"virtual":{"a":1})"), HasSubstr("the extension 'virtual'"));
  EXPECT_THAT(with("}]", R"(}],"virtual":{"must_understand":false})"), "");
  EXPECT_THAT(fault_of(array3("[2,2]", "[2,2]", "float32", sharded("[1,2]", sharded("[1,1]")))),
              HasSubstr("sharded within shards"));
  EXPECT_THAT(
      fault_of(array3("[2,2]", "[2,2]", "float32", sharded("[1,2]") + "," + codec_json("gzip"))),
      HasSubstr("'gzip' after 'sharding_indexed'"));
  EXPECT_THAT(
      fault_of(array3("[2,2]", "[2,2]", "float32",
                      sharded("[1,2]", kLittle, "end", "little", "," + codec_json("zstd")))),
      HasSubstr("an index encoded with 'zstd'"));
  const Zarr3 extended(R"(,"extra":{"name":"x"})");
  EXPECT_THAT(extended.fault(), HasSubstr("the extension 'extra'"));
}

TEST(Zarr3, BrokenMetadataIsRefused) {
  const auto shaped = [](const std::string& shape, const std::string& chunks,
                         const std::string& codecs = kLittle, const std::string& fill = kNan) {
    return fault_of(array3(shape, chunks, "float32", codecs, fill));
  };
  EXPECT_THAT(shaped("[2,2]", "[2,0]"), HasSubstr("'chunk_shape'"));
  EXPECT_THAT(shaped("[2,2]", "[2]"), HasSubstr("rank"));
  EXPECT_THAT(shaped("[2,2.5]", "[2,2]"), HasSubstr("'shape'"));
  EXPECT_THAT(shaped("[1099511627776,4]", "[1,1]"), HasSubstr("more than 16777216 chunks"));
  EXPECT_THAT(shaped("[2,2]", "[40000,40000]"), HasSubstr("1073741824 bytes"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", sharded("[1,3]")), HasSubstr("whole number of its chunks"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", sharded("[2]")), HasSubstr("differs in rank"));
  EXPECT_THAT(shaped("[2,2]", "[2048,2048]", sharded("[1,1]")), HasSubstr("1048576 chunks"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", sharded("[1,2]", kLittle, "middle")),
              HasSubstr("'index_location'"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", codec_json("gzip")), HasSubstr("'gzip' precedes bytes"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", kLittle + "," + kLittle), HasSubstr("'bytes' follows"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", ""), HasSubstr("neither bytes nor sharding_indexed"));
  for (const char* order : {"[0,0]", "[0]", "[0,2]", "[0,-1]", "[0,1,2]"}) {
    EXPECT_THAT(shaped("[2,2]", "[2,2]",
                       codec_json("transpose", std::string(R"("order":)") + order) + "," + kLittle),
                HasSubstr("not a permutation"))
        << order;
  }
  EXPECT_THAT(shaped("[2,2]", "[2,2]", kLittle, R"("0x7fc0")"), HasSubstr("'fill_value'"));
  EXPECT_THAT(shaped("[2,2]", "[2,2]", kLittle, "[1]"), HasSubstr("'fill_value'"));
}

TEST(Zarr3, AbsentChunksHaveEveryFormOfTheFillValue) {
  const auto absent = [](const std::string& type, const std::string& fill) {
    const Zarr3 store;
    store.put("f/zarr.json", array3("[1,2]", "[1,1]", type, kLittle, fill));
    return store.values();
  };
  expect_same(absent("float32", "2.5"), {2.5, 2.5});
  expect_same(absent("float32", R"("NaN")"), {kMasked, kMasked});
  expect_same(absent("float32", R"("-Infinity")"), {kMasked, kMasked});
  expect_same(absent("float32", R"("0x7fc00000")"), {kMasked, kMasked});
  expect_same(absent("float32", R"("0x3fc00000")"), {1.5, 1.5});
  expect_same(absent("float64", R"("0xc000000000000000")"), {-2, -2});
  expect_same(absent("float16", R"("0x3e00")"), {1.5, 1.5});
  expect_same(absent("int32", "-3"), {-3, -3});
  expect_same(absent("bool", "true"), {1, 1});
}

}  // namespace
}  // namespace windsplat::data::test
