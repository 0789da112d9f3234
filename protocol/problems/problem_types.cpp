#include "protocol/problems/problem_types.hpp"

#include <algorithm>
#include <array>

namespace windsplat::protocol {
namespace {

constexpr std::string_view folder = "problems/";

constexpr std::array<ProblemType, 27> table{{
    {"malformed", 400, "Bad Request",
     "The request cannot be parsed: broken JSON, an invalid query or header. Correct it; sending "
     "it again does not help."},
    {"unauthorized", 401, "Unauthorized",
     "The server requires a token, or the one that was sent is wrong. Send Authorization: Bearer "
     "TOKEN."},
    {"forbidden", 403, "Forbidden",
     "The server does not permit this: a page of an origin that is not allowed, a file outside "
     "of what may be opened, or a dataset that may not be removed. The detail names the option "
     "that would permit it, if there is one."},
    {"not-found", 404, "Not Found",
     "There is no such path, dataset, view, job or picture, or it was removed in the meantime."},
    {"method-not-allowed", 405, "Method Not Allowed",
     "The resource has other methods. The header Allow lists them."},
    {"not-acceptable", 406, "Not Acceptable",
     "The resource has no form that the header Accept permits."},
    {"not-in-memory", 409, "Conflict",
     "The answer needs data that are not in memory. Ask for a picture or description that loads "
     "them, and try again after Retry-After."},
    {"conflict", 409, "Conflict",
     "What would be made exists already, such as an upload of that id. Remove it, or choose "
     "another "
     "name."},
    {"length-required", 411, "Length Required",
     "A request with a body must have Content-Length. Chunked bodies are not supported."},
    {"precondition-failed", 412, "Precondition Failed",
     "The resource has changed since it was read, so that If-Match or If-None-Match does not "
     "hold. Read it again, and repeat the change on what it is now."},
    {"too-large", 413, "Content Too Large",
     "The body, the picture or the work that the request asks for exceeds a limit. The detail "
     "names the limit."},
    {"unsupported-media-type", 415, "Unsupported Media Type",
     "The resource does not take bodies of this Content-Type or Content-Encoding, or the body is "
     "no gzip although its header says so."},
    {"expectation-failed", 417, "Expectation Failed",
     "The header Expect asks for something other than 100-continue."},
    {"unknown-host", 421, "Misdirected Request",
     "The header Host names a host that this server does not know. Its operator allows names by "
     "--allow-host."},
    {"invalid-value", 422, "Unprocessable Content",
     "The document or query can be parsed, but a value is unknown, out of its range or at odds "
     "with another. Of a document, each entry of errors has the JSON pointer of a value and what "
     "is wrong with it."},
    {"unreadable-data", 422, "Unprocessable Content",
     "A file is damaged, or in a form that is not supported. The detail names it."},
    {"upgrade-required", 426, "Upgrade Required",
     "The resource is a WebSocket of version 13. Send an upgrade request."},
    {"rate-limited", 429, "Too Many Requests",
     "This address has used up one of its limits. The detail names the limit; try again after "
     "Retry-After. RateLimit tells what is left."},
    {"busy", 429, "Too Many Requests",
     "Too many requests wait for the same resource. Try again after Retry-After."},
    {"header-too-large", 431, "Request Header Fields Too Large",
     "The request line and headers together exceed their limit."},
    {"cancelled", 499, "Client Closed Request",
     "The request was cancelled before it was done, by the client or because the server ended it."},
    {"internal-error", 500, "Internal Server Error",
     "A fault of the server. Its log has more under the request's id."},
    {"not-implemented", 501, "Not Implemented",
     "The method is unknown, or the request uses a transfer coding, which is not supported."},
    {"overloaded", 503, "Service Unavailable",
     "The server has as many connections or sessions as it may have. Try again after Retry-After."},
    {"shutting-down", 503, "Service Unavailable",
     "The server is shutting down and takes no more work. Try again when it has been started "
     "anew."},
    {"http-version", 505, "HTTP Version Not Supported",
     "The request has another version than HTTP/1.1 or HTTP/1.0."},
    {"out-of-memory", 507, "Insufficient Storage",
     "There is not enough memory below --memory-limit, no space on the disk, or no room left for "
     "uploads. Choose a smaller region, a coarser resolution or fewer fields, or free space."},
}};

}  // namespace

std::span<const ProblemType> problem_types() { return table; }

const ProblemType* find_problem_type(std::string_view slug) {
  const auto* const found = std::find_if(
      table.begin(), table.end(), [&](const ProblemType& type) { return type.slug == slug; });
  return found == table.end() ? nullptr : found;
}

const ProblemType* problem_type_of_status(int status) {
  const auto* const found = std::find_if(
      table.begin(), table.end(), [&](const ProblemType& type) { return type.status == status; });
  return found == table.end() ? nullptr : found;
}

const ProblemType& problem_type_of(ErrorKind kind) {
  const auto slug = [kind]() -> std::string_view {
    switch (kind) {
      case ErrorKind::malformed:
        return "malformed";
      case ErrorKind::invalid:
        return "invalid-value";
      case ErrorKind::not_found:
        return "not-found";
      case ErrorKind::bad_data:
        return "unreadable-data";
      case ErrorKind::too_large:
        return "too-large";
      case ErrorKind::not_resident:
        return "not-in-memory";
      case ErrorKind::conflict:
        return "conflict";
      case ErrorKind::busy:
        return "busy";
      case ErrorKind::draining:
        return "shutting-down";
      case ErrorKind::out_of_memory:
        return "out-of-memory";
      case ErrorKind::cancelled:
        return "cancelled";
      case ErrorKind::internal:
        break;
    }
    return "internal-error";
  };
  return *find_problem_type(slug());
}

std::string problem_reference(const ProblemType& type) {
  return std::string(folder) + std::string(type.slug);
}

std::string resolved_type(const std::string& base_path, const std::string& type) {
  return type.starts_with(folder) ? base_path + type : type;
}

// Quotes within strings are escaped, so the key is found as it is written.
std::string resolved_problem(const std::string& base_path, std::string_view problem_json) {
  std::string json(problem_json);
  const std::string key = "\"type\":\"";
  const std::size_t at = json.find(key + std::string(folder));
  if (at != std::string::npos) json.insert(at + key.size(), base_path);
  return json;
}

}  // namespace windsplat::protocol
