#include "server/movie/container.hpp"

#include <algorithm>
#include <cctype>

namespace windsplat::movie {

std::string_view name_of(Container container) {
  switch (container) {
    case Container::mp4:
      return "mp4";
    case Container::webm:
      return "webm";
    case Container::zip:
      break;
  }
  return "zip";
}

std::string_view media_type_of(Container container) {
  switch (container) {
    case Container::mp4:
      return "video/mp4";
    case Container::webm:
      return "video/webm";
    case Container::zip:
      break;
  }
  return "application/zip";
}

std::optional<Container> container_of(std::string_view file_name) {
  const std::size_t dot = file_name.find_last_of("./");
  if (dot == std::string_view::npos || file_name[dot] != '.') return std::nullopt;
  std::string ending(file_name.substr(dot + 1));
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Container container : containers) {
    if (ending == name_of(container)) return container;
  }
  return std::nullopt;
}

bool needs_ffmpeg(Container container) { return container != Container::zip; }

}  // namespace windsplat::movie
