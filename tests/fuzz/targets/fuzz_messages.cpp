// A client message -> the codec, a session that acts on it, and the encoded replies.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocol/codec.hpp"
#include "protocol/limits.hpp"
#include "server/session/session.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
using namespace windsplat;
namespace limits = protocol::limits;

constexpr int steps = 5;

session::Options with_video() {
  session::Options options;
  options.video = true;
  return options;
}

// Every request of the session gets a result: a frame of one byte, or an unknown dataset.
class Viewer {
 public:
  Viewer()
      : session_(with_video(),
                 {[](const protocol::View& view) -> Result<int> {
                    if (view.dataset.empty() || view.dataset == "none") {
                      return make_error_at(ErrorKind::not_found, "/dataset", "does not exist");
                    }
                    return steps;
                  },
                  {},
                  {}},
                 now_) {}

  void hear(std::string_view text) {
    now_ += 1000;
    const auto message = protocol::parse_client_message(text);
    const protocol::MessageTag tag = protocol::message_tag(text);
    if (message) {
      carry_out(session_.on_message(*message, now_));
      return;
    }
    expect(!message.error().message.empty(), "a refusal has a reason");
    expect(message.error().at.size() <= limits::problem_errors_max,
           "a refusal has a limited number of pointers");
    const std::size_t told = texts_;
    carry_out(session_.on_refused(message.error(), tag, now_));
    expect(texts_ > told || closed_, "an invalid message gets a response");
  }

  void pass_time() {
    for (int i = 0; i < 8 && !closed_; ++i) {
      const auto wake = session_.wake_at();
      if (!wake) return;
      now_ = std::max(now_, *wake);
      carry_out(session_.on_time(now_));
    }
  }

 private:
  void carry_out(const session::Effects& effects) {
    for (const session::Effect& effect : effects) {
      expect(!closed_, "there are no effects after a close");
      std::visit([this](const auto& body) { act(body); }, effect);
    }
    answer();
  }

  void act(const session::SendText& effect) {
    const std::string text = protocol::encode(effect.message);
    expect(text.size() >= 2 && text.front() == '{' && text.back() == '}', "a message is an object",
           text);
    ++texts_;
  }
  void act(const session::SendFrame& effect) {
    const auto header = protocol::encode_frame_header(effect.header);
    expect(protocol::parse_frame_header(header).has_value(), "a frame's header can be read");
    written_ = true;
  }
  void act(const session::StartRender& effect) {
    expect(effect.view.step >= 0 && effect.view.step < steps, "the drawn step exists");
    expect(std::int64_t{effect.view.image.width} * effect.view.image.height <=
               limits::image_pixels_max,
           "no picture is larger than the limit");
    render_ = effect;
  }
  void act(const session::Describe& effect) { described_ = effect; }
  void act(const session::Close& /*effect*/) { closed_ = true; }
  void act(const session::CancelRender& effect) {
    if (render_ && render_->ticket == effect.ticket) cancelled_ = true;
  }
  template <class Other>
  void act(const Other& /*effect*/) {}

  // One effect at a time, since each causes further ones.
  void answer() {
    if (closed_ || answering_) return;
    answering_ = true;
    for (int i = 0; i < 16 && !closed_; ++i) {
      now_ += 500;
      if (written_) {
        written_ = false;
        carry_out(session_.on_written(now_));
      } else if (described_) {
        const auto what = *described_;
        described_.reset();
        protocol::DatasetDescription description;
        description.id = what.dataset;
        carry_out(session_.on_described(what.id, description, now_));
      } else if (render_) {
        const auto what = *render_;
        render_.reset();
        carry_out(session_.on_rendered(what.ticket, drawn(what), now_));
        cancelled_ = false;
      }
    }
    answering_ = false;
  }

  [[nodiscard]] Result<session::Drawn> drawn(const session::StartRender& what) const {
    if (cancelled_) return make_error(ErrorKind::cancelled, "cancelled");
    session::Drawn out;
    out.video = what.encoding.codec == protocol::Codec::h264;
    out.payload = std::make_shared<const std::vector<std::uint8_t>>(1);
    out.view_json = protocol::encode_view(what.view);
    return out;
  }

  session::Micros now_ = 1'000'000;
  session::Session session_;
  std::optional<session::StartRender> render_;
  std::optional<session::Describe> described_;
  std::size_t texts_ = 0;
  bool written_ = false;
  bool cancelled_ = false;
  bool closed_ = false;
  bool answering_ = false;
};

}  // namespace

// One message per line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest = fuzz::text_of(data, size);
  Viewer viewer;
  for (int i = 0; i < 32; ++i) {
    const std::size_t end = rest.find('\n');
    viewer.hear(rest.substr(0, end));
    if (end == std::string_view::npos) break;
    rest.remove_prefix(end + 1);
    viewer.pass_time();
  }
  viewer.pass_time();
  return 0;
}
