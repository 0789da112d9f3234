// Keeps the least error of each candidate.
#include "server/session/pacing/final_choice.hpp"

#include <algorithm>

namespace windsplat::session {

const FinalChoice::Candidate* FinalChoice::find(const quality::Setting& setting) const {
  const auto at = std::find_if(known_.begin(), known_.end(), [&](const Candidate& candidate) {
    return candidate.setting == setting;
  });
  return at == known_.end() ? nullptr : &*at;
}

FinalChoice::Candidate& FinalChoice::candidate(const quality::Setting& setting) {
  const auto at = std::find_if(known_.begin(), known_.end(), [&](const Candidate& candidate) {
    return candidate.setting == setting;
  });
  if (at != known_.end()) return *at;
  known_.push_back({setting});
  return known_.back();
}

void FinalChoice::shown(const quality::Setting& setting, double error) {
  if (setting.half_level > 0 || setting.coarser > 0) return;
  Candidate& of = candidate(setting);
  if (of.times_drawn == 0) of.error = std::min(of.error, error);
}

void FinalChoice::drawn(const quality::Setting& setting, double error) {
  Candidate& of = candidate(setting);
  of.error = error;
  ++of.times_drawn;
}

bool FinalChoice::any_drawn() const {
  return std::any_of(known_.begin(), known_.end(),
                     [](const Candidate& candidate) { return candidate.times_drawn > 0; });
}

bool FinalChoice::was_drawn(const quality::Setting& setting) const {
  const Candidate* const known = find(setting);
  return known != nullptr && known->times_drawn > 0;
}

FinalChoice::Candidate FinalChoice::winner(const quality::Setting& own, double own_error) const {
  const Candidate* const of_own = find(own);
  Candidate best{own, own_error};
  if (of_own != nullptr && of_own->times_drawn > 0) best = *of_own;
  for (const Candidate& known : known_) {
    if (known.error < best.error && !(known.setting == own)) best = known;
  }
  return best;
}

quality::Setting FinalChoice::best(const quality::Setting& own, double own_error) const {
  return winner(own, own_error).setting;
}

bool FinalChoice::accepts(const quality::Setting& last, const quality::Setting& own,
                          double own_error) const {
  // Forecasts deviate: another frame is drawn for a clearly lower one only.
  constexpr double clearly = 1.5;
  const Candidate* const known = find(last);
  const Candidate best = winner(own, own_error);
  const double better = best.times_drawn > 0 ? best.error : clearly * best.error;
  return known == nullptr || known->times_drawn > 1 || !(better < known->error);
}

}  // namespace windsplat::session
