// Frames shown of the current view, with their errors -> the setting of its final frame.
#pragma once

#include <vector>

#include "server/quality/setting.hpp"

namespace windsplat::session {

// A final frame is at least as accurate as every frame of full size and detail shown of its view.
// The candidates are the view's own setting and those shown; each counts with its measured error
// once it was drawn as final, before that with the error reported of the frame shown.
class FinalChoice {
 public:
  // The view changed.
  void restart() { known_.clear(); }

  // A frame of the view was shown before the final one, with its reported error.
  void shown(const quality::Setting& setting, double error);
  // A frame was drawn as the final one, with its error.
  void drawn(const quality::Setting& setting, double error);

  [[nodiscard]] bool any_drawn() const;
  [[nodiscard]] bool was_drawn(const quality::Setting& setting) const;
  // The candidate with the least error, `own_error` being the forecast of the view's own setting.
  [[nodiscard]] quality::Setting best(const quality::Setting& own, double own_error) const;
  // Whether the frame drawn last as final is the final one: no candidate has a lower measured or a
  // clearly lower forecast error, or it was drawn twice.
  [[nodiscard]] bool accepts(const quality::Setting& last, const quality::Setting& own,
                             double own_error) const;

 private:
  struct Candidate {
    quality::Setting setting;
    double error = 1;
    int times_drawn = 0;  // as the final frame
  };
  [[nodiscard]] const Candidate* find(const quality::Setting& setting) const;
  [[nodiscard]] Candidate winner(const quality::Setting& own, double own_error) const;
  Candidate& candidate(const quality::Setting& setting);

  std::vector<Candidate> known_;  // at most one for each method and thickness of slabs
};

}  // namespace windsplat::session
