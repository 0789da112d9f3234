// Raw files and the JSON that describes them; expected values follow from docs/user/formats.md.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/data/open/open.hpp"
#include "tests/unit/data/formats/plain_maker.hpp"

namespace windsplat::data {
namespace {

using test::counted;
using test::floats;
using test::Folder;
using test::opened;
using test::packed;
using test::refusal;
using test::values_of;
using test::write_file;
using testing::HasSubstr;

using Doubles = std::vector<double>;

std::string document(const std::string& more) {
  std::string out(R"({"windsplat": "raw", "dims": {"x": 2, "y": 3, "z": 2}, "type": "float32",
                      "endian": "little", )");
  out += more;
  return out + "}";
}

const std::string wind = R"("fields": [{"name": "wind", "components": ["u", "v", "w"],
                                       "units": "m s-1"}, {"name": "cloud"}])";

TEST(Raw, FieldsAreConsecutiveWithinAStep) {
  const Folder folder;
  write_file(folder / "a.json",
             document(R"("file": "a.raw", "offset": 8, "title": "A", "steps": {"count": 2,
                         "start": 6, "step": 3, "units": "hours since 2000-01-01"}, )" +
                      wind));
  write_file(folder / "a.raw", std::string("8 bytes.") + packed<float>(counted(96)));
  const auto source = opened(folder / "a.json");
  ASSERT_TRUE(source);
  const DatasetInfo& info = source->info();
  EXPECT_EQ(info.format, "raw");
  EXPECT_EQ(info.title, "A");
  EXPECT_EQ(info.grid.dims(), (std::array<int, 3>{2, 3, 2}));
  EXPECT_EQ(info.steps[1].text, "2000-01-01T09:00:00Z");
  EXPECT_EQ(info.find("wind")->components, (std::vector<std::string>{"u", "v", "w"}));
  EXPECT_EQ(info.find("wind")->units, "m s-1");
  const auto values = values_of(*source, "wind", 1);
  for (std::size_t i = 0; i < 12; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(values[12 * c + i], static_cast<float>(48 + 3 * i + c));
    }
  }
  EXPECT_EQ(values_of(*source, "cloud", 0)[0], 36);
}

TEST(Raw, OrderLayoutTypeAndMissing) {
  const Folder folder;
  write_file(folder / "b.json", R"({"windsplat": "raw", "file": "b.raw", "dims": {"x": 2, "y": 3},
    "order": "xy", "type": "int16", "endian": "big",
    "axes": {"x": {"units": "km", "first": 5, "spacing": -2}, "y": {"coordinates": [1, 2, 4]}},
    "fields": [{"name": "v", "components": ["a", "b"], "layout": "planar", "missing": [3, 99]},
               {"name": "f", "type": "float64", "endian": "little"}]})");
  write_file(folder / "b.raw",
             packed<std::int16_t>(counted(12), true) + packed<double>(counted(6)));
  const auto source = opened(folder / "b.json");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().grid.axes[0].coordinates, (Doubles{3, 5}));
  EXPECT_EQ(source->info().grid.axes[0].units, "km");
  EXPECT_EQ(source->info().grid.axes[1].coordinates, (Doubles{1, 2, 4}));
  const Volume v = test::volume_of(*source, "v");
  EXPECT_EQ(v.masked, 1);
  EXPECT_EQ(v.component(1)[1], 6);  // x 5 is the first column of the file, y 1 its first entry
  EXPECT_EQ(v.component(0)[2], 4);
  EXPECT_EQ(source->info().find("v")->dtype, "int16");
  EXPECT_EQ(values_of(*source, "f"), floats({3, 0, 4, 1, 5, 2}));
}

TEST(Raw, StepsInSeparateFiles) {
  const Folder folder;
  const std::string steps = R"("steps": {"count": 6, "coordinates": [0, 1, 2, 4, 8, 16]}, )";
  const std::string field = R"("fields": [{"name": "p"}])";
  write_file(folder / "one.json", document(R"("file": "s%02d.raw", "numbers": {"first": 8,
                                              "step": 2}, )" +
                                           steps + field));
  write_file(folder / "two.json", document(R"("file": ["t0", "t1", "t2"], )" + steps + field));
  write_file(folder / "per.json",
             document(R"("file": "t%d", "steps_per_file": 2, )" + steps + field));
  const auto values = [](double first, std::size_t count) {
    Doubles out = counted(count);
    for (double& value : out) value += first;
    return out;
  };
  for (int i = 0; i < 6; ++i) {
    const std::string number = std::to_string(8 + 2 * i);
    write_file(folder / (std::string(number.size() == 1 ? "s0" : "s") + number + ".raw"),
               packed<float>(values(100 * i, 12)));
  }
  for (int i = 0; i < 3; ++i) {
    write_file(folder / (std::string("t") + std::to_string(i)), packed<float>(values(24 * i, 24)));
  }
  auto source = opened(folder / "one.json");
  ASSERT_TRUE(source);
  EXPECT_EQ(source->info().steps[5].value, 16);
  for (const std::size_t step : {5UL, 0UL, 3UL, 4UL, 1UL, 2UL}) {
    EXPECT_EQ(values_of(*source, "p", step), floats(values(100.0 * static_cast<double>(step), 12)));
  }
  for (const char* name : {"two.json", "per.json"}) {
    source = opened(folder / name);
    ASSERT_TRUE(source);
    EXPECT_EQ(values_of(*source, "p", 3), floats(values(36, 12))) << name;
  }
}

