#include "server/transport/http/packed_reply.hpp"

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "server/http/cors.hpp"
#include "server/http/gzip.hpp"
#include "server/http/negotiate.hpp"

namespace windsplat::transport {
namespace {

// Compressed at once up to this size, in about a millisecond.
constexpr std::size_t at_once_bytes_max = std::size_t{32} * 1024;

}  // namespace

http::Reply packed_reply(tasks::TaskExecutor& packing, const http::Request& request,
                         http::Reply reply) {
  const bool accepted = http::accepts_gzip(request.header("Accept-Encoding"));
  return [&packing, accepted, reply = std::move(reply), cancel = request.cancel,
          address = request.address](http::Response response) {
    if (!http::is_compressible(response)) return reply(std::move(response));
    http::add_vary(response, "Accept-Encoding");
    if (!accepted) return reply(std::move(response));
    if (response.body.bytes.size() <= at_once_bytes_max) {
      http::compress(response);
      return reply(std::move(response));
    }
    const auto held = std::make_shared<http::Response>(std::move(response));
    const auto pack = [held, reply] {
      http::compress(*held);
      reply(std::move(*held));
    };
    if (!packing.submit({cancel, pack, false, nullptr, address})) reply(std::move(*held));
  };
}

}  // namespace windsplat::transport
