#include "server/http/gzip.hpp"

#include <zlib.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "protocol/limits.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"

namespace windsplat::http {
namespace {

constexpr std::size_t compressed_from_bytes = 1024;  // smaller ones fit into a packet
constexpr int gzip_window = 15 + 16;                 // zlib: the largest window, with a gzip header

bool is_text(std::string_view content_type) {
  const std::string_view type = split_list(content_type, ';')[0];
  return type.starts_with("text/") || type == "application/json" ||
         (type.starts_with("application/") && type.ends_with("+json")) || type == "image/svg+xml";
}

std::string coding_of(const Request& request) { return request.header("Content-Encoding"); }

bool is_gzip(std::string_view coding) {
  return equal_without_case(coding, "gzip") || equal_without_case(coding, "x-gzip");
}

Response unsupported_coding(std::string detail) {
  Response response = problem_response(415, "Unsupported Media Type", std::move(detail));
  response.headers.emplace_back("Accept-Encoding", "gzip");
  return response;
}

std::vector<std::uint8_t> gzipped(std::span<const std::uint8_t> bytes) {
  constexpr int memory_level = 8;
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, gzip_window, memory_level,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    return {};
  }
  std::vector<std::uint8_t> out(deflateBound(&stream, bytes.size()));
  stream.next_in = const_cast<Bytef*>(bytes.data());  // not written (zlib.h)
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int ended = deflate(&stream, Z_FINISH);
  out.resize(ended == Z_STREAM_END ? stream.total_out : 0);
  deflateEnd(&stream);
  return out;
}

}  // namespace

bool is_compressible(const Response& response) {
  constexpr std::size_t bytes_max = std::size_t{1} << 30;  // zlib counts in 32 bits
  const std::size_t size = response.body.bytes.size();
  return size >= compressed_from_bytes && size < bytes_max && is_text(response.content_type) &&
         std::none_of(response.headers.begin(), response.headers.end(), [](const auto& header) {
           return equal_without_case(header.first, "Content-Encoding");
         });
}

void compress(Response& response) {
  std::vector<std::uint8_t> bytes = gzipped(response.body.bytes);
  if (bytes.empty() || bytes.size() >= response.body.bytes.size()) return;
  response.body = Body::of(std::move(bytes));
  for (auto& [name, value] : response.headers) {
    if (equal_without_case(name, "ETag")) value = gzip_etag(value);
  }
  response.headers.emplace_back("Content-Encoding", "gzip");
}

std::string gzip_etag(std::string_view etag) {
  std::string tag(etag);
  if (tag.size() > 1 && tag.back() == '"') tag.insert(tag.size() - 1, "-gzip");
  return tag;
}

std::optional<std::string> known_etag(std::string_view if_none_match,
                                      std::string_view accept_encoding, std::string_view etag) {
  if (matches_etag(if_none_match, etag)) return std::string(etag);
  std::string zipped = gzip_etag(etag);
  if (!accepts_gzip(accept_encoding) || !matches_etag(if_none_match, zipped)) return std::nullopt;
  return zipped;
}

Result<std::string> ungzip(std::string_view bytes, std::size_t bytes_max) {
  z_stream stream{};
  if (inflateInit2(&stream, gzip_window) != Z_OK) {
    return make_error(ErrorKind::out_of_memory, "no memory left");
  }
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string out;
  int state = Z_OK;
  while (state == Z_OK && out.size() <= bytes_max) {
    constexpr std::size_t chunk = 16384;
    const std::size_t size = out.size();
    out.resize(size + chunk);
    stream.next_out = reinterpret_cast<Bytef*>(out.data() + size);
    stream.avail_out = chunk;
    state = inflate(&stream, Z_NO_FLUSH);
    out.resize(size + chunk - stream.avail_out);
  }
  const bool rest = stream.avail_in > 0;
  inflateEnd(&stream);
  if (state != Z_OK && state != Z_STREAM_END) {
    return make_error(ErrorKind::malformed, "the body is not gzip, or is damaged or cut short");
  }
  if (out.size() > bytes_max) {
    return make_error(ErrorKind::too_large,
                      "the body is larger than " + std::to_string(bytes_max) + " bytes unpacked");
  }
  if (rest) return make_error(ErrorKind::malformed, "bytes follow the end of the gzip body");
  return out;
}

std::optional<Response> check_coding(const Request& request) {
  const std::string coding = coding_of(request);
  if (coding.empty() || equal_without_case(coding, "identity") || is_gzip(coding)) {
    return std::nullopt;
  }
  return unsupported_coding("the Content-Encoding " + printable(coding, 40) +
                            " is not supported: use gzip or none");
}

std::optional<Response> decode_body(Request& request) {
  if (request.body.empty() || !is_gzip(coding_of(request))) return std::nullopt;
  auto body = ungzip(request.body, protocol::limits::http_body_bytes_max);
  if (body) {
    request.body = std::move(*body);
    return std::nullopt;
  }
  if (body.error().kind != ErrorKind::malformed) return problem_response(body.error());
  return unsupported_coding("Content-Encoding is " + printable(coding_of(request), 40) + ", but " +
                            body.error().message);
}

}  // namespace windsplat::http
