// From a sample to a file, its description and its picture; invalid files and views.
#include <gmock/gmock.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(CliFiles, SynthInspectRender) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "12x10x8");

  const Outcome told = run({"inspect", "--json", path});
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_EQ(told.err, "");
  const json dataset = json::parse(told.out);
  EXPECT_EQ(dataset["id"], "tornado-small");
  EXPECT_EQ(dataset["state"], "ready");
  EXPECT_EQ(dataset["dims"], (json{{"x", 12}, {"y", 10}, {"z", 8}}));
  EXPECT_EQ(dataset["steps"]["count"], 2);
  EXPECT_EQ(dataset["steps"]["times"].size(), 2U);
  ASSERT_GE(dataset["fields"].size(), 2U);
  for (const json& field : dataset["fields"]) {
    for (const char* key : {"name", "kind", "components", "units", "standardName", "range",
                            "masked", "dtype", "rangeOf"}) {
      EXPECT_TRUE(field.contains(key)) << key;
    }
    if (field["dtype"] == "derived") {
      EXPECT_TRUE(field["range"].is_null()) << field;  // not computed
      continue;
    }
    EXPECT_LE(field["range"][0], field["range"][1]);
    EXPECT_EQ(field["masked"], 0);
  }
  EXPECT_EQ(dataset["defaultView"]["dataset"], "tornado-small");
  double longest = 0;
  for (int a = 0; a < 3; ++a) {
    const double low = dataset["world"]["min"][a];
    const double high = dataset["world"]["max"][a];
    EXPECT_NEAR(low + high, 0, 1e-9) << "centred on the origin";
    longest = std::max(longest, high - low);
  }
  EXPECT_NEAR(longest, 2, 1e-9);

  const std::string picture = folder.file("out.png");
  const Outcome drawn = run({"render", path, "--size", "64x48", "-o", picture});
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(drawn.out + drawn.err, "");
  EXPECT_EQ(png_size(read_file(picture)), (std::pair<std::uint32_t, std::uint32_t>(64, 48)));
}

TEST(CliFiles, AnEntryOfADimensionIsChosenBehindTheName) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "12x10x8");
  const json whole = json::parse(run({"inspect", "--json", path}).out);
  EXPECT_EQ(whole["choices"], json::array());
  const std::string time = whole["steps"]["times"][1]["text"];
  const Outcome told = run({"inspect", "--json", path + "?time=" + time});
  ASSERT_EQ(told.code, 0) << told.err;
  const json one = json::parse(told.out);
  EXPECT_EQ(one["id"], "tornado-small,time=" + time);
  EXPECT_EQ(one["steps"]["count"], 1);
  ASSERT_EQ(one["choices"].size(), 1U);
  EXPECT_EQ(one["choices"][0]["name"], "time");
  EXPECT_EQ(one["choices"][0]["length"], 2);
  EXPECT_EQ(one["choices"][0]["chosen"], time);
  EXPECT_EQ(one["choices"][0]["values"],
            json({whole["steps"]["times"][0]["text"], whole["steps"]["times"][1]["text"]}));
  const Outcome text = run({"inspect", path + "?time=" + time});
  EXPECT_THAT(text.out, HasSubstr("chosen\n"));
  const Outcome absent = run({"inspect", path + "?number=3"});
  EXPECT_EQ(absent.code, 1);
  EXPECT_THAT(absent.err, HasSubstr("there is no dimension 'number': there are 'time' (2)"));
  const Outcome nameless = run({"inspect", path + "?=3"});
  EXPECT_EQ(nameless.code, 2);
  EXPECT_THAT(nameless.err, HasSubstr("has a choice without a name"));
}

TEST(CliFiles, InspectTakesSeveralFilesAndGoesOnAfterABadOne) {
  const Folder folder;
  const std::string first = synth(folder, "climate", "16x8x5");
  const std::string bad = folder.file("bad.nc");
  write_file(bad, "not a data file");
  const Outcome told = run({"inspect", "--json", first, bad, "tornado:8"});
  EXPECT_NE(told.code, 0);
  EXPECT_THAT(told.err, HasSubstr("bad.nc: "));
  std::istringstream lines(told.out);
  std::vector<std::string> titles;
  for (std::string line; std::getline(lines, line);) titles.push_back(json::parse(line)["title"]);
  EXPECT_THAT(titles, testing::SizeIs(2));
  EXPECT_EQ(run({"inspect", first, "tornado:8"}).code, 0);
}

