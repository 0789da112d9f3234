#include "server/session/pacing/displayed_frame.hpp"

#include "protocol/codec.hpp"

namespace windsplat::session {
namespace {

std::string without_camera(protocol::View view) {
  view.camera = {};
  return protocol::encode_view(view);
}

}  // namespace

bool is_blank(const protocol::FrameInfo& info) {
  return info.method != "reference" && info.tiles == 0;
}

void DisplayedFrame::sent(std::uint64_t version, double error) {
  version_ = version;
  final_ = false;
  error_ = error;
  standing_.reset();
}

void DisplayedFrame::sent_final(const ViewState& of, std::uint32_t seq, double error, bool blank) {
  version_ = of.version();
  final_ = true;
  error_ = error;
  standing_ = {seq, of.rev(), protocol::encode_view(of.view()),
               blank ? without_camera(of.view()) : std::string()};
}

void DisplayedFrame::withheld(std::uint64_t version) {
  version_ = version;
  final_ = false;
  error_ = 0;  // only the final frame can improve on it
}

void DisplayedFrame::failed(std::uint64_t version) {
  version_ = version;
  final_ = true;
}

bool DisplayedFrame::equals(const protocol::View& view) const {
  return standing_ && protocol::encode_view(view) == standing_->view;
}

bool DisplayedFrame::equals_blank(const protocol::View& view) const {
  return standing_ && standing_->without_camera == without_camera(view);
}

std::optional<protocol::UnchangedMessage> DisplayedFrame::stand_for(ViewState& of) {
  of.confirm(of.version());
  version_ = of.version();
  final_ = true;
  standing_->view = protocol::encode_view(of.view());
  // An undo may return to a rev that was never reported.
  if (!of.is_unanswered() && standing_->rev == of.rev()) return std::nullopt;
  of.answered(of.version());
  standing_->rev = of.rev();
  return protocol::UnchangedMessage{of.rev(), standing_->seq};
}

}  // namespace windsplat::session
