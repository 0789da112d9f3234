// Which steps a session will probably need soon.
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
    bool may_load = false;     // the client sees the view, and nothing more urgent is being opened
    bool final_shown = false;  // the final frame of the view
    quality::Setting moving_setting;  // of the moving frame drawn last
  };

  // The request to make; none if it stays as it is.
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
