// Serves the embedded page: gzip as embedded, or inflated for clients that do not accept gzip.
#include <map>
#include <mutex>
#include <utility>

#include "server/api/resources.hpp"
#include "server/api/web_assets.hpp"
#include "server/base/check.hpp"
#include "server/http/framing.hpp"
#include "server/http/gzip.hpp"
#include "server/http/negotiate.hpp"

namespace windsplat::api {
namespace {

constexpr const char* page_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "font-src 'self'; connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action "
    "'none'; ";
constexpr std::size_t file_bytes_max = std::size_t{64} << 20;
constexpr const char* immutable_policy = "public, max-age=31536000, immutable";

// Other sites may show the embedded view only: the whole page could be made to act by clicks that
// its user believes to be on theirs.
std::string policy_for(const std::vector<std::string>& embedders, const http::Request& request) {
  const bool embedded = http::asks_embedded(request);
  return page_policy + http::frame_ancestors(embedded ? embedders : std::vector<std::string>());
}

std::string_view as_text(std::span<const std::uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Cached for each file: a few hundred kilobytes in total.
http::Body inflated_once(const WebAsset& asset) {
  static std::mutex mutex;
  static std::map<std::string, http::Body, std::less<>> made;
  const std::lock_guard lock(mutex);
  const auto known = made.find(asset.path);
  if (known != made.end()) return known->second;
  auto text = http::ungzip(as_text(asset.gzip), file_bytes_max);
  WINDSPLAT_CHECK(text);
  return made.emplace(asset.path, http::Body::of(std::move(*text))).first->second;
}

const WebAsset* find_asset(const std::string& path) {
  for (const WebAsset& asset : web_assets()) {
    if (asset.path == path) return &asset;
  }
  return nullptr;
}

}  // namespace

bool has_page(const std::string& path) { return find_asset(path) != nullptr; }

http::Response get_page(const ServerOptions& options, const std::string& path,
                        const http::Request& request) {
  const WebAsset* asset = find_asset(path);
  WINDSPLAT_CHECK(asset != nullptr);
  const bool gzip = http::accepts_gzip(request.header("Accept-Encoding"));
  std::string etag = etag_of(as_text(asset->gzip));
  // Each representation has its own tag (RFC 9110, 8.8.3.3).
  if (gzip) etag = http::gzip_etag(etag);
  http::Response response;
  response.headers = {{"Cache-Control", asset->immutable ? immutable_policy : "no-cache"},
                      {"ETag", etag},
                      {"Vary", "Accept-Encoding"},
                      // Headers of a 304 replace the cached ones, so the policy is sent with it
                      // too.
                      {"Content-Security-Policy", policy_for(options.embedders, request)},
                      {"Cross-Origin-Opener-Policy", "same-origin"}};
  if (asset->content_type.starts_with("text/html")) {
    response.headers.emplace_back("Link", description_links(options.base_path));
  }
  if (http::matches_etag(request.header("If-None-Match"), etag)) {
    response.status = 304;
    return response;
  }
  response.content_type = asset->content_type;
  if (gzip) {
    response.headers.emplace_back("Content-Encoding", "gzip");
    response.body = {nullptr, asset->gzip};
  } else {
    response.body = inflated_once(*asset);
  }
  return response;
}

}  // namespace windsplat::api
