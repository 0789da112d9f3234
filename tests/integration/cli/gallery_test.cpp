// docs/gallery: renders its view files at a small size, and compares its script, pictures and text.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "tests/integration/cli_program.hpp"

namespace cli_test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
namespace fs = std::filesystem;

constexpr std::uintmax_t picture_bytes_max = 150'000;
constexpr int shrink = 8;

fs::path root() { return WINDSPLAT_SOURCE_DIR; }
fs::path gallery() { return root() / "docs" / "gallery"; }

// Names, without the extension, of files of the gallery with this extension.
std::set<std::string> names(const std::string& extension) {
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(gallery())) {
    if (entry.path().extension() == extension) found.insert(entry.path().stem().string());
  }
  return found;
}

json view_of(const std::string& name) {
  return json::parse(read_file((gallery() / (name + ".json")).string()));
}

// Files that scripts/gallery_data computes in seconds or minutes.
bool is_computed(const std::string& dataset) {
  return dataset == "mountain-waves.nc" || dataset == "cumulus.nc";
}

struct Entry {
  std::string name, dataset;
  int quality;
};

// A sample by its name, a file by its path below the folder of scripts/fetch-test-data or of
// scripts/gallery_data.
std::string source_of(const std::string& dataset) {
  if (dataset.find('.') == std::string::npos) return dataset;
  if (is_computed(dataset)) return (root() / "build" / "gallery-data" / dataset).string();
  return (root() / "build" / "test-data" / dataset).string();
}

// The list in the script: lines of the form "name dataset quality".
std::vector<Entry> script_entries() {
  const std::string script = read_file((root() / "scripts" / "gallery").string());
  const std::regex line(R"re(\n *"([a-z0-9-]+) ([^ "]+) ([0-9]+)")re");
  std::vector<Entry> entries;
  for (std::sregex_iterator at(script.begin(), script.end(), line), end; at != end; ++at) {
    entries.push_back({(*at)[1], (*at)[2], std::stoi((*at)[3])});
  }
  return entries;
}

// Fraction of pixels with a coverage of at least 0.1, from a picture as .npy: little-endian
// float32, [height, width, 4], after a header that ends in a line feed.
double covered(const std::string& npy, int width, int height) {
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t bytes = pixels * 4 * sizeof(float);
  if (npy.size() < bytes) return 0;
  std::vector<float> values(pixels * 4);
  std::memcpy(values.data(), npy.data() + (npy.size() - bytes), bytes);
  std::size_t count = 0;
  for (std::size_t p = 0; p < pixels; ++p) count += values[4 * p + 3] >= 0.1F ? 1 : 0;
  return static_cast<double>(count) / static_cast<double>(pixels);
}

// A picture of the gallery fills its frame: at least a quarter of it is not background. Pictures of
// computed files are drawn where scripts/gallery has made the files.
TEST(Gallery, EveryViewIsValidAndFillsItsPicture) {
  const Folder folder;
  for (const std::string& name : names(".json")) {
    SCOPED_TRACE(name);
    const json view = view_of(name);
    const std::string source = source_of(view["dataset"].get<std::string>());
    if (is_computed(view["dataset"].get<std::string>()) && !fs::exists(source)) continue;
    const int width = view["image"]["width"].get<int>() / shrink;
    const int height = view["image"]["height"].get<int>() / shrink;
    std::ostringstream size;
    size << width << 'x' << height;
    const std::string output = folder.file(name + ".npy");
    const Outcome drawn = run({"render", source, "--view", (gallery() / (name + ".json")).string(),
                               "--size", size.str(), "-o", output});
    ASSERT_EQ(drawn.code, 0) << drawn.err;
    EXPECT_EQ(drawn.err, "");
    EXPECT_GE(covered(read_file(output), width, height), 0.25);
  }
}

TEST(Gallery, ScriptRendersEveryViewAndNoOther) {
  std::set<std::string> drawn;
  for (const Entry& entry : script_entries()) {
    SCOPED_TRACE(entry.name);
    EXPECT_TRUE(drawn.insert(entry.name).second) << "named twice";
    ASSERT_TRUE(fs::exists(gallery() / (entry.name + ".json")));
    EXPECT_EQ(view_of(entry.name)["dataset"], entry.dataset);
  }
  EXPECT_FALSE(drawn.empty());
  EXPECT_EQ(drawn, names(".json"));
  EXPECT_EQ(drawn, names(".jpg"));
}

TEST(Gallery, PicturesAreSmallAndReferencedFilesExist) {
  const std::string text = read_file((gallery() / "README.md").string());
  for (const std::string& name : names(".jpg")) {
    EXPECT_LE(fs::file_size(gallery() / (name + ".jpg")), picture_bytes_max) << name;
    EXPECT_THAT(text, HasSubstr(name + ".jpg"));
    EXPECT_THAT(text, HasSubstr(name + ".json"));
  }
  const std::regex link(R"(\]\(([^)#:]+)\))");
  for (std::sregex_iterator at(text.begin(), text.end(), link), end; at != end; ++at) {
    EXPECT_TRUE(fs::exists(gallery() / (*at)[1].str())) << (*at)[1];
  }
}

// The commands in the text are those of the script.
TEST(Gallery, TextQuotesTheCommandsOfTheScript) {
  const std::string text = read_file((gallery() / "README.md").string());
  for (const Entry& entry : script_entries()) {
    std::ostringstream command;
    const bool pattern = entry.dataset.find('{') != std::string::npos;
    const std::string dataset = pattern ? "'" + entry.dataset + "'" : entry.dataset;
    command << "windsplat render " << dataset << " --view docs/gallery/" << entry.name
            << ".json --quality " << entry.quality << " -o " << entry.name << ".jpg";
    EXPECT_THAT(text, HasSubstr(command.str()));
  }
}

TEST(Gallery, QualitySetsTheBytesOfAJpeg) {
  const Folder folder;
  const std::string path = synth(folder, "tornado", "16x16x16");
  const auto bytes = [&](const Words& more) {
    const std::string output = folder.file("out.jpg");
    Words words{"render", path, "--size", "160x120", "-o", output};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return read_file(output);
  };
  EXPECT_LT(bytes({"--quality", "30"}).size(), bytes({"--quality", "80"}).size());
  EXPECT_LT(bytes({"--quality", "80"}).size(), bytes({}).size());
  EXPECT_EQ(bytes({"--quality", "95"}), bytes({}));
  for (const char* bad : {"0", "101", "good"}) {
    const Outcome outcome = run({"render", path, "--quality", bad, "-o", folder.file("never.jpg")});
    EXPECT_EQ(outcome.code, 2) << bad;
    EXPECT_FALSE(fs::exists(folder.file("never.jpg")));
  }
}

}  // namespace
}  // namespace cli_test
