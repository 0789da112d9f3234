#include "server/session/pacing/view_forecast.hpp"

namespace windsplat::session {

quality::Forecasts ViewForecast::of(const protocol::View& view) const {
  quality::SceneSignature signature = quality::signature_of(view);
  if (signature.key == drawn_key_) {
    signature = signature_;
  } else {
    signature.key.clear();
  }
  const quality::Viewpoint viewpoint = quality::viewpoint_of(view, viewpoint_);
  if (forecaster_) return forecaster_(signature, viewpoint);
  quality::Forecasts out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    out[i] = quality::prior(signature.kind, quality::settings[i], viewpoint);
  }
  return out;
}

void ViewForecast::learn(const protocol::View& view, const Drawn& drawn) {
  drawn_key_ = quality::signature_of(view).key;
  signature_ = drawn.signature;
  viewpoint_ = drawn.viewpoint;
}

}  // namespace windsplat::session
