// Effects of a session -> render jobs; what they bring -> the session's own words.
#include "server/net/viewer.hpp"

#include <exception>
#include <new>
#include <utility>

#include "protocol/codec.hpp"
#include "server/base/log.hpp"
#include "server/frame/frame_info.hpp"

namespace windsplat::net {
namespace {

frame::Encoding frame_encoding(const session::Encoding& wanted) {
  frame::Encoding encoding;
  const bool png = wanted.codec == protocol::Codec::png;
  encoding.format = png ? frame::Format::png : frame::Format::jpeg;
  encoding.quality = wanted.quality;
  encoding.subsampling = wanted.full_chroma ? image::Subsampling::s444 : image::Subsampling::s420;
  encoding.level = wanted.level;
  return encoding;
}

Error nobody_waits() { return make_error(ErrorKind::cancelled, "nobody waits for the answer"); }

// What the next frame of the same data need not do again.
std::uint64_t preparations(const data::Dataset& dataset) {
  return dataset.loads() + dataset.averages();
}

Result<session::Drawn> draw(Services& services, const session::StartRender& wanted,
                            std::int64_t queue_us, const CancelToken& cancel) {
  const auto dataset = services.catalogue.find(wanted.view.dataset);
  if (!dataset) return dataset.error();
  const std::uint64_t before = preparations(**dataset);
  auto drawn = frame::produce(wanted.view, **dataset, frame_encoding(wanted.encoding),
                              *services.pool, cancel, services.frames);
  if (!drawn) return drawn.error();
  session::Drawn out;
  out.info = frame::frame_info(*drawn, drawn->view);
  out.view_json = protocol::encode_view(drawn->view);
  out.payload = std::make_shared<const std::vector<std::uint8_t>>(std::move(drawn->bytes));
  out.queue_us = queue_us;
  out.render_us = drawn->render_us;
  out.encode_us = drawn->encode_us;
  // Nobody else loads while the renderer's thread is here.
  out.loaded = preparations(**dataset) != before;
  return out;
}

// No exception leaves the renderer's thread.
template <class T, class Make>
Result<T> attempt(const CancelToken& cancel, const Make& make) {
  if (cancel.cancelled()) return nobody_waits();
  try {
    return make();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "there is no memory left for this");
  } catch (const std::exception& fault) {
    log::error("a render job failed", {{"fault", fault.what()}});
    return make_error(ErrorKind::internal, "the server failed at this");
  }
}

}  // namespace

void Viewer::start(const session::StartRender& effect, DrawnReply reply) {
  const CancelToken cancel;
  running_.emplace(effect.ticket, cancel);
  // Jobs of streams are never refused.
  (void)services_.renderer.submit(
      {RenderService::Kind::stream, owner_, cancel,
       [&services = services_, effect, cancel, reply = std::move(reply)](std::int64_t queue_us) {
         reply(effect.ticket, attempt<session::Drawn>(cancel, [&] {
                 return draw(services, effect, queue_us, cancel);
               }));
       }});
}

void Viewer::start(const session::Describe& effect, DescribedReply reply) {
  (void)services_.renderer.submit(
      {RenderService::Kind::stream, owner_, gone_,
       [&services = services_, effect, cancel = gone_,
        reply = std::move(reply)](std::int64_t /*queue_us*/) {
         reply(effect.id, attempt<protocol::DatasetDescription>(
                              cancel, [&] { return services.catalogue.describe(effect.dataset); }));
       }});
}

void Viewer::cancel(std::uint64_t ticket) {
  if (const auto found = running_.find(ticket); found != running_.end()) found->second.cancel();
}

void Viewer::cancel_all() {
  gone_.cancel();
  for (const auto& [ticket, token] : running_) token.cancel();
}

}  // namespace windsplat::net
