// The program ffmpeg: where it is, what it can encode, and its arguments.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/movie/container.hpp"
#include "server/movie/writer.hpp"

namespace windsplat::movie {

struct Ffmpeg {
  std::string program;                // absolute path
  std::vector<std::string> encoders;  // of those that encoders_of() names
};

// The first program ffmpeg in the folders of `search` ("a:b"; empty: those of the environment
// variable PATH), of which only absolute ones count. It is asked for its encoders once in a process
// for each path and time of the file. Errors: invalid if there is none, with the package to install
// and the alternative; internal if it cannot be run.
Result<Ffmpeg> find_ffmpeg(const std::string& search = {});

// Encoders for the videos of a container, the best first. Empty: a ZIP.
std::vector<std::string> encoders_of(Container container);

// The encoder to use. Errors: invalid if the program has none for the container.
Result<std::string> choose_encoder(const Ffmpeg& ffmpeg, Container container);

// Whether a movie can be encoded; a ZIP always can. Errors: those of find_ffmpeg() and
// choose_encoder().
Result<void> check_encoder(Container container);

// Whether pictures of this size are encoded by a server: an encoder holds many in memory, a ZIP
// none. Errors: too_large, above limits::video_pixels_max.
Result<void> check_video_size(Container container, int width, int height);

// Arguments that read raw pictures (rgb24) from standard input, `width` x `height` pixels, both
// even, and write the container to descriptor 3. RGB becomes Y'CbCr by ITU-R BT.709, limited range,
// and the file says so; the transfer function is that of sRGB (IEC 61966-2-1), as of the pictures.
std::vector<std::string> arguments_of(const Options& options, const std::string& encoder, int width,
                                      int height);

}  // namespace windsplat::movie
