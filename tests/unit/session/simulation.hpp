// Sessions on a simulated link: discrete events in simulated time, from input to frames shown.
#pragma once

#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec.hpp"
#include "server/session/session.hpp"

namespace session_test {

namespace sim {

using namespace windsplat::session;  // NOLINT(google-build-using-namespace)
namespace protocol = windsplat::protocol;
namespace quality = windsplat::quality;

inline constexpr Micros second = 1'000'000;

class Clock {
 public:
  void at(Micros time, std::function<void()> act) {
    events_.emplace(std::max(time, now_), std::move(act));
  }
  void run_until(Micros end) {
    while (!events_.empty() && events_.begin()->first <= end) {
      auto next = events_.extract(events_.begin());
      now_ = next.key();
      next.mapped()();
    }
    now_ = end;
  }
  [[nodiscard]] Micros now() const { return now_; }

 private:
  Micros now_ = second;
  std::multimap<Micros, std::function<void()>> events_;  // order of creation at equal times
};

// One renderer for all sessions, first come, first served. Cost depends on pixels.
class Renderer {
 public:
  Renderer(Clock& clock, Micros full_us) : clock_(clock), full_us_(full_us) {}

  void draw(const StartRender& wanted, std::function<void(Drawn)> reply) {
    Drawn drawn;
    drawn.info.method = "kernel";
    drawn.info.tiles = 1;
    const quality::PictureSize size = quality::size_at(wanted.view, wanted.setting);
    drawn.info.width = size.width;
    drawn.info.height = size.height;
    drawn.view_json = std::string(1100, ' ');
    const double pixels = static_cast<double>(drawn.info.width) * drawn.info.height;
    drawn.render_us = static_cast<Micros>(static_cast<double>(full_us_) * pixels / (1280 * 720));
    drawn.payload = std::make_shared<const std::vector<std::uint8_t>>(bytes(pixels, wanted));
    free_at_ = std::max(free_at_, clock_.now()) + drawn.render_us;
    ++renders;
    clock_.at(free_at_, [reply = std::move(reply), drawn] { reply(drawn); });
  }

  int renders = 0;

 private:
  // Differs deliberately from the model of the session: another power law, and sizes vary between
  // pictures.
  std::size_t bytes(double pixels, const StartRender& wanted) {
    const int quality = wanted.encoding.quality;
    const double scale = quality < 50 ? 50.0 / quality : 2 - quality / 50.0;
    const double chroma = wanted.encoding.full_chroma ? 1.5 : 1;
    const double waves = 1 + 0.2 * std::sin(0.7 * renders);
    return static_cast<std::size_t>(600 + 0.32 * chroma * waves * std::pow(pixels, 0.86) /
                                              std::pow(scale, 0.4));
  }

  Clock& clock_;
  Micros full_us_;  // bytes of 1280x720
  Micros free_at_ = 0;
};

struct LinkOptions {
  double bytes_per_s = 1e6;
  Micros delay = 1000;   // decoding of frames in the client, one at a time
  Micros decode = 2000;  // time to decode a frame in the client, one after the other
};

struct Shown {
  std::uint32_t rev = 0;
  bool final = false;
  int quality = 0;
  double pixels = 0;
  double wire_bytes = 0;  // with its text messages; t of the newest patch at the start
  Micros t = 0;           // t of the newest patch when the render was started
  Micros arrived = 0;
  Micros shown = 0;  // decoded
};

// A client, its link, and the server's edge: text messages before frames, one message at a time, of
// which the kernel buffers at most `unsent` bytes.
class Viewer {
 public:
  Viewer(Clock& clock, Renderer& renderer, LinkOptions options)
      : clock_(clock),
        renderer_(renderer),
        options_(options),
        session_({}, {[](const protocol::View&) { return windsplat::Result<int>(10); }, {}, {}},
                 clock.now()) {}

  // Moves the camera 60 times per second until `end`.
  void drag(Micros end) {
    if (rev_ == 0) patch(R"({"dataset":"wind","image":{"width":1280,"height":720}})");
    for (Micros time = clock_.now() + patch_every; time < end; time += patch_every) {
      clock_.at(time,
                [this] { patch(R"({"camera":{"eye":[)" + std::to_string(rev_) + ",-3,1]}}"); });
    }
  }
  void say(const protocol::ClientMessage& message) {
    clock_.at(clock_.now() + options_.delay,
              [this, message] { take(session_.on_message(message, clock_.now())); });
  }
  // A message answered with an error at once; returns the time of arrival of the error.
  void ask(std::function<void(Micros)> answered) {
    clock_.at(clock_.now() + options_.delay, [this, answered = std::move(answered)] {
      answers_.push_back(answered);
      take(session_.on_refused(windsplat::make_error(windsplat::ErrorKind::invalid, "no"), {},
                               clock_.now()));
    });
  }
  void set_rate(double bytes_per_s) { options_.bytes_per_s = bytes_per_s; }

