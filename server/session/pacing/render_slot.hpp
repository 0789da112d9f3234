// The one render of a session that may be in progress.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/view.hpp"
#include "server/quality/setting.hpp"
#include "server/session/effects.hpp"
#include "server/session/pacing/link.hpp"

namespace windsplat::session {

enum class Purpose { moving, refining, final, still };

struct Render {
  std::uint64_t ticket = 0;
  Purpose purpose = Purpose::moving;
  std::string dataset;
  std::uint64_t version = 0;
  Micros begun = 0;
  std::uint32_t rev = 0;
  double t = 0;
  int step = 0;
  quality::Setting setting;
  Encoding encoding;
  std::uint32_t still_id = 0;
  bool may_stand_in = false;
  bool unwanted = false;   // true: its frame will not be sent
  bool played = false;     // the first one of a step reached by playback
  bool old_video = false;  // of a stream of H.264 that the client has abandoned meanwhile
};

class RenderSlot {
 public:
  [[nodiscard]] const std::optional<Render>& render() const { return render_; }
  // The newest version of the view whose render was started, stills excepted.
  [[nodiscard]] std::uint64_t started_version() const { return started_version_; }
  // Whether a frame of the stream is being drawn and will be sent.
  [[nodiscard]] bool draws_stream() const;

  // Assigns a ticket to the render and requests it.
  void start(Render render, const protocol::View& view, Effects& effects);
  // Ends the render. nullopt: the ticket does not belong to a render in progress.
  std::optional<Render> take(std::uint64_t ticket);

  // Cancels the render, unless it is a still.
  void abandon(Effects& effects);
  // Cancels the render of a view at rest.
  void abandon_rest(Effects& effects);
  // A frame of H.264 in progress will not begin the stream that follows.
  void restart_video();
  // Cancels the render, even a still.
  void cancel(Effects& effects);

 private:
  std::optional<Render> render_;
  std::uint64_t tickets_ = 0;
  std::uint64_t started_version_ = 0;
};

}  // namespace windsplat::session