TEST(Raw, FieldsInSeparateFiles) {
  const Folder folder;
  write_file(folder / "j.json", document(R"("fields": [{"name": "a", "file": "a.bin"},
    {"name": "b", "file": "in/b.bin", "offset": 3, "type": "uint8"}])"));
  write_file(folder / "a.bin", packed<float>(counted(12, 2)));
  write_file(folder / "in/b.bin", std::string("abc") + packed<std::uint8_t>(counted(12)));
  const auto source = opened(folder / "j.json");
  ASSERT_TRUE(source);
  EXPECT_EQ(values_of(*source, "a"), floats(counted(12, 2)));
  EXPECT_EQ(values_of(*source, "b"), floats(counted(12)));
}

TEST(Raw, ExtraBytesAreWholeStepsOrRefused) {
  const Folder folder;
  const std::string field = R"("file": "a.raw", "offset": 8, "fields": [{"name": "p"}])";
  write_file(folder / "a.json", document(field));
  const auto data = [](std::size_t values) {
    return std::string("8 bytes.") + packed<float>(counted(values));
  };
  write_file(folder / "a.raw", data(12));
  EXPECT_TRUE(opened(folder / "a.json")->info().notes.empty());
  write_file(folder / "a.raw", data(36));
  EXPECT_THAT(opened(folder / "a.json")->info().notes,
              testing::ElementsAre("'a.raw' has 2 more steps than described"));
  write_file(folder / "a.raw", data(14));
  const std::string message = refusal(folder / "a.json");
  EXPECT_THAT(message, HasSubstr("'a.raw' has 64 bytes, 'a.json' describes 56"));
  EXPECT_THAT(message, HasSubstr("not a whole step of 48 bytes"));
}

// Two fields of one file, each given by its offset, describe the file together.
TEST(Raw, FieldsOfOneFileDescribeItTogether) {
  const Folder folder;
  write_file(folder / "a.json", document(R"("fields": [{"name": "a", "file": "a.raw"},
                         {"name": "b", "file": "a.raw", "offset": 48, "type": "uint8"}])"));
  const std::string both = packed<float>(counted(12)) + packed<std::uint8_t>(counted(12));
  write_file(folder / "a.raw", both);
  const auto source = opened(folder / "a.json");
  ASSERT_TRUE(source);
  EXPECT_TRUE(source->info().notes.empty());
  EXPECT_EQ(values_of(*source, "b"), floats(counted(12)));
  write_file(folder / "a.raw", both + "?");
  EXPECT_THAT(refusal(folder / "a.json"), HasSubstr("has 61 bytes, 'a.json' describes 60"));
}

TEST(Raw, OverlongFilesOfAPatternAreCounted) {
  const Folder folder;
  write_file(folder / "a.json",
             document(R"("file": "a%d.raw", "steps": {"count": 3}, "fields": [{"name": "p"}])"));
  for (const char* name : {"a0.raw", "a1.raw", "a2.raw"}) {
    write_file(folder / name, packed<float>(counted(name[1] == '1' ? 12 : 24)));
  }
  EXPECT_THAT(opened(folder / "a.json")->info().notes,
              testing::ElementsAre(
                  "'a0.raw' has 1 more step than described, and 1 more files are too long"));
}

TEST(Raw, MissingFileIsReportedWithItsReference) {
  const Folder folder;
  write_file(folder / "a.json", document(R"("file": "none_%03d.bin", "fields": [{"name": "p"}])"));
  const auto source = open_file(folder / "a.json");
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().kind, ErrorKind::not_found);
  EXPECT_EQ(source.error().message,
            "'none_000.bin', referred to by 'a.json', is missing; expected in the folder of "
            "'a.json'");
}

