// Pictures of equal size -> a movie file. One thread uses a writer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/movie/container.hpp"

namespace windsplat::movie {

inline constexpr int edge_max = 8192;  // pixels

struct Options {
  Container container = Container::mp4;
  int width = 0;   // pixels; 1 to edge_max
  int height = 0;  // pixels; 1 to edge_max
  double fps = 25;
  unsigned threads = 0;  // of ffmpeg; 0: it decides
  std::string search;    // folders in which ffmpeg is searched, "a:b"; empty: those of PATH
};

class Writer {
 public:
  // Begins a movie. Until finish() succeeds, a file of that name keeps what it has: the movie is
  // written beside it under a temporary name (part_of() in base/whole_file.hpp), which the
  // destructor removes. Errors: invalid for options outside of their limits, and where ffmpeg or
  // its encoder is missing (find_ffmpeg()); internal or out_of_memory if the file cannot be made.
  static Result<std::unique_ptr<Writer>> open(const std::filesystem::path& path,
                                              const Options& options, const CancelToken& cancel);

  // The same to an open descriptor, which stays open and need not be seekable. A ZIP is written to
  // it as it grows, a video at the end, from an unnamed file in the folder for temporary files.
  static Result<std::unique_ptr<Writer>> open(int descriptor, const Options& options,
                                              const CancelToken& cancel);

  // The same to an empty regular file, open for reading and writing, which grows while pictures are
  // added.
  static Result<std::unique_ptr<Writer>> open_in_place(int file, const Options& options,
                                                       const CancelToken& cancel);

  virtual ~Writer() = default;
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // Appends a picture: 8-bit sRGB, 3 bytes a pixel, rows from the top, width * height * 3 bytes.
  // Waits while the encoder is busy. Videos have even sizes: of an odd width or height the last
  // column or row is repeated. Errors: internal, out_of_memory (a full disk), cancelled; after one
  // of them the writer is of no further use.
  virtual Result<void> add(std::span<const std::uint8_t> rgb) = 0;

  // Completes the movie and gives it its name; call it once. Errors: as add(); invalid without any
  // picture.
  virtual Result<void> finish() = 0;

 protected:
  Writer() = default;
};

}  // namespace windsplat::movie
