#include "server/movie/ffmpeg.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <sstream>
#include <system_error>
#include <utility>

#include "protocol/animation/limits.hpp"
#include "server/base/cancel.hpp"
#include "server/movie/child.hpp"

namespace windsplat::movie {
namespace {

namespace fs = std::filesystem;

constexpr const char* advice =
    ": install the package ffmpeg, or choose a .zip, which holds the pictures as PNG and needs no "
    "other program";

std::string found_in(std::string_view folders) {
  while (!folders.empty()) {
    const std::size_t end = std::min(folders.find(':'), folders.size());
    const std::string_view folder = folders.substr(0, end);
    folders.remove_prefix(std::min(end + 1, folders.size()));
    if (!folder.starts_with('/')) continue;  // it would depend on the current folder
    std::string program = std::string(folder) + "/ffmpeg";
    std::error_code ignored;
    if (fs::is_regular_file(program, ignored) && ::access(program.c_str(), X_OK) == 0) {
      return program;
    }
  }
  return {};
}

// Lines of -encoders are "V....D libx264  description"; the first letter is V for video.
Result<std::vector<std::string>> ask_for_encoders(const std::string& program) {
  const CancelToken never;
  auto child = Child::start(program, {"-hide_banner", "-loglevel", "error", "-encoders"}, -1,
                            Child::Keeps::all, std::chrono::seconds(10));
  if (!child) return child.error();
  if (auto done = child->finish(never); !done) return done.error();
  std::vector<std::string> out;
  std::istringstream lines(child->messages());
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string flags;
    std::string name;
    if (!(words >> flags >> name) || flags.front() != 'V') continue;
    for (const Container container : containers) {
      const auto wanted = encoders_of(container);
      if (std::find(wanted.begin(), wanted.end(), name) != wanted.end()) out.push_back(name);
    }
  }
  return out;
}

std::string fps_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.12g", value);
  return text;
}

void append(std::vector<std::string>& words, std::initializer_list<const char*> more) {
  words.insert(words.end(), more.begin(), more.end());
}

// OpenH264 has no constant quality in ffmpeg, only a rate: bits a second.
std::string bit_rate(const Options& options, int width, int height) {
  constexpr double bits_a_pixel = 0.2;  // of a frame
  const double bits = bits_a_pixel * width * height * options.fps;
  return std::to_string(std::llround(std::clamp(bits, 2e5, 2e8)));
}

}  // namespace

std::vector<std::string> encoders_of(Container container) {
  switch (container) {
    case Container::mp4:
      return {"libx264", "libopenh264"};
    case Container::webm:
      return {"libvpx-vp9"};
    case Container::zip:
      break;
  }
  return {};
}

Result<Ffmpeg> find_ffmpeg(const std::string& search) {
  std::string folders = search;
  if (folders.empty()) {
    const char* const path = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): none sets any
    if (path != nullptr) folders = path;
  }
  const std::string program = found_in(folders);
  if (program.empty()) {
    return make_error(
        ErrorKind::invalid,
        std::string("the program ffmpeg, which encodes videos, is not in PATH") + advice);
  }
  using Key = std::pair<std::string, fs::file_time_type>;
  static std::mutex mutex;
  static std::map<Key, Ffmpeg> known;
  std::error_code ignored;
  const Key key(program, fs::last_write_time(program, ignored));
  const std::lock_guard lock(mutex);
  if (const auto at = known.find(key); at != known.end()) return at->second;
  auto encoders = ask_for_encoders(program);
  if (!encoders) return encoders.error();
  return known.emplace(key, Ffmpeg{program, std::move(*encoders)}).first->second;
}

Result<std::string> choose_encoder(const Ffmpeg& ffmpeg, Container container) {
  std::string wanted;
  for (const std::string& encoder : encoders_of(container)) {
    const auto& have = ffmpeg.encoders;
    if (std::find(have.begin(), have.end(), encoder) != have.end()) return encoder;
    wanted += (wanted.empty() ? "" : " or ") + encoder;
  }
  return make_error(ErrorKind::invalid, in_quotes(ffmpeg.program) + " lacks the encoder " + wanted +
                                            " for ." + std::string(name_of(container)) +
                                            ": use one that has it, or choose a .zip");
}

Result<void> check_encoder(Container container) {
  if (!needs_ffmpeg(container)) return {};
  const auto ffmpeg = find_ffmpeg();
  if (!ffmpeg) return ffmpeg.error();
  const auto encoder = choose_encoder(*ffmpeg, container);
  if (!encoder) return encoder.error();
  return {};
}

Result<void> check_video_size(Container container, int width, int height) {
  constexpr std::int64_t most = protocol::limits::video_pixels_max;
  if (!needs_ffmpeg(container) || std::int64_t{width} * height <= most) return {};
  return make_error(ErrorKind::too_large, "a picture of a video has at most " +
                                              std::to_string(most) +
                                              " pixels (4096 x 2304): choose a smaller one, or zip "
                                              "as the format");
}

std::vector<std::string> arguments_of(const Options& options, const std::string& encoder, int width,
                                      int height) {
  const std::string size = std::to_string(width) + 'x' + std::to_string(height);
  const std::string fps = fps_text(options.fps);
  std::vector<std::string> words;
  // Without -xerror it ends with code 0 if only the end of the file could not be written.
  append(words, {"-nostdin", "-hide_banner", "-loglevel", "error", "-xerror", "-f", "rawvideo",
                 "-pixel_format", "rgb24", "-video_size"});
  append(words, {size.c_str(), "-framerate", fps.c_str(), "-i", "pipe:0", "-an", "-vf"});
  append(words, {"scale=in_range=pc:out_range=tv:out_color_matrix=bt709:"
                 "flags=bicubic+accurate_rnd+full_chroma_int,format=yuv420p"});
  append(words, {"-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc", "iec61966-2-1",
                 "-color_range", "tv", "-c:v", encoder.c_str()});
  // Both hold that many pictures in memory to look ahead, of 40 and 25 by default.
  if (encoder == "libx264") {
    append(words, {"-preset", "medium", "-crf", "18", "-rc-lookahead", "10"});
  } else if (encoder == "libopenh264") {
    append(words, {"-b:v", bit_rate(options, width, height).c_str()});
  } else {
    append(words, {"-crf", "24", "-b:v", "0", "-deadline", "good", "-cpu-used", "4", "-row-mt", "1",
                   "-lag-in-frames", "10"});
  }
  if (options.threads > 0) append(words, {"-threads", std::to_string(options.threads).c_str()});
  if (options.container == Container::mp4) append(words, {"-movflags", "+faststart"});
  append(words, {"-f", std::string(name_of(options.container)).c_str(), "-y", "file:/dev/fd/3"});
  return words;
}

}  // namespace windsplat::movie
