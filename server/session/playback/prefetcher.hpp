// Predicts which steps a session will need soon.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/view.hpp"
#include "server/quality/setting.hpp"
#include "server/session/effects.hpp"
#include "server/session/playback/player.hpp"
#include "server/session/surroundings.hpp"

namespace windsplat::session {

// During playback the next steps, in order. At rest, after the final frame, both neighbouring
// steps, so that a single step is immediate; a change of step, dataset or field withdraws that
// request until the view is at rest again.
class Prefetcher {
 public:
  struct Situation {
    const protocol::View& view;
    const Player& player;
    bool may_load = false;            // the client sees the view, and no dataset is being opened
    bool final_shown = false;         // call for the final frame of the view
    quality::Setting moving_setting;  // setting of the last moving frame
  };

  // The request to make; nullopt if it is unchanged.
  std::optional<Prefetch> update(const Situation& now, const Check& check);
  // Steps requested before must be requested again: the dataset was reopened.
  void forget() { requested_ = {}; }

 private:
  [[nodiscard]] std::vector<int> wanted_steps(const Situation& now, const Check& check) const;

  Prefetch requested_;
  std::string requested_fields_;
  bool requested_at_rest_ = false;  // false during playback
};

}  // namespace windsplat::session
