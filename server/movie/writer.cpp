// Checks the options and opens the writer of a container: pictures to ffmpeg, or to a ZIP of PNG.
#include "server/movie/writer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/animation/animation.hpp"
#include "server/image/encode.hpp"
#include "server/movie/child.hpp"
#include "server/movie/ffmpeg.hpp"
#include "server/movie/output.hpp"
#include "server/movie/zip.hpp"

namespace windsplat::movie {
namespace {

constexpr std::size_t channels = 3;

std::size_t bytes_of(int width, int height) {
  return channels * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

Result<void> check(const Options& options) {
  const auto fits = [](int edge) { return edge >= 1 && edge <= edge_max; };
  if (!fits(options.width) || !fits(options.height)) {
    return make_error(ErrorKind::invalid, "a movie of " + std::to_string(options.width) + " x " +
                                              std::to_string(options.height) +
                                              " pixels: each edge has 1 to " +
                                              std::to_string(edge_max));
  }
  const bool in_range =
      options.fps >= protocol::animation_fps_min && options.fps <= protocol::animation_fps_max;
  if (in_range) return {};
  return make_error(ErrorKind::invalid, "the pictures of a second are 0.1 to 240");
}

Result<void> check_picture(std::span<const std::uint8_t> rgb, const Options& options) {
  const std::size_t wanted = bytes_of(options.width, options.height);
  if (rgb.size() == wanted) return {};
  return make_error(ErrorKind::internal, "a picture of a movie has " + std::to_string(rgb.size()) +
                                             " bytes instead of " + std::to_string(wanted));
}

Error no_pictures() { return make_error(ErrorKind::invalid, "a movie needs at least one picture"); }

// 4:2:0 needs even sizes.
int even(int edge) { return edge + edge % 2; }

class VideoWriter : public Writer {
 public:
  VideoWriter(const Options& options, const CancelToken& cancel, Output output, Child child)
      : options_(options), cancel_(cancel), output_(std::move(output)), child_(std::move(child)) {}

  Result<void> add(std::span<const std::uint8_t> rgb) override {
    if (auto fits = check_picture(rgb, options_); !fits) return fits;
    ++count_;
    return child_.write(padded(rgb), cancel_);
  }

  Result<void> finish() override {
    if (count_ == 0) return no_pictures();
    if (auto done = child_.finish(cancel_); !done) return done;
    return output_.complete();
  }

 private:
  // The picture with its last column and row repeated where its size is odd.
  std::span<const std::uint8_t> padded(std::span<const std::uint8_t> rgb) {
    const int width = even(options_.width);
    const int height = even(options_.height);
    if (width == options_.width && height == options_.height) return rgb;
    const std::size_t from = bytes_of(options_.width, 1);
    const std::size_t to = bytes_of(width, 1);
    padded_.resize(bytes_of(width, height));
    for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
      const auto last = static_cast<std::size_t>(options_.height - 1);
      const std::span row = rgb.subspan(std::min(y, last) * from, from);
      std::uint8_t* const out = padded_.data() + y * to;
      std::copy(row.begin(), row.end(), out);
      if (to > from) std::copy(row.end() - channels, row.end(), out + from);
    }
    return padded_;
  }

  Options options_;
  CancelToken cancel_;
  Output output_;
  Child child_;  // declared last: killed before the file is removed
  std::vector<std::uint8_t> padded_;
  std::size_t count_ = 0;
};

class PictureWriter : public Writer {
 public:
  PictureWriter(const Options& options, const CancelToken& cancel, Output output)
      : options_(options),
        cancel_(cancel),
        output_(std::move(output)),
        zip_([this](std::span<const std::uint8_t> bytes) { return output_.write(bytes); }) {}

  Result<void> add(std::span<const std::uint8_t> rgb) override {
    if (auto fits = check_picture(rgb, options_); !fits) return fits;
    const auto png = image::encode_png(rgb, options_.width, options_.height, cancel_);
    if (!png) return png.error();
    char name[32];
    std::snprintf(name, sizeof name, "frame_%06zu.png", zip_.count());
    return zip_.add(name, *png);
  }

  Result<void> finish() override {
    if (zip_.count() == 0) return no_pictures();
    if (auto done = zip_.finish(); !done) return done;
    return output_.complete();
  }

 private:
  Options options_;
  CancelToken cancel_;
  Output output_;
  Zip zip_;
};

// `make_output` is called once everything else is known to be possible.
template <class MakeOutput>
Result<std::unique_ptr<Writer>> open_writer(const Options& options, const CancelToken& cancel,
                                            const MakeOutput& make_output) {
  if (auto valid = check(options); !valid) return valid.error();
  std::optional<Ffmpeg> ffmpeg;
  std::string encoder;
  if (needs_ffmpeg(options.container)) {
    auto found = find_ffmpeg(options.search);
    if (!found) return found.error();
    auto chosen = choose_encoder(*found, options.container);
    if (!chosen) return chosen.error();
    ffmpeg = std::move(*found);
    encoder = std::move(*chosen);
  }
  Result<Output> output = make_output();
  if (!output) return output.error();
  if (!ffmpeg) {
    return std::unique_ptr<Writer>(
        std::make_unique<PictureWriter>(options, cancel, std::move(*output)));
  }
  const auto file = output->file_for_program();
  if (!file) return file.error();
  auto child = Child::start(
      ffmpeg->program, arguments_of(options, encoder, even(options.width), even(options.height)),
      *file);
  if (!child) return child.error();
  return std::unique_ptr<Writer>(
      std::make_unique<VideoWriter>(options, cancel, std::move(*output), std::move(*child)));
}

}  // namespace

Result<std::unique_ptr<Writer>> Writer::open(const std::filesystem::path& path,
                                             const Options& options, const CancelToken& cancel) {
  return open_writer(options, cancel, [&path] { return Output::at(path); });
}

Result<std::unique_ptr<Writer>> Writer::open(int descriptor, const Options& options,
                                             const CancelToken& cancel) {
  return open_writer(options, cancel, [descriptor] { return Output::to(descriptor); });
}

Result<std::unique_ptr<Writer>> Writer::open_in_place(int file, const Options& options,
                                                      const CancelToken& cancel) {
  return open_writer(options, cancel, [file] { return Output::in_place(file); });
}

}  // namespace windsplat::movie
