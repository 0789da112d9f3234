// Groups of Zarr 2 and 3: dimension names, attributes of xarray, consolidated metadata, and images
// at several levels of detail.
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/unit/data/formats/zarr_maker.hpp"

namespace windsplat::data::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string group3(const std::string& attributes, const std::string& more = "") {
  return R"({"zarr_format":3,"node_type":"group","attributes":)" + attributes + more + "}";
}

std::string v3_array(const std::string& shape, const std::string& chunks, const std::string& type,
                     const std::string& dimensions, const std::string& attributes = "{}",
                     const std::string& fill = "0") {
  return R"({"zarr_format":3,"node_type":"array","shape":)" + shape + R"(,"data_type":")" + type +
         R"(","chunk_grid":{"name":"regular","configuration":{"chunk_shape":)" + chunks +
         R"(}},"chunk_key_encoding":{"name":"default"},"fill_value":)" + fill +
         R"(,"codecs":[{"name":"bytes","configuration":{"endian":"little"}}])" +
         (dimensions.empty() ? "" : R"(,"dimension_names":)" + dimensions) + R"(,"attributes":)" +
         attributes + "}";
}

std::string v2_array(const std::string& shape) {
  return R"({"zarr_format":2,"order":"C","filters":null,"compressor":null,"fill_value":0,)"
         R"("dtype":"|u1","dimension_separator":"/","shape":)" +
         shape + R"(,"chunks":)" + shape + "}";
}

DatasetInfo info_of(const ZarrStore& store) {
  auto source = open_file(store.path());
  EXPECT_TRUE(source) << source.error().message;
  return source ? (*source)->info() : DatasetInfo{};
}