TEST(CliFiles, InspectTextNamesAxesFieldsStepsAndSize) {
  const Folder folder;
  const std::string path = synth(folder, "climate", "16x8x5");
  const Outcome told = run({"inspect", path});
  ASSERT_EQ(told.code, 0) << told.err;
  const json dataset = json::parse(run({"inspect", "--json", path}).out);
  EXPECT_THAT(told.out, HasSubstr("16 x 8 x 5"));
  for (const json& field : dataset["fields"]) {
    EXPECT_THAT(told.out, HasSubstr(field["name"].get<std::string>()));
    const std::string units = field["units"];
    EXPECT_THAT(told.out, HasSubstr(units));
  }
  EXPECT_THAT(told.out, HasSubstr("steps: 2"));
  EXPECT_THAT(told.out, HasSubstr("the first is /step=0"));
  for (const char* word : {"longitude", "latitude", "even", "masked", "KiB"}) {
    EXPECT_THAT(told.out, HasSubstr(word));
  }
  EXPECT_EQ(told.out.find('\x1b'), std::string::npos);
}

TEST(CliFiles, InspectReportsWithoutMemoryWhenRangesExceedTheLimit) {
  const Outcome told = run({"inspect", "tornado:400", "--memory-limit", "192M"});
  EXPECT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, HasSubstr("400 x 400 x 400 samples"));
  EXPECT_THAT(told.out, HasSubstr("not read"));
  EXPECT_THAT(told.out, HasSubstr("ranges are not read: "));
  EXPECT_THAT(told.out, Not(HasSubstr("(ranges over")));
  // The lines of the text are wrapped.
  const Outcome whole = run({"inspect", "--json", "tornado:400", "--memory-limit", "192M"});
  EXPECT_THAT(whole.out,
              HasSubstr("needs 732.4 MiB; --memory-limit 192M leaves 68.0 MiB for data"));
  EXPECT_THAT(whole.out, HasSubstr("--memory-limit 901M would suffice"));
  const Outcome asked =
      run({"inspect", "tornado:400", "--memory-limit", "192M", "--ranges", "first"});
  EXPECT_EQ(asked.code, 1);
  EXPECT_THAT(asked.err, HasSubstr("--memory-limit 901M would suffice"));
}

TEST(CliFiles, BuiltInSampleNeedsNoFile) {
  const Folder folder;
  const Outcome told = run({"inspect", "--json", "tornado"});
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_EQ(json::parse(told.out)["id"], "tornado");
}

TEST(CliFiles, NameDecidesTheFormatAndDashIsStdout) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "8x8x8");
  const auto draw = [&](const std::string& output) {
    const Outcome outcome = run({"render", path, "--size", "40x30", "-o", output});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  draw(folder.file("a.png"));
  draw(folder.file("a.jpg"));
  draw(folder.file("a.JPEG"));
  draw(folder.file("a.npy"));
  EXPECT_THAT(read_file(folder.file("a.jpg")), StartsWith("\xff\xd8\xff"));
  EXPECT_THAT(read_file(folder.file("a.JPEG")), StartsWith("\xff\xd8\xff"));
  const std::string npy = read_file(folder.file("a.npy"));
  EXPECT_THAT(npy, StartsWith("\x93NUMPY"));
  EXPECT_THAT(npy.substr(0, 128), HasSubstr("(30, 40, 4)"));
  const std::string png = draw("-");
  EXPECT_EQ(png_size(png), (std::pair<std::uint32_t, std::uint32_t>(40, 30)));
  EXPECT_EQ(png, read_file(folder.file("a.png")));
}

