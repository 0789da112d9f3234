// A script of client messages and events with their times -> the effects of the session, as text.
// Part of scripts/fingerprint. Usage: session_transcript SCRIPT
//  A line of the script is one JSON object: {"at": MS, "say": MESSAGE} for a client message, or
//  {"at": MS, "event": "describe" | "fail" | "drain" | "change" | "binary" | "wait"}, where "fail"
//  makes the next render fail and "wait" lets time pass. A render takes 12 ms and a frame is
//  acknowledged 8 ms after it was sent. The dataset "wind" has ten steps.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/codec.hpp"
#include "server/quality/table.hpp"
#include "server/session/session.hpp"

namespace {

using windsplat::Error;
using windsplat::ErrorKind;
using windsplat::make_error;
using windsplat::make_error_at;
using windsplat::Result;
using namespace windsplat::session;  // NOLINT(google-build-using-namespace)
namespace protocol = windsplat::protocol;
namespace quality = windsplat::quality;
using Json = nlohmann::json;

constexpr int step_count = 10;
constexpr Micros render_us = 12'000;
constexpr Micros acknowledged_after_us = 8'000;

Result<int> check(const protocol::View& view) {
  if (view.dataset != "wind") {
    return make_error_at(ErrorKind::not_found, "/dataset", "unknown dataset");
  }
  if (view.step >= step_count) return make_error_at(ErrorKind::invalid, "/step", "out of range");
  return step_count;
}

std::string text_of(const quality::Setting& setting) {
  return std::string(setting.method == protocol::MethodName::kernel ? "kernel" : "slab") +
         " half-level " + std::to_string(setting.half_level) + " coarser " +
         std::to_string(setting.coarser) + " thinner " + std::to_string(setting.thinner);
}

std::string text_of(const Encoding& encoding) {
  return std::string(encoding.codec == protocol::Codec::jpeg ? "jpeg" : "png") + " quality " +
         std::to_string(encoding.quality) + (encoding.full_chroma ? " 4:4:4" : " 4:2:0") +
         (encoding.measure ? " measured" : "");
}

class Transcript {
 public:
  Transcript()
      : session_(
            {},
            {check,
             {},
             [](const quality::SceneSignature& signature, const quality::Viewpoint& viewpoint) {
               return quality::Table(signature.kind).forecasts(viewpoint);
             }},
            now_) {}

  void play(const Json& line) {
    advance(line.at("at").get<Micros>() * 1000);
    if (line.contains("say")) return say(line["say"].dump());
    const std::string event = line.at("event");
    std::cout << now_ / 1000 << " > " << event << '\n';
    if (event == "describe") show(session_.on_described(described_, description(), now_));
    if (event == "fail") fail_next_ = true;
    if (event == "drain") show(session_.on_drain(now_));
    if (event == "change") show(session_.on_changed("wind", now_));
    if (event == "binary") show(session_.on_binary(now_));
  }

 private:
  static protocol::DatasetDescription description() {
    protocol::DatasetDescription wind;
    wind.id = "wind";
    wind.state = "ready";
    wind.dims = {4, 4, 4};
    wind.step_count = step_count;
    return wind;
  }

  // The earliest event: a render ends, an acknowledgement arrives, or the requested call of
  // on_time() is due.
  void advance(Micros end) {
    while (true) {
      const Micros never = end + 1;
      const Micros wake = session_.wake_at().value_or(never);
      const Micros next = std::min({wake, render_end_.value_or(never), ack_at_.value_or(never)});
      if (next > end) break;
      now_ = std::max(now_, next);
      if (render_end_ && *render_end_ <= now_) {
        rendered();
      } else if (ack_at_ && *ack_at_ <= now_) {
        ack_at_.reset();
        show(session_.on_message(protocol::AckMessage{sent_, 1}, now_));
      } else {
        show(session_.on_time(now_));
      }
    }
    now_ = std::max(now_, end);
  }

