// Serves the embedded page: gzip as embedded, or inflated for clients that do not accept gzip.
#include <boost/beast/core/buffers_range.hpp>
#include <boost/beast/zlib/inflate_stream.hpp>
#include <map>
#include <mutex>

#include "server/api/resources.hpp"
#include "server/api/web_assets.hpp"
#include "server/base/check.hpp"
#include "server/http/framing.hpp"
#include "server/http/negotiate.hpp"

namespace windsplat::api {
namespace {

constexpr const char* page_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
    "font-src 'self'; connect-src 'self'; manifest-src 'self'; base-uri 'none'; form-action "
    "'none'; ";
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

// Offset of the deflated data (RFC 1952, 2.3).
std::size_t gzip_header_bytes(std::span<const std::uint8_t> gzip) {
  constexpr std::size_t fixed = 10;
  WINDSPLAT_CHECK(gzip.size() > fixed && gzip[0] == 0x1f && gzip[1] == 0x8b);
  const unsigned flags = gzip[3];
  std::size_t at = fixed;
  if ((flags & 4U) != 0) at += 2U + gzip[at] + 256U * gzip[at + 1];
  for (const unsigned text : {8U, 16U}) {  // the name, then a comment
    if ((flags & text) == 0) continue;
    while (at < gzip.size() && gzip[at] != 0) ++at;
    ++at;
  }
  if ((flags & 2U) != 0) at += 2;
  WINDSPLAT_CHECK(at < gzip.size());
  return at;
}

std::string inflated(std::span<const std::uint8_t> gzip) {
  namespace zlib = boost::beast::zlib;
  zlib::inflate_stream stream;
  zlib::z_params params;
  const std::size_t start = gzip_header_bytes(gzip);
  params.next_in = gzip.data() + start;
  params.avail_in = gzip.size() - start;
  std::string out;
  boost::system::error_code fault;
  while (!fault) {
    constexpr std::size_t chunk = 65536;
    const std::size_t size = out.size();
    out.resize(size + chunk);
    params.next_out = out.data() + size;
    params.avail_out = chunk;
    stream.write(params, zlib::Flush::sync, fault);
    out.resize(size + chunk - params.avail_out);
    if (params.avail_in == 0 && params.avail_out > 0) break;
  }
  WINDSPLAT_CHECK(!fault || fault == zlib::error::end_of_stream);
  return out;
}

// Cached for each file: a few hundred kilobytes in total.
http::Body inflated_once(const WebAsset& asset) {
  static std::mutex mutex;
  static std::map<std::string, http::Body, std::less<>> made;
  const std::lock_guard lock(mutex);
  const auto known = made.find(asset.path);
  if (known != made.end()) return known->second;
  return made.emplace(asset.path, http::Body::of(inflated(asset.gzip))).first->second;
}

const WebAsset* find_asset(const std::string& path) {
  for (const WebAsset& asset : web_assets()) {
    if (asset.path == path) return &asset;
  }
  return nullptr;
}

}  // namespace

bool has_page(const std::string& path) { return find_asset(path) != nullptr; }

http::Response get_page(const std::vector<std::string>& embedders, const std::string& path,
                        const http::Request& request) {
  const WebAsset* asset = find_asset(path);
  WINDSPLAT_CHECK(asset != nullptr);
  const bool gzip = http::accepts_gzip(request.header("Accept-Encoding"));
  std::string etag = etag_of(as_text(asset->gzip));
  // Each representation has its own tag (RFC 9110, 8.8.3.3).
  if (gzip) etag.insert(etag.size() - 1, "-gzip");
  http::Response response;
  response.headers = {{"Cache-Control", asset->immutable ? immutable_policy : "no-cache"},
                      {"ETag", etag},
                      {"Vary", "Accept-Encoding"},
                      // Headers of a 304 replace the cached ones, so the policy is sent with it
                      // too.
                      {"Content-Security-Policy", policy_for(embedders, request)},
                      {"Cross-Origin-Opener-Policy", "same-origin"}};
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
