#include "server/transport/http/response_writer.hpp"

#include <array>
#include <boost/asio/write.hpp>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>

#include "protocol/limits.hpp"
#include "server/base/log.hpp"
#include "server/http/cors.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"
#include "server/http/rate_limit.hpp"
#include "server/transport/http/http_session.hpp"

namespace windsplat::transport {
namespace {

namespace limits = protocol::limits;
using Clock = std::chrono::steady_clock;

constexpr const char* hsts = "max-age=15552000";  // 180 days; sent over TLS only

std::int64_t micros_since(Clock::time_point since) {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - since).count();
}

}  // namespace

ResponseWriter::ResponseWriter(HttpOwner& owner, HttpWire& wire, const HttpContext& context,
                               CurrentRequest& current)
    : owner_(owner), wire_(wire), context_(context), current_(current) {}

void ResponseWriter::send(http::Response response) {
  const http::Request& request = current_.request;
  current_.keep_alive =
      current_.keep_alive && !response.close && !context_.draining && !wire_.is_of_reserve();
  http::name_request(response, request.id, context_.options.base_path);
  if (current_.charged) {
    http::add_rate_limits(
        response, context_.admission.left(request.address, context_.router.names_health(request)));
  }
  // When to ask for the state of a job: most take less than a second.
  if (response.status == 202) response.headers.emplace_back("Retry-After", "1");
  http::share_with_origins(response, request, context_.options.allow_origins);
  // Applies to every port of the host, and other programs listen on this machine's loopback.
  if (const std::string host = request.header("Host");
      wire_.secure() && !host.empty() && !http::names_loopback(host)) {
    response.headers.emplace_back("Strict-Transport-Security", hsts);
  }
  context_.metrics.answered(current_.route, response.status);
  response_ = std::move(response);
  head_ = http::response_head(response_, current_.keep_alive);
  const auto body = current_.is_head ? std::span<const std::uint8_t>{} : response_.body.bytes;
  wire_.within(write_deadline(body.size(), limits::write_timeout_s));
  sending_ = true;
  const std::array<asio::const_buffer, 2> parts{asio::buffer(head_),
                                                asio::buffer(body.data(), body.size())};
  asio::async_write(
      wire_.wire(), parts,
      owner_.handler([this, written_since = Clock::now()](ErrorCode fault, std::size_t bytes) {
        sending_ = false;
        on_sent(bytes, written_since);
        response_ = http::Response{};
        owner_.on_written(fault);
      }));
}

void ResponseWriter::send_nothing() {
  constexpr int client_has_gone = 499;
  context_.metrics.answered(current_.route, client_has_gone);
  log_access(client_has_gone, 0);
}

void ResponseWriter::on_sent(std::size_t bytes, Clock::time_point since) {
  context_.metrics.bytes_sent(metrics::Metrics::Over::http, bytes);
  context_.admission.sent(current_.request.address, bytes);
  if (response_.content_type.starts_with("image/")) {
    context_.metrics.stage_took(metrics::Metrics::Stage::write, micros_since(since));
  }
  log_access(response_.status, bytes);
}

// Log neither path nor query: they may contain private data.
void ResponseWriter::log_access(int status, std::size_t bytes) const {
  if (current_.quiet) return;
  const std::string_view route = current_.route;
  const bool often = route == "/livez" || route == "/readyz" || route == "/metrics" ||
                     route == api::route_page || route == api::route_preflight;
  log::write(often ? log::Level::debug : log::Level::info, "request",
             {{"request", current_.request.id},
              {"method", current_.request.method},
              {"route", route},
              {"client", current_.request.address},
              {"status", status},
              {"bytes", bytes},
              {"ms", static_cast<double>(micros_since(current_.began)) / 1000}});
}

}  // namespace windsplat::transport
