// Zarr 2: values, masks, orientation, omissions, refusals.
#include <gmock/gmock.h>

#include "tests/unit/data/formats/zarr_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string array_json(const std::string& shape, const std::string& chunks,
                       const std::string& dtype, const std::string& fill = "null",
                       const std::string& compressor = "null", const std::string& more = "") {
  return R"({"zarr_format":2,"order":"C","filters":null,"shape":)" + shape + R"(,"chunks":)" +
         chunks + R"(,"dtype":")" + dtype + R"(","fill_value":)" + fill + R"(,"compressor":)" +
         compressor + more + "}";
}

void add_axis(const ZarrStore& store, const std::string& name, const std::vector<double>& values,
              const std::string& units) {
  std::string length = "[";
  length += std::to_string(values.size());
  length += "]";
  store.put(name + "/.zarray", array_json(length, length, "<f8", "\"NaN\""));
  store.put(name + "/.zattrs",
            R"({"_ARRAY_DIMENSIONS":[")" + name + R"("],"units":")" + units + "\"}");
  store.put(name + "/0", bytes_of_items(values));
}

std::string compressor_json(const std::string& id) {
  std::string out = R"({"id":")";
  out += id;
  out += "\"}";
  return out;
}

void expect_decoded(const std::string& compressor, const std::string& stored) {
  const ZarrStore store;
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
      const ZarrStore store;
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
    const ZarrStore store;
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
    const ZarrStore store;
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
  const ZarrStore store;
  store.put("f/.zarray", array_json("[1,2]", "[1,2]", "<i2"));
  store.put("f/0.0", bytes_of_items<std::int16_t>({-32767, 1}));
  expect_same(store.values(), {-32767, 1});
}

TEST(Zarr, DanglingChunkLinkIsAnErrorNotAMissingChunk) {
  namespace fs = std::filesystem;
  const ZarrStore store;
  store.put("f/.zarray", array_json("[1,4]", "[1,2]", "<i2", "-9"));
  store.put("f/0.0", bytes_of_items<std::int16_t>({7, 0}));
  fs::create_symlink("moved", store.path() + "/f/0.1");
  EXPECT_THAT(store.fault(), HasSubstr("'f/0.1': dangling link"));
  store.put("f/moved", bytes_of_items<std::int16_t>({1, 2}));
  expect_same(store.values(), {7, 0, 1, 2});

  const ZarrStore nested("n.zarr");
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
    const ZarrStore store("named.zarr");
    add_axis(store, "lat", {10, 0}, "degrees_north");
    add_axis(store, "lon", {0, 20, 40}, "degrees_east");
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
  const ZarrStore store;
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
  const ZarrStore store;
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
    const ZarrStore store;
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

TEST(Zarr, TheDigestChangesWithAChunk) {
  const ZarrStore store;
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
