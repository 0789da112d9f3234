// Content coding of answers and request bodies: gzip (RFC 1952; RFC 9110, 8.4).
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/http/exchange.hpp"

namespace windsplat::http {

// Whether the answer is text that is sent compressed to clients that accept it: JSON, HTML, SVG or
// other text of at least 1 KiB, without a content coding of its own. Other pictures are compressed
// already.
bool is_compressible(const Response& response);

// Replaces the body by its gzip form, with Content-Encoding and an ETag of its own; unchanged if
// that is not smaller.
void compress(Response& response);

// The tag of the gzip form of a representation (RFC 9110, 8.8.3.3: each form has its own).
// "abc" -> "abc-gzip", both in quotes.
std::string gzip_etag(std::string_view etag);

// The tag that a 304 states if the client has the representation: that of its form, plain or gzip.
std::optional<std::string> known_etag(std::string_view if_none_match,
                                      std::string_view accept_encoding, std::string_view etag);

// Decodes one gzip member of at most `bytes_max` bytes. Errors: malformed: not gzip, damaged, cut
// short or with bytes behind its end; too_large.
Result<std::string> ungzip(std::string_view bytes, std::size_t bytes_max);

// The refusal of a request whose Content-Encoding is not understood: 415, with Accept-Encoding
// (RFC 9110, 15.5.16).
std::optional<Response> check_coding(const Request& request);

// Decodes the body of a request that has passed check_coding(). A body that is no gzip although its
// header says so gets 415, one that is too large 413.
std::optional<Response> decode_body(Request& request);

}  // namespace windsplat::http
