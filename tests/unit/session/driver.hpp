// Drives a session with a manual clock and a scripted environment.
#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/session/session.hpp"

namespace session_test {

using windsplat::Error;
using windsplat::ErrorKind;
using windsplat::make_error;
using windsplat::make_error_at;
using windsplat::Result;
using windsplat::protocol::View;
using namespace windsplat::session;  // NOLINT(google-build-using-namespace)
namespace protocol = windsplat::protocol;
namespace quality = windsplat::quality;

inline constexpr Micros ms = 1000;
inline constexpr int steps = 10;
inline constexpr double beyond = 1000;  // from such a distance nothing is visible
inline constexpr double faint = 500;    // nor in a moving frame

inline protocol::PlayMessage play(int from, int to, double fps, bool loop, bool drop) {
  return {from, to, fps, loop, drop};
}

inline std::string azimuth(int n) {
  return R"({"camera":{"eye":[)" + std::to_string(n) + ",-3,1]}}";
}

class Driver {
 public:
  explicit Driver(Options options = {})
      : session_(
            options,
            {[this](const View& view) { return check(view, step_count); },
             [this](const std::string& dataset) {
               return dataset == "wind" ? reading : std::nullopt;
             },
             [this](const quality::SceneSignature& signature, const quality::Viewpoint& viewpoint) {
               return calibrated.value_or(quality::Table(signature.kind).forecasts(viewpoint));
             },
             [this] { return waiting; }},
            now_) {}

  // --- inputs -----------------------------------------------------------------------------------

  void say(const protocol::ClientMessage& message) { take(session_.on_message(message, now_)); }
  void patch(std::uint32_t rev, std::string json, double t = 0) {
    say(protocol::PatchMessage{rev, t, std::move(json)});
  }
  void ack(std::uint32_t seq) { say(protocol::AckMessage{seq, 0}); }
  void binary() { take(session_.on_binary(now_)); }
  void changed(const std::string& dataset) { take(session_.on_changed(dataset, now_)); }
  void drain() { take(session_.on_drain(now_)); }
  void refused(const Error& error) { take(session_.on_refused(error, {}, now_)); }
  void described(std::uint32_t id, Result<protocol::DatasetDescription> description) {
    take(session_.on_described(id, std::move(description), now_));
  }

  // Advances time; the session is woken at every time it requested.
  void wait(Micros duration) {
    const Micros end = now_ + duration;
    for (int turns = 0;; ++turns) {
      const auto wake = session_.wake_at();
      if (!wake || *wake > end) break;
      ASSERT_LT(turns, 100000) << "the session requests calls without end";
      now_ = std::max(now_, *wake);
      take(session_.on_time(now_));
    }
    now_ = end;
  }

  // The requested render ends after `cost`; its frame is delivered at once.
  void finish_render(Micros cost = 10 * ms, bool loaded = false) {
    ASSERT_TRUE(render) << "no render is running";
    wait(cost);
    const StartRender done = *render;
    render.reset();
    if (cancelled) {
      cancelled = false;
      take(session_.on_rendered(done.ticket, make_error(ErrorKind::cancelled, ""), now_));
    } else {
      take(session_.on_rendered(done.ticket, drawn(done, cost, loaded), now_));
    }
    if (write_at_once) written();
  }
  void fail_render(const Error& error) {
    ASSERT_TRUE(render);
    const StartRender done = *render;
    render.reset();
    take(session_.on_rendered(done.ticket, error, now_));
  }
  void written() {
    if (unwritten_) take(session_.on_written(now_));
    unwritten_ = false;
  }

  // Renders and acknowledges until the session is idle.
  void settle(Micros cost = 10 * ms) {
    for (int turns = 0; turns < 50; ++turns) {
      if (render) finish_render(cost);
      if (!frames.empty()) ack(frames.back().header.seq);
      if (!render) wait(200 * ms);
      if (!render) return;
    }
    FAIL() << "the session does not become idle";
  }

  // --- results ----------------------------------------------------------------------------------

  std::vector<protocol::ErrorMessage> errors() const { return texts_of<protocol::ErrorMessage>(); }
  template <class T>
  std::vector<T> texts_of() const {
    std::vector<T> out;
    for (const auto& text : texts) {
      if (const T* body = std::get_if<T>(&text)) out.push_back(*body);
    }
    return out;
  }
  std::vector<std::uint32_t> steps_shown() const {
    std::vector<std::uint32_t> out;
    for (const SendFrame& frame : frames) out.push_back(frame.header.step);
    return out;
  }
  static bool is_final(const SendFrame& frame) {
    return (frame.header.flags & protocol::flag_final) != 0;
  }
  Micros now() const { return now_; }

