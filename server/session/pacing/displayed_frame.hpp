// What the client displays: the version of the last frame sent, and the views that it shows.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/frame_header.hpp"
#include "protocol/messages.hpp"
#include "protocol/view.hpp"
#include "server/session/view_state.hpp"

namespace windsplat::session {

// Whether only the background is visible. Unknown for the reference.
bool is_blank(const protocol::FrameInfo& info);

class DisplayedFrame {
 public:
  [[nodiscard]] std::uint64_t version() const { return version_; }
  [[nodiscard]] bool is_final() const { return final_; }
  [[nodiscard]] double error() const {
    return error_;
  }  // the number of samples if known,
     // otherwise 0 or 1

  // A frame of that version was sent, which is not final.
  void sent(std::uint64_t version, double error);
  // A final frame of the view was sent.
  void sent_final(const ViewState& of, std::uint32_t seq, double error, bool blank);
  // The new frame has the same content as the final one displayed, but without its measured error.
  void withheld(std::uint64_t version);
  // The view cannot be drawn: wait for a change.
  void failed(std::uint64_t version);

  // Call when the dataset was reopened, which invalidates the frames displayed.
  void forget() { standing_.reset(); }
  // Whether the final frame displayed is valid for the view: it is equivalent, or both scenes are
  // blank and the views differ in the camera only.
  [[nodiscard]] bool equals(const protocol::View& view) const;
  [[nodiscard]] bool equals_blank(const protocol::View& view) const;
  // Marks the final frame valid for the current view, and returns the response to its patch.
  std::optional<protocol::UnchangedMessage> stand_for(ViewState& of);

 private:
  // The final frame shown by the client, until another one is sent.
  struct Standing {
    std::uint32_t seq = 0;
    std::uint32_t rev = 0;  // last one reported to the client
    std::string view;
    std::string without_camera;  // empty if the scene is not empty
  };

  std::uint64_t version_ = 0;
  bool final_ = true;
  double error_ = 1;
  std::optional<Standing> standing_;
};

}  // namespace windsplat::session
