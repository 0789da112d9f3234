#include "server/transport/http/request_parser.hpp"

#include <algorithm>
#include <boost/beast/http/error.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "protocol/limits.hpp"
#include "server/http/http_checks.hpp"
#include "server/http/problem.hpp"

namespace windsplat::transport {
namespace {

namespace limits = protocol::limits;

}  // namespace

void RequestParser::begin() {
  parser_.emplace();
  parser_->header_limit(static_cast<std::uint32_t>(limits::http_header_bytes_max));
  parser_->body_limit(boost::none);  // see RequestReader::read_body()
  searched_ = 0;
}

asio::mutable_buffer RequestParser::prepare() {
  return buffer_.prepare(std::min<std::size_t>(4096, buffer_bytes_max - buffer_.size()));
}

asio::mutable_buffer RequestParser::prepare_discarded() {
  buffer_.clear();
  return buffer_.prepare(buffer_bytes_max);
}

RequestParser::Header RequestParser::parse_header() {
  const auto data = buffer_.cdata();
  const std::string_view text(static_cast<const char*>(data.data()), data.size());
  const std::size_t end = text.find("\r\n\r\n", searched_);
  const std::size_t length = end == std::string_view::npos ? text.size() : end + 4;
  if (length > limits::http_header_bytes_max) {
    return {true,
            http::problem_response(431, "Request Header Fields Too Large",
                                   "a request's header may have " +
                                       std::to_string(limits::http_header_bytes_max) + " bytes")};
  }
  if (end == std::string_view::npos) {
    searched_ = text.size() < 3 ? 0 : text.size() - 3;
    return {};
  }
  if (auto fault = http::check_header_bytes(text.substr(0, length)))
    return {true, std::move(fault)};
  ErrorCode fault;
  buffer_.consume(parser_->put(buffer_.data(), fault));
  if (fault || !parser_->is_header_done()) return {true, refusal_of(fault)};
  return {true, std::nullopt};
}

void RequestParser::copy_header(http::Request& request) const {
  const auto& message = parser_->get();
  request.method = std::string(message.method_string());
  for (const auto& field : message) {
    request.headers.emplace_back(field.name_string(), field.value());
  }
}

bool RequestParser::is_fault_of_text(ErrorCode fault) {
  return fault.category() == ErrorCode(beast::http::error::end_of_stream).category() &&
         fault != beast::http::error::partial_message;
}

http::Response RequestParser::refusal_of(ErrorCode fault) {
  if (fault == beast::http::error::body_limit) return http::body_too_large();
  if (fault == beast::http::error::header_limit) {
    return http::problem_response(431, "Request Header Fields Too Large", fault.message());
  }
  if (fault == beast::http::error::bad_version) {
    return http::problem_response(505, "HTTP Version Not Supported",
                                  "this server speaks HTTP/1.1 and HTTP/1.0");
  }
  return http::problem_response(400, "Bad Request", "malformed HTTP request: " + fault.message());
}

}  // namespace windsplat::transport
