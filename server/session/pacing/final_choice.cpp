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
  quality::Setting full = setting;
  full.half_level = 0;
  full.coarser = 0;
  Candidate& of = candidate(full);
  if (of.times_drawn == 0) of.error = std::min(of.error, error);
}

void FinalChoice::drawn(const quality::Setting& setting, double error) {
  Candidate& of = candidate(setting);
  of.error = error;
  ++of.times_drawn;
}

bool FinalChoice::was_drawn(const quality::Setting& setting) const {
  const Candidate* const known = find(setting);
  return known != nullptr && known->times_drawn > 0;
}

FinalChoice::Candidate FinalChoice::winner(const quality::Setting& own, double own_error) const {
  const Candidate* const of_own = find(own);
  Candidate best{own, of_own != nullptr && of_own->times_drawn > 0 ? of_own->error : own_error};
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
  const Candidate* const known = find(last);
  return known == nullptr || known->times_drawn > 1 ||
         !(winner(own, own_error).error < known->error);
}

}  // namespace windsplat::session
