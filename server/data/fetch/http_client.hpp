// GET requests to permitted hosts by libcurl: URL -> status, validators and bytes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/fetch/host_rules.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data::fetch {

// What identifies a state of a file on its host (RFC 9110, 8.8); empty: not given.
struct Validators {
  std::string etag;
  std::string last_modified;
};

// The key of an S3 service, from the AWS_ variables of the environment.
struct S3Key {
  std::string id;  // empty: requests are not signed
  std::string secret;
  std::string session_token;
  std::string region = "us-east-1";
};

// Limits of one request.
struct RequestLimits {
  std::uint64_t bytes_max = 0;  // of a body
  std::string_view bytes_name = "--max-download";
  std::chrono::milliseconds time{600'000};  // in total, with redirects
  std::chrono::milliseconds connect_time{10'000};
  std::chrono::seconds stall_time{15};  // below stall_bytes_per_second for so long
};
inline constexpr long stall_bytes_per_second = 1024;
inline constexpr std::size_t header_bytes_max = std::size_t{64} << 10;
inline constexpr int redirects_max = 5;
inline constexpr int resumptions_max = 3;

// Some bytes of a file, at least one.
struct ByteRange {
  std::uint64_t first = 0;
  std::uint64_t count = 0;
};

struct Request {
  Url url;                        // https or http
  std::string query;              // percent-encoded, sorted by name; empty: none
  Validators known;               // the body is sent only if it differs from this state
  std::uint64_t known_bytes = 0;  // of the file in this state
  // Asks for these bytes, as many as the file has. A host may send the whole file instead; it does
  // so, too, if it gives no strong ETag.
  std::optional<ByteRange> range;
  // The strong ETag and the size of the file whose bytes are asked for; those of any other state
  // are not received (Response::is_other_part). Empty: the state is not known yet.
  std::string state;
  std::uint64_t state_bytes = 0;
  RequestLimits limits;
  const S3Key* key =
      nullptr;  // signs the request (AWS Signature Version 4), which is not redirected
  std::function<bool()> cancelled;  // asked at least once a second; empty: never
};

struct Response {
  bool is_unchanged = false;  // the state is that of `known`; there was no body
  Validators validators;
  bool is_other_part = false;    // not the bytes of `state` that were asked for; some may have come
  std::uint64_t file_bytes = 0;  // only `range` of a file of this size was sent; 0: the whole file
};

// One connection at a time, kept for the next request to the same host. Not thread-safe.
class HttpClient {
 public:
  // `authorities`: file of certificates (PEM) to trust; empty: those of the system.
  HttpClient(std::shared_ptr<const HostRules> rules, std::string authorities);
  ~HttpClient();
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  // Takes the bytes of the body in order. False: they cannot be stored; the request ends.
  using Sink = std::function<bool(std::string_view bytes)>;

  // Parts of files follow RFC 9110, 13.1.5 and 14. The rest of a body whose connection ends early
  // is asked for by its ETag. A host that gives a Last-Modified only is asked without a condition,
  // and its body is not received if date and size are the known ones: If-Modified-Since would take
  // an older file for the same. Redirects are followed to permitted hosts, from https only to
  // https. Certificates are always verified; proxies, cookies, netrc files and compressed bodies
  // are not used. Errors: not_found for 404 and 410; too_large; cancelled; invalid for a host or
  // address that is not permitted; bad_data for everything else. Messages name the URL without
  // query.
  Result<Response> get(const Request& request, const Sink& sink);

 private:
  struct Handle;
  Result<void> redirect(Request& request, long status, std::string_view next) const;
  std::shared_ptr<const HostRules> rules_;
  std::string authorities_;
  std::unique_ptr<Handle> handle_;
};

}  // namespace windsplat::data::fetch