TEST(CliFiles, ReportContainsTimesAndOmittedWork) {
  const Folder folder;
  const std::string path = synth(folder, "climate", "16x8x5");
  const auto report_of = [&](const Words& more) {
    Words words{"render", path, "--size", "64x48", "-o", folder.file("a.png")};
    words.insert(words.end(), {"--report", "-"});
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return json::parse(outcome.out);
  };
  const json both = report_of({"--set", "/method/name=slab", "--set", "/vector/stride=2"});
  EXPECT_EQ(both["method"], "slab");
  EXPECT_EQ(both["stride"], 2);
  EXPECT_EQ(both["width"], 64);
  EXPECT_EQ(both["work"]["fields"], (json{"wind", "cloud"}));
  EXPECT_EQ(both["work"]["bytes"], 4 * 4 * 16 * 8 * 5);
  EXPECT_GT(both["work"]["exponentials"], 0);
  EXPECT_GT(both["renderMs"], 0);
  EXPECT_GT(both["encodeMs"], 0);

  const json winds = report_of({"--set", "/scalars=[]"});
  EXPECT_EQ(winds["work"]["fields"], json{"wind"});
  EXPECT_EQ(winds["work"]["bytes"], 3 * 4 * 16 * 8 * 5);
  EXPECT_EQ(winds["work"]["exponentials"], 0);

  const std::string file = folder.file("report.json");
  const Outcome drawn = run({"render", path, "--size", "8x8", "-o", "-", "--report", file});
  ASSERT_EQ(drawn.code, 0) << drawn.err;
  EXPECT_EQ(png_size(drawn.out).first, 8U);
  EXPECT_EQ(json::parse(read_file(file))["height"], 8);
  EXPECT_EQ(run({"render", path, "-o", "-", "--report", "-"}).code, 2);
}

TEST(CliFiles, AnyThreadCountGivesTheSameBytes) {
  const Folder folder;
  const std::string path = synth(folder, "climate", "32x16x6");
  const auto draw = [&](const char* threads) {
    const Outcome outcome =
        run({"render", path, "--size", "160x120", "--threads", threads, "-o", "-"});
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  const std::string one = draw("1");
  EXPECT_EQ(png_size(one).first, 160U);
  EXPECT_EQ(one, draw("2"));
  EXPECT_EQ(one, draw("5"));
}

// A file size limit, which libraries report like a full disk.
TEST(CliFiles, SynthReportsAFailedWriteAndLeavesNoFile) {
  const Folder folder;
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{1 << 20, before.rlim_max};
  std::signal(SIGXFSZ, SIG_IGN);  // inherited: the write fails instead
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Outcome outcome =
      run({"synth", "tornado", "--dims", "96x96x96", "-o", folder.file("large.nc")});
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, SIG_DFL);
  EXPECT_EQ(outcome.code, 1) << outcome.err;
  EXPECT_THAT(outcome.err, StartsWith("windsplat: writing netCDF failed"));
  EXPECT_THAT(outcome.err, HasSubstr("MiB left"));
  for (const auto& left : std::filesystem::directory_iterator(folder.file(""))) {
    EXPECT_THAT(left.path().filename().string(), Not(HasSubstr("large.nc")));
  }

  const Outcome nowhere =
      run({"synth", "tornado", "--dims", "8x8x8", "-o", folder.file("absent/x.nc")});
  EXPECT_EQ(nowhere.code, 1);
  EXPECT_THAT(nowhere.err, HasSubstr("missing folder"));
}

TEST(CliFiles, OptionsOverrideTheViewFile) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "8x8x8");
  const std::string view = folder.file("view.json");
  write_file(view, R"({"dataset": "elsewhere", "image": {"width": 32, "height": 24,
                       "background": "#ff0000"}, "vector": {"field": null}, "scalars": []})");
  const auto draw = [&](const Words& more) {
    Words words{"render", path, "--view", view, "-o", "-"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  using Size = std::pair<std::uint32_t, std::uint32_t>;
  EXPECT_EQ(png_size(draw({})), Size(32, 24));
  EXPECT_EQ(png_size(draw({"--size", "48x40"})), Size(48, 40));
  EXPECT_EQ(png_size(draw({"--size", "48x40", "--set", "/image/height=50"})), Size(48, 50));
  EXPECT_NE(draw({"--set", "/image/background=#00ff00"}), draw({}));
}

TEST(CliFiles, FigureDrawsLinesInTheColorsOfTheLegendUnlessSetOtherwise) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "8x8x8");
  const auto draw = [&](const Words& more) {
    Words words{"render", path, "--size", "64x48", "-o", "-"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  const std::string figure = draw({"--figure"});
  EXPECT_EQ(figure, draw({"--figure", "--set", "/vector/color/trueColors=true"}));
  EXPECT_NE(figure, draw({"--figure", "--set", "/vector/color/trueColors=false"}));
}

TEST(CliFiles, StepSelectsAnotherPicture) {
  const Folder folder;
  const std::string path = synth(folder, "climate", "32x16x6");
  const Words words{"render", path, "--size", "80x60", "-o", "-", "--step"};
  Words first = words;
  first.emplace_back("0");
  Words second = words;
  second.emplace_back("1");
  EXPECT_NE(run(first).out, run(second).out);
}

TEST(CliFiles, InvalidViewsExitWith2AndNameTheirLocation) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "8x8x8");
  const std::vector<std::pair<Words, std::string>> bad{
      {{"--set", "/vector/r1=65"}, "/vector/r1"},
      {{"--set", "/vector/nonsense=1"}, "/vector/nonsense"},
      {{"--set", "/camera/fovY=180"}, "/camera/fovY"},
      {{"--set", "/camera/eye=[0,0]"}, "/camera/eye"},
      {{"--set", "/method/name=splat"}, "/method/name"},
      {{"--set", "/vector/field=nosuch"}, "/vector/field"},
      {{"--size", "1000000000x1000000000"}, "/image/width"},
      {{"--step", "2"}, "/step"},
      {{"--step", "-1"}, "/step"},
      {{"--step", "one"}, "/step"}};
  for (const auto& [words, pointer] : bad) {
    Words all{"render", path, "-o", folder.file("never.png")};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = run(all);
    EXPECT_EQ(outcome.code, 2) << words[1];
    EXPECT_THAT(outcome.err, HasSubstr(pointer));
    EXPECT_FALSE(std::filesystem::exists(folder.file("never.png")));
  }
  for (const char* text : {"{", "[]", R"({"step": NaN})", R"({"step": 1, "step": 2})",
                           R"({"image": {"width": 1e999}})"}) {
    const std::string view = folder.file("bad.json");
    write_file(view, text);
    EXPECT_EQ(run({"render", path, "--view", view, "-o", "-"}).code, 2) << text;
  }
}

