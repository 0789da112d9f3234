// Bytes of a connection -> requests. The header is read completely and checked as bytes before it
// is parsed.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstddef>
#include <optional>

#include "server/http/exchange.hpp"
#include "server/transport/stream.hpp"

namespace windsplat::transport {

class RequestParser {
 public:
  using Parser = beast::http::request_parser<beast::http::string_body>;

  void begin();  // prepares for the next request; received bytes are kept
  [[nodiscard]] Parser& parser() { return *parser_; }
  [[nodiscard]] const Parser& parser() const { return *parser_; }
  [[nodiscard]] beast::flat_buffer& buffer() { return buffer_; }
  [[nodiscard]] bool has_input() const { return buffer_.size() > 0; }
  // Space for the next read.
  asio::mutable_buffer prepare();
  // Space for bytes that are discarded; discards what was received.
  asio::mutable_buffer prepare_discarded();

  struct Header {
    bool complete = false;
    std::optional<http::Response> refusal;
  };
  // Parses the header if it has arrived.
  Header parse_header();
  // Method and fields of the parsed header.
  void copy_header(http::Request& request) const;

  // Whether the error is in the text of the request rather than in the connection; and the response
  // to it.
  static bool is_fault_of_text(ErrorCode fault);
  static http::Response refusal_of(ErrorCode fault);

 private:
  static constexpr std::size_t buffer_bytes_max = std::size_t{16} * 1024;

  beast::flat_buffer buffer_{buffer_bytes_max};
  std::size_t searched_ = 0;  // bytes of buffer_ already searched for the end of the header
  std::optional<Parser> parser_;
};

}  // namespace windsplat::transport
