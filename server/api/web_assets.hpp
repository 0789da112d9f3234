// The page, embedded in the binary: made by web/embed.cmake from web/dist.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace windsplat::api {

struct WebAsset {
  std::string_view path;  // "index.html", "app-1a2b3c4d.js": relative to the base path
  std::string_view content_type;
  std::span<const std::uint8_t> gzip;  // gzip-compressed content
  bool immutable = false;              // its name carries a hash of its content
};

std::span<const WebAsset> web_assets();

}  // namespace windsplat::api