TEST(CliFiles, InvalidDataExitsWith3AndNamesTheFile) {
  const Folder folder;
  const std::string text = folder.file("letter.nc");
  write_file(text, "Dear reader, this is not a data file.\n");
  const std::string whole = read_file(synth(folder, "tornado", "16x16x16"));
  const std::string cut = folder.file("cut.nc");
  write_file(cut, whole.substr(0, whole.size() / 2));
  const std::string empty = folder.file("empty.nc");
  write_file(empty, "");
  for (const std::string& path : {text, cut, empty}) {
    for (const Words& words : {Words{"inspect", path}, Words{"inspect", "--json", path},
                               Words{"render", path, "-o", folder.file("never.png")},
                               Words{"serve", "--listen", ":0", path}}) {
      const Outcome outcome = run(words);
      EXPECT_EQ(outcome.code, 3) << words[0] << ' ' << path;
      EXPECT_EQ(outcome.out, "");
      EXPECT_THAT(outcome.err, HasSubstr(std::filesystem::path(path).filename().string()));
    }
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("never.png")));
}

TEST(CliFiles, MissingFilesExitWith1) {
  const Folder folder;
  for (const Words& words :
       {Words{"render", "hurricane", "-o", folder.file("a.png")},
        Words{"inspect", folder.file("nothing.nc")},
        Words{"render", "tornado", "--view", folder.file("nothing.json"), "-o", "-"},
        Words{"synth", "tornado", "--dims", "4x4x4", "-o", folder.file("no/such/folder.nc")}}) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 1) << words[0] << ' ' << words[1] << ' ' << outcome.err;
    EXPECT_NE(outcome.err, "");
    EXPECT_EQ(outcome.out, "");
  }
  const std::string path = synth(folder, "tornado", "4x4x4");
  const Outcome unwritable =
      run({"render", path, "--size", "8x8", "-o", folder.file("no/such/folder.png")});
  EXPECT_EQ(unwritable.code, 1);
  EXPECT_THAT(unwritable.err, HasSubstr("folder.png"));
}

TEST(CliFiles, FullDiskIsReportedAndNoPartialFileLeft) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "4x4x4");
  const std::string full = folder.file("full.png");  // every write to /dev/full fails
  std::filesystem::create_symlink("/dev/full", full);
  const Outcome outcome = run({"render", path, "--size", "8x8", "-o", full});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("full.png"));
  EXPECT_TRUE(std::filesystem::is_symlink(full)) << "special files are never removed";
}

TEST(CliFiles, ControlCharactersInNamesAreEscaped) {
  const Outcome outcome = run({"inspect", "evil\x1b[31m\nname.nc"});
  EXPECT_EQ(outcome.code, 1);
  EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1);
}

}  // namespace
}  // namespace cli_test
