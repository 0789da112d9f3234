// Folders, pictures and a program in place of ffmpeg, for tests of movies.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace windsplat::movie::testing {

// A folder that is removed with its files.
class MovieFolder {
 public:
  MovieFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-movie-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "cannot make a folder";
    path_ = name;
  }
  ~MovieFolder() { std::filesystem::remove_all(path_); }
  MovieFolder(const MovieFolder&) = delete;
  MovieFolder& operator=(const MovieFolder&) = delete;

  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }
  [[nodiscard]] std::string path() const { return path_.string(); }
  [[nodiscard]] std::string text(const std::string& name) const {
    std::ifstream file(path_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
  }
  // Names of the files, sorted.
  [[nodiscard]] std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) {
      out.push_back(entry.path().filename().string());
    }
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  std::filesystem::path path_;
};

// A picture whose every byte differs from its neighbours and from those of other pictures.
inline std::vector<std::uint8_t> picture_of(int width, int height, int seed) {
  std::vector<std::uint8_t> out(3U * static_cast<std::size_t>(width) *
                                static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = static_cast<std::uint8_t>(i * 37 + static_cast<std::size_t>(seed) * 101 + i / 256);
  }
  return out;
}

// A program named ffmpeg that lists `encoders`, counts how often it is asked, notes its arguments
// and environment, and runs `body` (Python) to encode.
inline void put_ffmpeg(const MovieFolder& folder, const std::string& body,
                       const std::string& encoders = "libx264 libvpx-vp9") {
  folder.write("ffmpeg", R"(#!/usr/bin/python3
import json, os, pathlib, sys, time
here = pathlib.Path(__file__).parent
if "-encoders" in sys.argv:
    with open(here / "asked", "a") as asked:
        asked.write("x")
    print(" V..... = Video\n ------")
    for name in ")" + encoders +
                             R"(".split():
        print(f" V....D {name:20} an encoder")
    sys.exit(0)
(here / "noted").write_text(json.dumps({"arguments": sys.argv[1:], "environment": dict(os.environ),
                                        "descriptors": sorted(os.listdir("/proc/self/fd"))}))
)" + body);
  std::filesystem::permissions(folder.file("ffmpeg"), std::filesystem::perms::owner_all);
}

// Encodes to the bytes that it gets.
inline const std::string copies_input = R"(
data = sys.stdin.buffer.read()
with open("/dev/fd/3", "wb") as out:
    out.write(data)
)";

}  // namespace windsplat::movie::testing
