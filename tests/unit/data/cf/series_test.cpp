// Several netCDF files as one dataset. Every sample of the test files encodes its origin, so that a
// step of a series differs from all others.
#include "server/data/cf/series.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "server/data/files/files.hpp"
#include "server/data/formats/netcdf/file.hpp"
#include "server/data/model/dataset_info.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/volume.hpp"
#include "server/data/open/open.hpp"
#include "tests/unit/data/dataset_probe.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::test {
namespace {

struct Part {
  std::vector<double> times;
  std::string units;
  std::string calendar{};
  double base = 0;  // sample i of record r is base + 100 r + i
  std::vector<double> latitudes{-10, 0, 10};
  bool extra = false;
  std::string kelvin = "K";
};

void write_part(const std::string& path, const Part& part) {
  NetcdfMaker file(path);
  const int t = file.dimension("time", NC_UNLIMITED);
  const int time = file.variable("time", NC_DOUBLE, {t}, part.times);
  file.text(time, "units", part.units);
  if (!part.calendar.empty()) file.text(time, "calendar", part.calendar);
  const int z = file.axis("lev", {1000, 500}, "hPa");
  const int y = file.axis("lat", part.latitudes, "degrees_north");
  const int x = file.axis("lon", {0, 10, 20, 30}, "degrees_east");
  const std::size_t layer = 2 * part.latitudes.size() * 4;
  std::vector<double> values;
  for (std::size_t r = 0; r < part.times.size(); ++r) {
    const auto record = counting(layer, part.base + 100.0 * static_cast<double>(r));
    values.insert(values.end(), record.begin(), record.end());
  }
  const int f = file.variable("f", NC_FLOAT, {t, z, y, x}, values);
  file.text(f, "units", part.kelvin);
  if (part.extra) file.variable("g", NC_FLOAT, {t, z, y, x}, values);
}

float first_sample(Source& source, std::size_t step, const std::string& name = "f") {
  const auto field =
      static_cast<std::size_t>(source.info().find(name) - source.info().fields.data());
  auto volume = source.read(field, step);
  EXPECT_TRUE(volume) << volume.error().message;
  return volume ? volume->values[0] : NAN;
}

std::vector<std::string> texts(const DatasetInfo& info) {
  std::vector<std::string> out;
  for (const TimeStep& step : info.steps) out.push_back(step.text.substr(0, 16));
  return out;
}

TEST(Series, RepeatedTimesWithinAFileAreCounted) {
  const Folder folder;
  write_part(folder / "a.nc", {{0, 6, 6, 6}, "hours since 2001-01-01", "", 1000});
  write_part(folder / "b.nc", {{6, 12}, "hours since 2001-01-01", "", 2000});
  auto source = open_file(folder / "*.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().steps.size(), 3U);
  EXPECT_TRUE(has_note((*source)->info(), "2 times are repeated within one file"));
  EXPECT_TRUE(has_note((*source)->info(), "1 time occurs in more than one file"));
  EXPECT_EQ(first_sample(**source, 1), 2000);
}

TEST(Series, StepsAreOrderedByTimeForAnyFileEpochsAndNames) {
  const Folder folder;
  write_part(folder / "run_a.nc", {{0, 6}, "hours since 2001-01-03", "", 3000});
  write_part(folder / "run_b.nc", {{0, 0.25}, "days since 2001-01-01", "gregorian", 1000});
  write_part(folder / "run_c.nc", {{12 * 60}, "minutes since 2001-01-02", "", 2000});
  auto source = open_file(folder / "run_*.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(texts((*source)->info()),
            (std::vector<std::string>{"2001-01-01T00:00", "2001-01-01T06:00", "2001-01-02T12:00",
                                      "2001-01-03T00:00", "2001-01-03T06:00"}));
  EXPECT_EQ((*source)->info().time_units, "hours since 2001-01-03");  // that of the first file
  EXPECT_EQ((*source)->info().steps[0].value, -48);
  const std::vector<float> expected{1000, 1100, 2000, 3000, 3100};
  for (std::size_t step : {4U, 0U, 2U, 1U, 3U}) {
    EXPECT_EQ(first_sample(**source, step), expected[step]) << step;
  }
  EXPECT_TRUE(has_note((*source)->info(), "3 files joined along time"));
}

// Sample (y, x) of time t is 100 t + 10 y + x, for any order of dimensions.
// An empty file, one of zeros and a truncated one, in any place.
TEST(Series, DamagedFilesAreLeftOutAndNamed) {
  for (const std::size_t whole : {1U, 2U, 3U}) {
    const Folder folder;
    for (const double n : {1, 2, 3, 4}) {
      const std::string path = folder / ("f_" + std::to_string(static_cast<int>(n)) + ".nc");
      write_part(path, {{6 * n}, "hours since 2001-01-01", "", 1000 * n});
      if (n == static_cast<double>(whole) || n == 4) continue;
      const std::string bytes = bytes_of(path);
      write_bytes(path, n == 1   ? ""
                        : n == 2 ? std::string(bytes.size(), '\0')
                                 : bytes.substr(0, bytes.size() / 2));
    }
    const auto source = opened(folder / "f_*.nc");
    ASSERT_NE(source, nullptr);
    const auto start = static_cast<double>(whole);
    ASSERT_EQ(source->info().steps.size(), 2U);
    EXPECT_EQ(source->info().steps[0].value, 6 * start);
    EXPECT_EQ(first_sample(*source, 0), static_cast<float>(1000 * start));
    EXPECT_EQ(first_sample(*source, 1), 4000);
    EXPECT_TRUE(
        has_note(source->info(), "2 of 4 files cannot be read, their steps are left out: "));
    for (const std::size_t n : {1U, 2U, 3U, 4U}) {
      const std::string name = "'f_" + std::to_string(n) + ".nc'";
      EXPECT_EQ(has_note(source->info(), name), n != whole && n != 4) << name;
    }
  }
  const Folder folder;
  write_bytes(folder / "g_1.nc", "CDF");
  write_bytes(folder / "g_2.nc", "CDF");
  EXPECT_NE(refusal(folder / "g_*.nc").find("'g_1.nc'"), std::string::npos);
}

TEST(Series, TimeMayBeAnyDimension) {
  const Folder folder;
  for (const int part : {0, 1}) {
    NetcdfMaker file(folder / (part == 0 ? "t0.nc" : "t1.nc"));
    const std::vector<double> times{2.0 * part, 2.0 * part + 1};
    const int y = file.axis("lat", {0, 10, 20}, "degrees_north");
    const int t = file.axis("time", times, "days since 2001-01-01");
    const int x = file.axis("lon", {0, 10}, "degrees_east");
    std::vector<double> values;
    for (const int j : {0, 1, 2}) {
      for (const double time : times) {
        for (const int i : {0, 1}) values.push_back(100 * time + 10 * j + i);
      }
    }
    file.variable("f", NC_FLOAT, {y, t, x}, values);
  }
  auto source = open_file(folder / "t*.nc");
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->info().steps.size(), 4U);
  for (const std::size_t step : {3U, 0U, 1U, 2U}) {
    const Volume volume = volume_of(**source, "f", step);
    const auto first = 100 * static_cast<float>(step);
    const std::vector<float> values(volume.values.data(), volume.values.data() + 6);
    EXPECT_EQ(values, (std::vector<float>{first, first + 1, first + 10, first + 11, first + 20,
                                          first + 21}));
  }
}

TEST(Series, LaterOfTwoFilesWithOneTimeIsUsed) {
  const Folder folder;
  write_part(folder / "f1.nc", {{0, 6, 12}, "hours since 2001-01-01", "", 1000});
  write_part(folder / "f2.nc", {{0, 6}, "hours since 2001-01-01 12:00", "", 5000});
  auto source = open_file(folder / "f?.nc");
  ASSERT_TRUE(source) << source.error().message;
  ASSERT_EQ((*source)->info().steps.size(), 4U);
  EXPECT_EQ(first_sample(**source, 1), 1100);
  EXPECT_EQ(first_sample(**source, 2), 5000);  // 12:00 of f2, not 1200 of f1
  EXPECT_EQ(first_sample(**source, 3), 5100);
  EXPECT_TRUE(has_note((*source)->info(), "1 time occurs in more than one file"));
}

TEST(Series, IncompatibleMembersAreReportedWithTheDifference) {
  struct Case {
    Part part;
    const char* says;
  };
  const std::vector<Case> cases{
      {{{6}, "hours since 2001-01-01", "", 0, {-10, 0, 10, 20}}, "'lat' has length 4, not 3"},
      {{{6}, "hours since 2001-01-01", "", 0, {-10, 0, 11}},
       "'lat' differs at index 2: 11, not 10"},
      {{{6}, "hours since 2001-01-01", "noleap"}, "calendar 'noleap'"},
      {{{6}, "Month", ""}, "'Month'"}};
  for (const Case& wrong : cases) {
    const Folder folder;
    write_part(folder / "s1.nc", {{0}, "hours since 2001-01-01"});
    write_part(folder / "s2.nc", wrong.part);
    auto source = open_file(folder / "s*.nc");
    ASSERT_FALSE(source) << wrong.says;
    EXPECT_EQ(source.error().kind, ErrorKind::bad_data);
    EXPECT_NE(source.error().message.find("'s2.nc'"), std::string::npos) << source.error().message;
    EXPECT_NE(source.error().message.find(wrong.says), std::string::npos) << source.error().message;
  }
  const Folder folder;
  write_part(folder / "s1.nc", {{0}, "hours since 2001-01-01"});
  write_bytes(folder / "s2.nc", "not a netCDF file at all");
  const auto source = opened(folder / "s*.nc");
  ASSERT_NE(source, nullptr);
  EXPECT_TRUE(has_note(source->info(), "1 of 2 files cannot be read"));
  EXPECT_TRUE(has_note(source->info(), "'s2.nc'"));
}

TEST(Series, FilesWithOtherDimensionsAreReferredToAListInBraces) {
  const Folder folder;
  write_part(folder / "s1.nc", {{0}, "hours since 2001-01-01"});
  {
    NetcdfMaker file(folder / "s2.nc");
    const int y = file.axis("latitude", {-10, 0, 10}, "degrees_north");
    const int x = file.axis("lon", {0, 10, 20, 30}, "degrees_east");
    file.variable("g", NC_FLOAT, {y, x}, counting(12, 0));
  }
  const auto source = open_file(folder / "s*.nc");
  ASSERT_FALSE(source);
  EXPECT_NE(
      source.error().message.find("it has no dimension 'lat'; files with different variables"),
      std::string::npos)
      << source.error().message;
}

TEST(Series, CoordinatesMayDifferBySinglePrecisionRounding) {
  const Folder folder;
  write_part(folder / "s1.nc", {{0}, "hours since 2001-01-01", "", 1, {-10, 0, 10.1}});
  write_part(folder / "s2.nc",
             {{6}, "hours since 2001-01-01", "", 2, {-10, 0, static_cast<double>(10.1F)}});
  auto source = open_file(folder / "s*.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ(first_sample(**source, 1), 2);
}

TEST(Series, VariablesMissingInSomeFilesAreOmittedWithTheReason) {
  const Folder folder;
  Part with{{0}, "hours since 2001-01-01"};
  with.extra = true;
  write_part(folder / "s1.nc", with);
  write_part(folder / "s2.nc", {{6}, "hours since 2001-01-01"});
  auto source = open_file(folder / "s*.nc");
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->info().find("g"), nullptr);
  EXPECT_EQ(reason_of((*source)->info(), "g"), "not in all files: 's2.nc' lacks it");
  // The reverse order, with different units.
  with.kelvin = "C";
  with.times = {6};
  write_part(folder / "u1.nc", {{0}, "hours since 2001-01-01"});
  write_part(folder / "u2.nc", with);
  auto other = open_file(folder / "u*.nc");
  ASSERT_FALSE(other);  // nothing is left to show
  with.kelvin = "K";
  write_part(folder / "u2.nc", with);
  other = open_file(folder / "u*.nc");
  ASSERT_TRUE(other) << other.error().message;
  EXPECT_EQ(reason_of((*other)->info(), "g"), "not in all files: 'u1.nc' lacks it");
}

// Each file has its own scale and offset, as reanalyses do.
TEST(Series, EveryFileIsUnpackedByItsOwnScale) {
  const Folder folder;
  const auto write = [&](const std::string& name, double time, double scale, double offset) {
    NetcdfMaker file(folder / name);
    const int t = file.dimension("time", NC_UNLIMITED);
    file.text(file.variable("time", NC_INT, {t}, {time}), "units", "hours since 2001-01-01");
    const int y = file.axis("lat", {0, 1}, "degrees_north");
    const int x = file.axis("lon", {0, 1}, "degrees_east");
    const int f = file.variable("f", NC_SHORT, {t, y, x}, {1, 2, -32767, 4});
    file.number(f, "scale_factor", NC_DOUBLE, {scale});
    file.number(f, "add_offset", NC_DOUBLE, {offset});
    file.number(f, "_FillValue", NC_SHORT, {-32767});
  };
  write("p1.nc", 0, 0.5, 10);
  write("p2.nc", 1, 0.25, 100);
  auto source = open_file(folder / "p*.nc");
  ASSERT_TRUE(source) << source.error().message;
  for (std::size_t step : {0U, 1U}) {
    auto volume = (*source)->read(0, step);
    ASSERT_TRUE(volume);
    EXPECT_EQ(volume->values[0], step == 0 ? 10.5F : 100.25F);
    EXPECT_EQ(volume->values[3], step == 0 ? 12.0F : 101.0F);
    EXPECT_EQ(volume->masked, 1);
  }
}

TEST(Series, FilesWithoutATimeDimensionAreOneStepEach) {
  const Folder folder;
  const auto write = [&](const std::string& name, double base, double hour) {
    NetcdfMaker file(folder / name);
    const int z = file.axis("z", {0, 1}, "m");
    const int y = file.axis("y", {0, 1, 2}, "m");
    const int x = file.axis("x", {0, 1}, "m");
    if (hour >= 0)
      file.text(file.variable("time", NC_DOUBLE, {}, {hour}), "units", "hours since 2001-01-01");
    file.variable("f", NC_FLOAT, {z, y, x}, counting(12, base));
  };
  // In natural order if no member has times.
  write("snap10.nc", 300, -1);
  write("snap2.nc", 200, -1);
  write("snap1.nc", 100, -1);
  auto counted = open_file(folder / "snap*.nc");
  ASSERT_TRUE(counted) << counted.error().message;
  ASSERT_EQ((*counted)->info().steps.size(), 3U);
  EXPECT_EQ((*counted)->info().steps[2].text, "2");
  for (std::size_t step : {0U, 1U, 2U}) {
    auto volume = (*counted)->read(0, step);
    ASSERT_TRUE(volume);
    EXPECT_EQ(volume->values[0], 100.0F * static_cast<float>(step + 1));
    EXPECT_EQ(volume->values[11], 100.0F * static_cast<float>(step + 1) + 11);
  }
  write("at1.nc", 100, 12);
  write("at2.nc", 200, 6);
  auto timed = open_file(folder / "at*.nc");
  ASSERT_TRUE(timed) << timed.error().message;
  EXPECT_EQ(texts((*timed)->info()),
            (std::vector<std::string>{"2001-01-01T06:00", "2001-01-01T12:00"}));
  EXPECT_EQ(first_sample(**timed, 0), 200);
}

// A file that counts the open files of its kind.
class Counted final : public cf::ArrayFile {
 public:
  Counted(std::unique_ptr<cf::ArrayFile> file, int& open) : file_(std::move(file)), open_(open) {
    ++open_;
  }
  ~Counted() override { --open_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;
  [[nodiscard]] const FileContents& contents() const override { return file_->contents(); }
  [[nodiscard]] const std::string& name() const override { return file_->name(); }
  [[nodiscard]] std::string format() const override { return file_->format(); }
  [[nodiscard]] std::string identity() const override { return file_->identity(); }
  [[nodiscard]] cf::Numbers numbers(int v, const char* a) const override {
    return file_->numbers(v, a);
  }
  [[nodiscard]] std::string text_of(int v, const char* a) const override {
    return file_->text_of(v, a);
  }
  [[nodiscard]] std::vector<std::size_t> chunk(int v) const override { return file_->chunk(v); }
  Result<void> read(int v, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, double* out) const override {
    return file_->read(v, start, count, out);
  }
  Result<void> read(int v, const std::vector<std::size_t>& start,
                    const std::vector<std::size_t>& count, float* out) const override {
    return file_->read(v, start, count, out);
  }

 private:
  std::unique_ptr<cf::ArrayFile> file_;
  int& open_;
};

TEST(Series, FewFilesAreOpenAtATimeAndAChangedOneIsDetected) {
  const Folder folder;
  constexpr std::size_t members = 80;
  for (std::size_t m = 0; m < members; ++m) {
    std::string name = "m";
    name.append(std::to_string(m)).append(".nc");
    write_part(
        folder / name,
        {{static_cast<double>(m)}, "hours since 2001-01-01", "", 10.0 * static_cast<double>(m)});
  }
  auto location = locate(folder / "m*.nc");
  ASSERT_TRUE(location);
  ASSERT_EQ(location->members.size(), members);
  const auto files = direct_files(*location);
  int open = 0;
  int most = 0;
  auto series = cf::SeriesFile::open(
      "m", members, [&](std::size_t m) -> Result<std::unique_ptr<cf::ArrayFile>> {
        auto input = files->open(files->location().members[m].name);
        if (!input) return input.error();
        auto file = netcdf::File::open(std::move(*input));
        if (!file) return file.error();
        std::unique_ptr<cf::ArrayFile> counted = std::make_unique<Counted>(std::move(*file), open);
        most = std::max(most, open);
        return counted;
      });
  ASSERT_TRUE(series) << series.error().message;
  int f = -1;
  for (std::size_t v = 0; v < (*series)->contents().variables.size(); ++v) {
    if ((*series)->contents().variables[v].name == "f") f = static_cast<int>(v);
  }
  // All steps in one block, read twice.
  std::vector<float> values(members * 2);
  for (int pass = 0; pass < 2; ++pass) {
    ASSERT_TRUE((*series)->read(f, {0, 0, 0, 0}, {members, 2, 1, 1}, values.data()));
    for (std::size_t m = 0; m < members; ++m) {
      EXPECT_EQ(values[2 * m], 10.0F * static_cast<float>(m));
      EXPECT_EQ(values[2 * m + 1], 10.0F * static_cast<float>(m) + 12);
    }
  }
  EXPECT_LE(most, 32);
  EXPECT_GT(most, 1);
  write_part(folder / "m5.nc", {{5, 6}, "hours since 2001-01-01"});
  const auto changed = (*series)->read(f, {5, 0, 0, 0}, {1, 2, 1, 1}, values.data());
  ASSERT_FALSE(changed);
  EXPECT_NE(changed.error().message.find("'m5.nc' has changed"), std::string::npos);
}

}  // namespace
}  // namespace windsplat::data::test