bool says(const DatasetInfo& info, const std::string& text) {
  return std::any_of(info.notes.begin(), info.notes.end(),
                     [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

// t[lat=2, lon=3] as xarray writes it.
void add_weather(const ZarrStore& store) {
  store.put("lat/zarr.json", v3_array("[2]", "[2]", "float64", R"(["lat"])",
                                      R"({"units":"degrees_north"})", R"("NaN")"));
  store.put("lat/c/0", bytes_of_items<double>({10, 0}));
  store.put("lon/zarr.json",
            v3_array("[3]", "[1]", "float64", R"(["lon"])", R"({"units":"degrees_east"})"));
  // The first longitude is 0, which is the fill value, so its chunk is not stored.
  store.put("lon/c/1", bytes_of_items<double>({20}));
  store.put("lon/c/2", bytes_of_items<double>({40}));
  store.put("t/zarr.json",
            v3_array("[2,3]", "[2,3]", "int16", R"(["lat","lon"])",
                     R"({"units":"K","scale_factor":0.5,"add_offset":100,"_FillValue":-1})"));
  store.put("t/c/0/0", bytes_of_items<std::int16_t>({0, 1, 2, -1, 50, 51}));
}

TEST(ZarrGroups, ArraysOfXarrayArePackedMaskedAndOriented) {
  const ZarrStore store("named.zarr", "zarr.json", group3(R"({"title":"Heat"})"));
  add_weather(store);
  // Reversed so that rows run from south to north; 0 is a value although it is the fill value.
  expect_same(store.values("t"), {kMasked, 125, 125.5, 100, 100.5, 101});
  const DatasetInfo info = info_of(store);
  EXPECT_EQ(info.format, "Zarr v3");
  EXPECT_EQ(info.id, "named");
  EXPECT_EQ(info.title, "Heat");
  EXPECT_THAT(info.grid.axes[0].coordinates, ElementsAre(0, 20, 40));
  EXPECT_THAT(info.grid.axes[1].coordinates, ElementsAre(0, 10));
  EXPECT_EQ(info.fields.at(0).units, "K");
}

TEST(ZarrGroups, FillValueInBase64MasksAsInXarray) {
  const ZarrStore store("s.zarr", "zarr.json", group3("{}"));
  // -999.0 as a double, little-endian: 00 00 00 00 00 38 8f c0.
  store.put("f/zarr.json",
            v3_array("[1,3]", "[1,3]", "float32", "", R"({"_FillValue":"AAAAAAA4j8A="})"));
  store.put("f/c/0/0", bytes_of_items<float>({-999, 0, 2}));
  expect_same(store.values(), {kMasked, 0, 2});
}

TEST(ZarrGroups, AbsentChunksAreCountedWhereTheyAreMasked) {
  const ZarrStore store("s.zarr", "zarr.json", group3("{}"));
  store.put("f/zarr.json", v3_array("[1,3]", "[1,1]", "float32", "", "{}", R"("NaN")"));
  store.put("f/c/0/1", bytes_of_items<float>({7}));
  expect_same(store.values(), {kMasked, 7, kMasked});
  EXPECT_TRUE(says(info_of(store), "never written are masked: 'f' (2 of 3 chunks)"));
}

TEST(ZarrGroups, AbsentFilesThatHaveTheFillValueAreCounted) {
  const ZarrStore store("s.zarr", "zarr.json", group3("{}"));
  store.put("f/zarr.json", v3_array("[1,3]", "[1,1]", "float32", R"(["y","x"])"));
  store.put("f/c/0/1", bytes_of_items<float>({7}));
  expect_same(store.values(), {0, 7, 0});
  EXPECT_TRUE(says(info_of(store), "'f': 2 of 3 files are absent; their values are fill_value"));
}

TEST(ZarrGroups, DimensionNamesMayBeAbsentOrNull) {
  const ZarrStore store("s.zarr", "zarr.json", group3("{}"));
  store.put("f/zarr.json", v3_array("[1,2,3]", "[1,2,3]", "uint8", R"(["time",null,"lon"])"));
  store.put("f/c/0/0/0", "abcdef");
  store.put("g/zarr.json",
            v3_array("[2,3]", "[2,3]", "uint8", "", R"({"_ARRAY_DIMENSIONS":["dim2_2","lon"]})"));
  store.put("g/c/0/0", "abcdef");
  const DatasetInfo info = info_of(store);
  EXPECT_EQ(info.fields.size(), 2);
  EXPECT_EQ(info.grid.axes[0].name, "lon");
  EXPECT_EQ(info.grid.axes[1].name, "dim2_2");
  store.put("f/zarr.json", v3_array("[2,3]", "[2,3]", "uint8", R"(["lon","lon"])"));
  store.put("g/zarr.json", v3_array("[2,3]", "[2,3]", "uint8", R"(["lon"])"));
  EXPECT_THAT(store.fault(), HasSubstr("its dimension names are not names"));
}

TEST(ZarrGroups, ConsolidatedMetadataIsReadInPlaceOfTheFiles) {
  const ZarrStore store("s.zarr", "zarr.json", group3("{}"));
  add_weather(store);
  std::string members;
  for (const char* name : {"lat", "lon", "t"}) {
    members +=
        std::string("\"") + name + "\":" + bytes_of(store.path() + "/" + name + "/zarr.json");
    members += ',';
    std::filesystem::remove(store.path() + "/" + name + "/zarr.json");
  }
  store.put("zarr.json",
            group3("{}", R"(,"consolidated_metadata":{"kind":"inline","must_understand":false,)"
                         R"("metadata":{)" +
                             members + R"("sub":)" + group3("{}") + R"(,"sub/f":)" +
                             v3_array("[2,3]", "[2,3]", "uint8", "") + "}}"));
  expect_same(store.values("t"), {kMasked, 125, 125.5, 100, 100.5, 101});
  const auto left_out = info_of(store).left_out;
  ASSERT_EQ(left_out.size(), 1);
  EXPECT_EQ(left_out[0].name, "sub");
}

TEST(ZarrGroups, ConsolidatedMetadataWithoutMetadataIsRefused) {
  const ZarrStore store("s.zarr", "zarr.json",
                        group3("{}", R"(,"consolidated_metadata":{"kind":"inline"})"));
  EXPECT_THAT(store.fault(), HasSubstr("no 'metadata'"));
  store.put("zarr.json", group3("{}", R"(,"consolidated_metadata":null)"));
  add_weather(store);
  EXPECT_EQ(store.fault(), "");
}

TEST(ZarrGroups, TheRootMayBeAnArray) {
  const ZarrStore store("heat.zarr", "zarr.json", v3_array("[2,2]", "[2,2]", "uint8", ""));
  store.put("c/0/0", "abcd");
  expect_same(store.values("heat"), {97, 98, 99, 100});
}

// The multiscales of an image czyx, 0.5 um by 0.25 um by 0.25 um, that begins at z = 10 um.
const std::string kImage = R"({"axes":[{"name":"c","type":"channel"},)"
                           R"({"name":"z","type":"space","unit":"micrometer"},)"
                           R"({"name":"y","type":"space","unit":"micrometer"},)"
                           R"({"name":"x","type":"space","unit":"micrometer"}],)"
                           R"("datasets":[{"path":"0","coordinateTransformations":[)"
                           R"({"type":"scale","scale":[1,2,1,1]},)"
                           R"({"type":"translation","translation":[0,40,0,0]}]},)"
                           R"({"path":"1","coordinateTransformations":[)"
                           R"({"type":"scale","scale":[1,4,2,2]}]}],)"
                           R"("coordinateTransformations":[{"type":"scale",)"
                           R"("scale":[1,0.25,0.25,0.25]}]})";

void expect_image(const ZarrStore& store) {
  expect_same(store.values("cell"), {97, 98, 99, 100, 101, 102, 103, 104, 105, 106, 107, 108});
  const DatasetInfo info = info_of(store);
  EXPECT_EQ(info.fields.size(), 1);
  EXPECT_THAT(info.grid.axes[0].coordinates, ElementsAre(0, 0.25, 0.5));
  EXPECT_THAT(info.grid.axes[1].coordinates, ElementsAre(0, 0.25));
  EXPECT_THAT(info.grid.axes[2].coordinates, ElementsAre(10, 10.5));
  EXPECT_EQ(info.grid.axes[2].units, "micrometer");
  EXPECT_TRUE(says(info, "of the 2 levels of detail ('multiscales') '0', the finest, is read"));
}

TEST(ZarrGroups, TheFinestLevelOfAnImageOfOmeZarr5) {
  const ZarrStore store("cell.zarr", "zarr.json",
                        group3(R"({"ome":{"version":"0.5","multiscales":[)" + kImage + "]}}"));
  store.put("0/zarr.json", v3_array("[1,2,2,3]", "[1,2,2,3]", "uint8", R"(["c","z","y","x"])"));
  store.put("0/c/0/0/0/0", "abcdefghijkl");
  store.put("1/zarr.json", v3_array("[1,1,1,1]", "[1,1,1,1]", "uint8", R"(["c","z","y","x"])"));
  expect_image(store);
}

TEST(ZarrGroups, TheFinestLevelOfAnImageOfOmeZarr4) {
  const ZarrStore store("cell.zarr");
  store.put(".zattrs", R"({"multiscales":[)" + kImage + "]}");
  store.put("0/.zarray", v2_array("[1,2,2,3]"));
  store.put("0/0/0/0/0", "abcdefghijkl");
  store.put("1/.zarray", v2_array("[1,1,1,1]"));
  expect_image(store);
}

TEST(ZarrGroups, TooManyDimensionsAreRefused) {
  const ZarrStore store;
  std::string arrays;
  for (int n = 0; n < 600; ++n) {
    const std::string name = "v" + std::to_string(n);
    std::string names;
    for (const char c : std::string("abcdefgh")) {
      names += std::string(names.empty() ? "" : ",") + '"' + c + name + '"';
    }
    arrays += std::string(n > 0 ? "," : "") + '"' + name + "\":" +
              v3_array("[2,2,1,1,1,1,1,1]", "[2,2,1,1,1,1,1,1]", "uint8", "[" + names + "]");
  }
  store.put("zarr.json",
            group3("{}", R"(,"consolidated_metadata":{"kind":"inline","must_understand":false,)"
                         R"("metadata":{)" +
                             arrays + "}}"));
  const auto source = open_file(store.path());
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("it has more than 4096 dimensions"));
}

// The root that bioformats2raw writes: no arrays, but a group for each image.
TEST(ZarrGroups, ARefusalNamesTheGroupsOfARootWithoutArrays) {
  const ZarrStore store;
  store.put("zarr.json", group3(R"({"ome":{"version":"0.5","bioformats2raw.layout":3}})"));
  store.put("0/zarr.json", group3("{}"));
  store.put("OME/zarr.json", group3("{}"));
  const auto source = open_file(store.path());
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("; it has the groups '0', 'OME'"));
}

TEST(ZarrGroups, ChannelsAreChosenFrom) {
  const ZarrStore store("cell.zarr", "zarr.json",
                        group3(R"({"ome":{"multiscales":[)" + kImage + "]}}"));
  store.put("0/zarr.json", v3_array("[2,2,2,3]", "[2,2,2,3]", "uint8", R"(["c","z","y","x"])"));
  store.put("0/c/0/0/0/0", "abcdefghijklABCDEFGHIJKL");
  expect_same(store.values("cell"), {97, 98, 99, 100, 101, 102, 103, 104, 105, 106, 107, 108});
  const DatasetInfo info = info_of(store);
  ASSERT_EQ(info.choices.size(), 1U);
  EXPECT_EQ(info.choices[0].name, "c");
}

// With two axes of space the channels are no third one.
TEST(ZarrGroups, AnAxisOfChannelsMayHaveAnyName) {
  const ZarrStore store(
      "cell.zarr", "zarr.json",
      group3(R"({"ome":{"multiscales":[{"axes":[{"name":"stain","type":"channel"},)"
             R"({"name":"y","type":"space"},{"name":"x","type":"space"}],)"
             R"("datasets":[{"path":"0","coordinateTransformations":)"
             R"([{"type":"scale","scale":[1,1,1]}]}]}]}})"));
  store.put("0/zarr.json", v3_array("[2,2,3]", "[2,2,3]", "uint8", R"(["stain","y","x"])"));
  store.put("0/c/0/0/0", "abcdefABCDEF");
  expect_same(store.values("cell"), {97, 98, 99, 100, 101, 102});
  ASSERT_EQ(info_of(store).choices.size(), 1U);
  EXPECT_EQ(info_of(store).choices[0].name, "stain");
}

TEST(ZarrGroups, LevelsMayBeGroupsOfArrays) {
  const ZarrStore store(
      "s.zarr", "zarr.json",
      group3(R"({"multiscales":[{"datasets":[{"path":"a/0"},{"path":"a/1"}]}]})"));
  store.put("a/zarr.json", group3("{}"));
  store.put("a/0/zarr.json", group3("{}"));
  store.put("a/1/zarr.json", group3("{}"));
  store.put("a/0/f/zarr.json", v3_array("[2,2]", "[2,2]", "uint8", ""));
  store.put("a/0/f/c/0/0", "abcd");
  store.put("a/0/g/zarr.json", v3_array("[2,2]", "[2,2]", "uint8", ""));
  store.put("a/0/g/c/0/0", "efgh");
  expect_same(store.values("g"), {101, 102, 103, 104});
  EXPECT_EQ(info_of(store).fields.size(), 2);
}

TEST(ZarrGroups, PathsOfLevelsStayInTheStore) {
  for (const char* path : {"../0", "/etc", "0/../../x", "."}) {
    const ZarrStore store(
        "s.zarr", "zarr.json",
        group3(std::string(R"({"multiscales":[{"datasets":[{"path":")") + path + R"("}]}]})"));
    EXPECT_THAT(store.fault(), HasSubstr("is not a valid path of a level")) << path;
  }
  const ZarrStore store("s.zarr", "zarr.json",
                        group3(R"({"multiscales":[{"datasets":[{"path":"0"}]}]})"));
  EXPECT_THAT(store.fault(), HasSubstr("'0': the finest level is missing"));
}

TEST(ZarrGroups, OtherMultiscalesAreIgnored) {
  const ZarrStore store("s.zarr", "zarr.json",
                        group3(R"({"multiscales":{"layout":[{"asset":"0"}]}})"));
  add_weather(store);
  EXPECT_EQ(store.fault(), "");
}

}  // namespace
}  // namespace windsplat::data::test
