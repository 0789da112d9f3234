// The kinds of movie files, by the ending of a name.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/animation/animation.hpp"

namespace windsplat::movie {

using Container = protocol::AnimationFormat;
inline constexpr std::array containers{Container::mp4, Container::webm, Container::zip};

std::string_view name_of(Container container);        // "mp4"
std::string_view media_type_of(Container container);  // "video/mp4"

// By the last ending of a file name, in letters of either case. Empty: not that of a movie.
std::optional<Container> container_of(std::string_view file_name);

// Whether the pictures are encoded by the program ffmpeg.
bool needs_ffmpeg(Container container);

}  // namespace windsplat::movie