  static constexpr Micros patch_every = 16'667;
  std::vector<Shown> frames;
  std::vector<Micros> begun;     // renders of moving frames
  std::size_t held_most = 0;     // frames held between renderer and wire
  std::size_t unacked_most = 0;  // frames sent and not acknowledged
  std::uint32_t rev() const { return rev_; }

 private:
  static constexpr double unsent = 16 * 1024;
  static constexpr double text_bytes = 1700;
  struct Out {
    double bytes = 0;
    std::optional<SendFrame> frame;
    std::optional<std::uint32_t> ping;
    bool error = false;
  };

  void patch(const std::string& json) {
    ++rev_;
    say(protocol::PatchMessage{rev_, static_cast<double>(clock_.now()), json});
  }

  void take(Effects effects) {
    for (Effect& effect : effects) {
      if (auto* start = std::get_if<StartRender>(&effect)) begin(*start);
      if (auto* ping = std::get_if<Ping>(&effect)) out_.push_back({16, {}, ping->seq, false});
      if (auto* text = std::get_if<SendText>(&effect)) {
        const bool error = std::holds_alternative<protocol::ErrorMessage>(text->message);
        const bool chosen = std::holds_alternative<protocol::ChosenMessage>(text->message);
        out_.push_back({chosen ? text_bytes : 150, {}, {}, error});
      }
      if (auto* frame = std::get_if<SendFrame>(&effect)) {
        frame_ = *frame;
        unacked_most = std::max(unacked_most, ++unacked_);
      }
    }
    held_most = std::max(held_most, static_cast<std::size_t>(frame_ ? 1 : 0) +
                                        static_cast<std::size_t>(rendering_ ? 1 : 0));
    pump();
    wake();
  }

  void wake() {
    const auto at = session_.wake_at();
    if (!at) return;
    clock_.at(*at, [this, mine = ++wakes_] {
      if (mine == wakes_) take(session_.on_time(clock_.now()));
    });
  }

  void begin(const StartRender& start) {
    if (!start.encoding.full_chroma) begun.push_back(clock_.now());
    rendering_ = true;
    renderer_.draw(start, [this, ticket = start.ticket](Drawn drawn) {
      rendering_ = false;
      take(session_.on_rendered(ticket, std::move(drawn), clock_.now()));
    });
  }

  // Writes the next message: its last byte leaves after all earlier ones.
  void pump() {
    if (writing_) return;
    Out next;
    if (!out_.empty()) {
      next = std::move(out_.front());
      out_.pop_front();
    } else if (frame_) {
      next.bytes = 64.0 + static_cast<double>(frame_->payload->size());
      next.frame = frame_;
    } else {
      return;
    }
    writing_ = true;
    const double rate = options_.bytes_per_s;
    free_at_ = std::max(free_at_, clock_.now()) + static_cast<Micros>(1e6 * next.bytes / rate);
    const Micros taken =
        std::max(clock_.now(), free_at_ - static_cast<Micros>(1e6 * unsent / rate));
    clock_.at(free_at_ + options_.delay, [this, next] { arrive(next); });
    clock_.at(taken, [this, was_frame = next.frame.has_value()] {
      writing_ = false;
      if (!was_frame) return pump();
      frame_.reset();
      take(session_.on_written(clock_.now()));
    });
  }

  void arrive(const Out& message) {
    if (message.ping) {
      clock_.at(clock_.now() + options_.delay,
                [this, seq = *message.ping] { session_.on_pong(seq, clock_.now()); });
    }
    if (message.error) {
      answers_.front()(clock_.now());
      answers_.pop_front();
    }
    if (!message.frame) return;
    const protocol::FrameHeader& header = message.frame->header;
    decoder_free_ = std::max(decoder_free_, clock_.now()) + options_.decode;
    frames.push_back({header.rev, (header.flags & protocol::flag_final) != 0, header.quality,
                      static_cast<double>(header.width) * header.height,
                      message.bytes + text_bytes + 16, static_cast<Micros>(header.t), clock_.now(),
                      decoder_free_});
    clock_.at(decoder_free_ + options_.delay, [this, seq = header.seq] {
      --unacked_;
      const double decode_ms = 1e-3 * static_cast<double>(options_.decode);
      take(session_.on_message(protocol::AckMessage{seq, decode_ms}, clock_.now()));
    });
  }

  Clock& clock_;
  Renderer& renderer_;
  LinkOptions options_;
  Session session_;
  std::uint32_t rev_ = 0;
  std::deque<Out> out_;
  std::optional<SendFrame> frame_;
  bool writing_ = false;
  bool rendering_ = false;
  std::size_t unacked_ = 0;
  Micros free_at_ = 0;  // rate of the bottleneck link
  Micros decoder_free_ = 0;
  std::uint64_t wakes_ = 0;
  std::deque<std::function<void(Micros)>> answers_;
};

}  // namespace sim
}  // namespace session_test
