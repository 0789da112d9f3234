#include "server/session/pacing/render_slot.hpp"

#include <utility>

namespace windsplat::session {

bool RenderSlot::draws_stream() const {
  return render_ && !render_->unwanted && render_->purpose != Purpose::still;
}

void RenderSlot::start(Render render, const protocol::View& view, Effects& effects) {
  render.ticket = ++tickets_;
  render.step = view.step;
  render.dataset = view.dataset;
  if (render.purpose != Purpose::still) started_version_ = render.version;
  effects.emplace_back(
      StartRender{render.ticket, view, render.setting, render.encoding, render.may_stand_in});
  render_ = std::move(render);
}

std::optional<Render> RenderSlot::take(std::uint64_t ticket) {
  if (!render_ || render_->ticket != ticket) return std::nullopt;
  return std::exchange(render_, std::nullopt);
}

void RenderSlot::abandon(Effects& effects) {
  if (draws_stream()) cancel(effects);
}

void RenderSlot::abandon_rest(Effects& effects) {
  if (draws_stream() && render_->purpose != Purpose::moving) cancel(effects);
}

void RenderSlot::restart_video() {
  if (render_) render_->old_video = true;
}

void RenderSlot::cancel(Effects& effects) {
  if (!render_ || render_->unwanted) return;
  render_->unwanted = true;
  effects.emplace_back(CancelRender{render_->ticket});
}

}  // namespace windsplat::session