  std::vector<protocol::ServerMessage> texts;
  std::vector<SendFrame> frames;
  std::vector<Describe> describes;
  std::vector<Prefetch> requests;
  std::optional<StartRender> render;  // being drawn
  bool cancelled = false;             // the render was cancelled
  int renders = 0;
  std::optional<Close> closed;
  bool write_at_once = true;
  std::size_t payload_bytes = 100;  // of each frame
  bool video_fails = false;         // frames asked as H.264 are JPEG
  int videos_ended = 0;
  int hides = 0;
  int step_count = steps;
  Micros waiting = 0;              // of the frames of other sessions
  Micros queue = 0;                // simulated time that a frame waits for the renderer
  std::optional<Reading> reading;  // of the dataset "wind"
  std::vector<Calibrate> calibrations;
  std::optional<quality::Forecasts> calibrated;  // forecasts known; empty: the prior
  std::uint64_t missing_bytes = 0;               // of frames for which coarser data may stand in
  bool averaged = false;  // averaged data: errors of final frames do not depend on their slabs
  std::optional<double> measured_error;  // error of final frames drawn with slabs of the view's own
                                         // thickness

 private:
  static Result<int> check(const View& view, int step_count) {
    if (view.dataset != "wind" && view.dataset != "sea") {
      return make_error_at(ErrorKind::not_found, "/dataset", "there is no such dataset");
    }
    if (view.step >= step_count) {
      return make_error_at(ErrorKind::invalid, "/step", "is beyond the last");
    }
    return step_count;
  }

  Drawn drawn(const StartRender& done, Micros cost, bool loaded) const {
    Drawn out;
    out.payload = std::make_shared<const std::vector<std::uint8_t>>(payload_bytes);
    out.video = done.encoding.codec == protocol::Codec::h264 && !video_fails;
    out.key = out.video && done.encoding.key;
    const bool kernel = done.setting.method == protocol::MethodName::kernel;
    out.info.method = kernel ? "kernel" : "slab";
    out.signature.key = "its style";
    if (done.encoding.measure && measured_error) {
      const int by = averaged ? 1 : done.setting.thinner * done.setting.thinner;
      out.info.error_value = *measured_error / by;
      out.info.error_kind = "measured";
    } else if (calibrated) {
      out.info.error_value = quality::forecast_between(done.setting, *calibrated).error;
      out.info.error_kind = "estimated";
    }
    if (done.may_stand_in && missing_bytes > 0)
      out.info.detail.emplace().missing_bytes = missing_bytes;
    out.info.tiles = 1;
    const bool moving = !done.encoding.full_chroma;
    for (const double height : done.view.camera.eye.value_or(protocol::Vec3{})) {
      if (height >= beyond || (moving && height >= faint)) out.info.tiles = 0;
    }
    const quality::PictureSize size = quality::size_at(done.view, done.setting);
    out.info.width = size.width;
    out.info.height = size.height;
    out.view_json = "{}";
    out.render_us = cost;
    out.queue_us = queue;
    out.loaded = loaded;
    return out;
  }

  void take(Effects effects) {
    for (Effect& effect : effects) {
      ASSERT_FALSE(closed) << "an effect after close";
      if (auto* ping = std::get_if<Ping>(&effect)) pinged_ = ping->seq;
      if (auto* text = std::get_if<SendText>(&effect)) {
        texts.push_back(text->message);
        if (const auto* chosen = std::get_if<protocol::ChosenMessage>(&text->message)) {
          ASSERT_EQ(chosen->seq, pinged_) << "the ping must precede its frame";
        }
      }
      if (auto* describe = std::get_if<Describe>(&effect)) describes.push_back(*describe);
      if (auto* start = std::get_if<StartRender>(&effect)) {
        ASSERT_FALSE(render) << "two renders at a time";
        render = *start;
        cancelled = false;
        ++renders;
      }
      if (auto* cancel = std::get_if<CancelRender>(&effect)) {
        ASSERT_TRUE(render);
        ASSERT_EQ(cancel->ticket, render->ticket);
        cancelled = true;
      }
      if (auto* frame = std::get_if<SendFrame>(&effect)) {
        ASSERT_FALSE(unwritten_) << "two frames are unacknowledged";
        frames.push_back(*frame);
        unwritten_ = true;
      }
      if (std::holds_alternative<EndVideo>(effect)) ++videos_ended;
      if (std::holds_alternative<Hide>(effect)) ++hides;
      if (auto* request = std::get_if<Prefetch>(&effect)) requests.push_back(*request);
      if (auto* calibration = std::get_if<Calibrate>(&effect)) calibrations.push_back(*calibration);
      if (auto* close = std::get_if<Close>(&effect)) closed = *close;
    }
  }

  Micros now_ = 1'000'000;
  bool unwritten_ = false;
  std::uint32_t pinged_ = 0;
  Session session_;
};

}  // namespace session_test