TEST(Raw, OtherJsonIsRefusedWithTheMissingKey) {
  const Folder folder;
  for (const char* text : {R"({"file": "a.raw"})", " {\n  \"dims\": {}}", "{}"}) {
    write_file(folder / "other.json", text);
    EXPECT_THAT(refusal(folder / "other.json"), HasSubstr(R"("windsplat": "raw")")) << text;
  }
  write_file(folder / "binary", std::string("{\x80\x01 no JSON"));
  EXPECT_THAT(refusal(folder / "binary"), HasSubstr("not a netCDF file"));
}

struct BadRawCase {
  const char* name;
  std::string text;
  const char* reason;
};

class RawRefusal : public testing::TestWithParam<BadRawCase> {};

TEST_P(RawRefusal, NamesThePointer) {
  const Folder folder;
  write_file(folder / "bad.json", GetParam().text);
  write_file(folder / "a.raw", packed<float>(counted(24)));
  write_file(folder / "../secret.raw", packed<float>(counted(24)));
  EXPECT_THAT(refusal(folder / "bad.json"), HasSubstr(GetParam().reason));
}

std::string with(const std::string& more, const std::string& fields = R"([{"name": "p"}])") {
  return document(more + R"("file": "a.raw", "fields": )" + fields);
}

INSTANTIATE_TEST_SUITE_P(
    All, RawRefusal,
    testing::Values(
        BadRawCase{"cut", R"({"windsplat": "raw", )", "not valid JSON"},
        BadRawCase{"deep", with(R"("steps": )" + std::string(100000, '[') + ", "),
                   "nested deeper than 8"},
        BadRawCase{"twice", with(R"("type": "uint8", )"), "'type' occurs twice"},
        BadRawCase{"unknown", with(R"("colour": 1, )"), "/colour: unknown key"},
        BadRawCase{"unknown_below", with("", R"([{"name": "p", "unit": "m"}])"),
                   "/fields/0/unit: unknown key"},
        BadRawCase{"wrap",
                   R"({"windsplat": "raw", "file": "a.raw", "dims": {"x": 4294967297, "y": 1},
            "type": "uint8", "fields": [{"name": "p"}]})",
                   "/dims/x: must be a whole number from 1 to 16777216"},
        BadRawCase{"beyond_64", R"({"windsplat": "raw", "file": "a.raw",
            "dims": {"x": 18446744073709551615, "y": 1}, "type": "uint8",
            "fields": [{"name": "p"}]})",
                   "/dims/x"},
        BadRawCase{"fraction", R"({"windsplat": "raw", "file": "a.raw", "dims": {"x": 2.5, "y": 1},
            "type": "uint8", "fields": [{"name": "p"}]})",
                   "/dims/x"},
        BadRawCase{"huge", R"({"windsplat": "raw", "file": "a.raw",
            "dims": {"x": 16777216, "y": 16777216, "z": 16777216}, "type": "uint8",
            "fields": [{"name": "p"}]})",
                   "2^60"},
        BadRawCase{"large", R"({"windsplat": "raw", "file": "a.raw",
            "dims": {"x": 16777216, "y": 16777216}, "type": "uint8", "fields": [{"name": "p"}]})",
                   "'bad.json' requires 281474976710656"},
        BadRawCase{"short", with(R"("offset": 49, )"), "has 96 bytes; 'bad.json' requires 97"},
        BadRawCase{"negative", with(R"("offset": -1, )"), "/offset"},
        BadRawCase{"endian", R"({"windsplat": "raw", "file": "a.raw", "dims": {"x": 2, "y": 1},
            "type": "int16", "fields": [{"name": "p"}]})",
                   "/endian: is required"},
        BadRawCase{"order", with(R"("order": "zzx", )"), "/order"},
        BadRawCase{"axis", with(R"("axes": {"x": {"coordinates": [1, 2, 3]}}, )"),
                   "/axes/x/coordinates"},
        BadRawCase{"infinite", with(R"("axes": {"x": {"first": 1e999}}, )"), "not valid JSON"},
        BadRawCase{"steps", with(R"("steps": {"count": 99999999999}, )"), "/steps/count"},
        BadRawCase{"same_name", with("", R"([{"name": "p"}, {"name": "p"}])"), "/fields/1"},
        BadRawCase{"components", with("", R"([{"name": "p", "components": ["a"]}])"),
                   "/fields/0/components"},
        BadRawCase{"pattern", document(R"("file": "a%s.raw", "fields": [{"name": "p"}])"), "/file"},
        BadRawCase{"outside", document(R"("file": "../secret.raw", "fields": [{"name": "p"}])"),
                   "outside the dataset's folder"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace windsplat::data