  void say(const std::string& json) {
    std::cout << now_ / 1000 << " > " << json << '\n';
    auto message = protocol::parse_client_message(json);
    show(message ? session_.on_message(message.value(), now_)
                 : session_.on_refused(message.error(), protocol::message_tag(json), now_));
  }

  [[nodiscard]] Drawn drawn() const {
    Drawn out;
    out.payload = std::make_shared<const std::vector<std::uint8_t>>(1000);
    out.info.method = render_->setting.method == protocol::MethodName::kernel ? "kernel" : "slab";
    out.info.tiles = 1;
    out.signature.key = "style";
    out.view_json = "{}";
    out.render_us = render_us;
    const quality::PictureSize size = quality::size_at(render_->view, render_->setting);
    out.info.width = size.width;
    out.info.height = size.height;
    if (render_->encoding.measure) {
      out.info.error_value = 1e-3;
      out.info.error_kind = "measured";
    }
    return out;
  }

  void rendered() {
    const std::uint64_t ticket = render_->ticket;
    Result<Drawn> result = drawn();
    if (fail_next_) result = make_error(ErrorKind::bad_data, "unreadable");
    if (cancelled_) result = make_error(ErrorKind::cancelled, "");
    fail_next_ = cancelled_ = false;
    render_end_.reset();
    show(session_.on_rendered(ticket, std::move(result), now_));
  }

  void show(Effects effects) {
    bool sent = false;
    for (const Effect& effect : effects) {
      std::cout << now_ / 1000 << "   ";
      std::visit([&](const auto& body) { print(body, sent); }, effect);
      std::cout << '\n';
    }
    if (sent) show(session_.on_written(now_));
  }

  void print(const SendText& text, bool&) { std::cout << "text " << encode(text.message); }
  void print(const Describe& describe, bool&) {
    described_ = describe.id;
    std::cout << "describe " << describe.dataset << " as " << describe.id;
  }
  void print(const StartRender& start, bool&) {
    render_ = start;
    render_end_ = now_ + render_us;
    cancelled_ = false;
    std::cout << "render " << start.ticket << " by " << text_of(start.setting) << ", "
              << text_of(start.encoding) << ": " << encode_view(start.view);
  }
  void print(const CancelRender& cancel, bool&) {
    cancelled_ = true;
    std::cout << "cancel " << cancel.ticket;
  }
  void print(const Ping& ping, bool&) { std::cout << "ping " << ping.seq; }
  void print(const SendFrame& frame, bool& sent) {
    const protocol::FrameHeader& header = frame.header;
    std::cout << "frame " << header.seq << " rev " << header.rev << " step " << header.step
              << " flags " << header.flags << ' ' << header.width << 'x' << header.height
              << " quality " << int{header.quality} << " level " << int{header.level} << " t "
              << header.t << ", " << frame.payload->size() << " bytes";
    sent = true;
    sent_ = header.seq;
    ack_at_ = now_ + acknowledged_after_us;
  }
  void print(const Prefetch& wanted, bool&) {
    std::cout << "prefetch";
    for (const int step : wanted.steps) std::cout << ' ' << step;
  }
  void print(const EndVideo&, bool&) { std::cout << "end video"; }
  void print(const Hide&, bool&) { std::cout << "hide"; }
  void print(const Calibrate&, bool&) { std::cout << "survey"; }
  void print(const Close& close, bool&) {
    std::cout << "close " << close.code << ' ' << close.reason;
  }

  Micros now_ = 0;
  std::uint32_t described_ = 0;
  std::optional<StartRender> render_;  // the newest render in progress
  std::optional<Micros> render_end_;   // while it is in progress
  std::optional<Micros> ack_at_;
  std::uint32_t sent_ = 0;  // seq of the newest frame
  bool cancelled_ = false;
  bool fail_next_ = false;
  Session session_;
};

}  // namespace

int main(int argc, char** argv) {
  std::ifstream script(argc == 2 ? argv[1] : "");
  if (!script) {
    std::cerr << "usage: session_transcript SCRIPT\n";
    return 2;
  }
  Transcript transcript;
  for (std::string line; std::getline(script, line);) transcript.play(Json::parse(line));
  return 0;
}
