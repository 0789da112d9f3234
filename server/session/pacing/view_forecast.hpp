// Known errors and times of the settings for the view of a session.
#pragma once

#include <string>

#include "protocol/view.hpp"
#include "server/quality/table.hpp"
#include "server/quality/view_traits.hpp"
#include "server/session/effects.hpp"
#include "server/session/surroundings.hpp"

namespace windsplat::session {

// The scene signature is known after completion during drawing; before that use the method only.
class ViewForecast {
 public:
  explicit ViewForecast(Forecaster forecaster) : forecaster_(std::move(forecaster)) {}

  [[nodiscard]] quality::Forecasts of(const protocol::View& view) const;
  // Call after the view was drawn.
  void learn(const protocol::View& view, const Drawn& drawn);
  void forget() { drawn_key_.clear(); }  // call for another dataset

 private:
  Forecaster forecaster_;
  std::string drawn_key_;              // key of the view drawn last, before completion
  quality::SceneSignature signature_;  // known after completion
  quality::Viewpoint viewpoint_;
};

}  // namespace windsplat::session
