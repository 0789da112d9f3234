// Chooses the next job from the usage of each owner.
#include "server/tasks/render_queue.hpp"

#include <algorithm>
#include <iterator>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

namespace windsplat::tasks {

// --- Shares --------------------------------------------------------------------------------------

void Shares::come(std::uint64_t party) {
  Party& known = parties_[party];
  if (!known.active && known.used_us < present_us_) {
    known.owed_us = std::max<std::int64_t>(0, known.owed_us - (present_us_ - known.used_us));
    known.used_us = present_us_;
  }
  known.active = true;
}

void Shares::rest(std::uint64_t party) {
  parties_[party].active = false;
  // A party whose usage is not above the virtual time needs no entry; without active parties the
  // virtual time advances.
  const bool all_rest = std::none_of(parties_.begin(), parties_.end(),
                                     [](const auto& known) { return known.second.active; });
  if (all_rest) {
    for (const auto& [id, known] : parties_) present_us_ = std::max(present_us_, known.used_us);
  }
  std::erase_if(parties_, [this, all_rest](const auto& known) {
    return !known.second.active &&
           (all_rest || known.second.used_us + known.second.owed_us <= present_us_);
  });
}

void Shares::charge(std::uint64_t party, std::int64_t us, bool whole) {
  Party& known = parties_[party];
  const std::int64_t at_once = parts_ > 1 && known.mean_us > 0 ? std::min(us, known.mean_us) : us;
  known.owed_us += us - at_once;
  const std::int64_t part = (known.owed_us + parts_ - 1) / parts_;
  known.owed_us -= part;
  known.used_us += at_once + part;
  if (!whole) return;
  known.mean_us = known.mean_us > 0 ? known.mean_us + (us - known.mean_us) / parts_ : us;
}

void Shares::begin(std::uint64_t party) {
  present_us_ = std::max(present_us_, parties_[party].used_us);
}

std::int64_t Shares::used_us(std::uint64_t party) const {
  const auto known = parties_.find(party);
  return known == parties_.end() ? present_us_ : known->second.used_us;
}

// --- RenderQueue ---------------------------------------------------------------------------------

namespace {

std::uint64_t number_of(RenderKind kind) { return static_cast<std::uint64_t>(kind); }

}  // namespace

void RenderQueue::push(RenderJob job, std::int64_t now_us) {
  const RenderKind kind = job.kind;
  const std::uint64_t owner = job.owner;
  const bool interrupts = kind != RenderKind::background && !job.is_background_turn;
  Line& line = line_of(kind);
  // Allocate first; an idle party without usage has no effect on the shares.
  std::map<std::uint64_t, Jobs> fresh;
  Jobs& one = fresh[owner];
  one.push_back({{std::move(job), now_us}, arrivals_});
  line.shares.expect(owner);
  if (kind != RenderKind::background) kinds_.expect(number_of(kind));

  ++arrivals_;
  ++waiting_;
  line.shares.come(owner);
  if (interrupts && running_ && running_->kind == RenderKind::background) {
    running_->cancel.cancel();
  }
  if (kind != RenderKind::background) kinds_.come(number_of(kind));
  line.owners.merge(fresh);
  if (fresh.empty()) return;
  Jobs& earlier = line.owners.find(owner)->second;
  if (kind == RenderKind::background) {
    for (const Waiting& older : earlier) older.next.job.cancel.cancel();
    replaced_.splice(replaced_.end(), earlier);
  }
  earlier.splice(earlier.end(), one);
}

std::optional<RenderKind> RenderQueue::next_kind() const {
  const auto waits = [this](RenderKind kind) {
    return !lines_[static_cast<std::size_t>(kind)].owners.empty();
  };
  const auto used = [this](RenderKind kind) { return kinds_.used_us(number_of(kind)); };
  const bool stream = waits(RenderKind::stream);
  const bool request = waits(RenderKind::request);
  if (stream && request) {
    return used(RenderKind::stream) <= used(RenderKind::request) ? RenderKind::stream
                                                                 : RenderKind::request;
  }
  if (stream) return RenderKind::stream;
  if (request) return RenderKind::request;
  if (waits(RenderKind::background)) return RenderKind::background;
  return std::nullopt;
}

std::optional<RenderQueue::Next> RenderQueue::pop(std::int64_t now_us) {
  now_us_ = now_us;
  if (!replaced_.empty()) {
    Waiting older = std::move(replaced_.front());
    replaced_.pop_front();
    return begin(std::move(older), false);
  }
  if (auto unwanted = take_cancelled()) return unwanted;
  const auto kind = next_kind();
  return kind ? take(*kind) : std::nullopt;
}

// Cancelled jobs run out of turn. Otherwise they would hold their resources while new owners keep
// the renderer busy.
std::optional<RenderQueue::Next> RenderQueue::take_cancelled() {
  for (Line& line : lines_) {
    for (auto owner = line.owners.begin(); owner != line.owners.end(); ++owner) {
      if (owner->second.front().next.job.cancel.cancelled()) {
        return begin(take_first(line, owner), true);
      }
    }
  }
  return std::nullopt;
}

RenderQueue::Waiting RenderQueue::take_first(Line& line, Owners::iterator owner) {
  Waiting first = std::move(owner->second.front());
  owner->second.pop_front();
  if (owner->second.empty()) line.owners.erase(owner);
  return first;
}

std::optional<RenderQueue::Next> RenderQueue::take(RenderKind kind) {
  Line& line = line_of(kind);
  const auto rank = [&](const auto& owner) {
    return std::make_tuple(line.shares.used_us(owner.first), owner.second.front().arrival);
  };
  const auto least =
      std::min_element(line.owners.begin(), line.owners.end(),
                       [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
  line.shares.begin(least->first);
  if (kind != RenderKind::background) kinds_.begin(number_of(kind));
  return begin(take_first(line, least), true);
}

RenderQueue::Next RenderQueue::begin(Waiting waiting, bool charged) {
  --waiting_;
  const RenderJob& job = waiting.next.job;
  running_.emplace(Running{job.kind, job.owner, job.cancel, charged, job.cost_ms, now_us_});
  return std::move(waiting.next);
}

void RenderQueue::done(std::int64_t took_us) {
  const Running ran = *running_;
  running_.reset();
  if (!ran.charged) return;
  Line& line = line_of(ran.kind);
  line.shares.charge(ran.owner, took_us, !ran.cancel.cancelled());
  if (line.owners.count(ran.owner) == 0) line.shares.rest(ran.owner);
  if (ran.kind == RenderKind::background) return;
  kinds_.charge(number_of(ran.kind), took_us);
  if (line.owners.empty()) kinds_.rest(number_of(ran.kind));
}

template <class Wanted>
RenderQueue::Load RenderQueue::sum(double unknown_ms, const Wanted& wanted) const {
  Load load;
  for (const auto& [owner, jobs] : lines_[number_of(RenderKind::request)].owners) {
    for (const Waiting& waiting : jobs) {
      const RenderJob& job = waiting.next.job;
      if (job.cancel.cancelled() || job.is_background_turn || !wanted(job)) continue;
      ++load.count;
      load.cost_ms += job.cost_ms > 0 ? job.cost_ms : unknown_ms;
    }
  }
  return load;
}

RenderQueue::Load RenderQueue::requests_waiting() const {
  return sum(0, [](const RenderJob&) { return true; });
}

RenderQueue::Load RenderQueue::requests_of(const std::string& payer) const {
  return sum(0, [&](const RenderJob& job) { return job.payer == payer; });
}

RenderQueue::Load RenderQueue::requests_before(const std::string& payer, double unknown_ms) const {
  std::vector<std::string_view> counted{payer};
  return sum(unknown_ms, [&](const RenderJob& job) {
    if (std::find(counted.begin(), counted.end(), job.payer) != counted.end()) return false;
    counted.emplace_back(job.payer);
    return true;
  });
}

std::size_t RenderQueue::streams_waiting() const {
  std::size_t count = 0;
  for (const auto& [owner, jobs] : lines_[number_of(RenderKind::stream)].owners) {
    count += jobs.size();
  }
  return count;
}

double RenderQueue::rest_ms(std::int64_t now_us) const {
  if (!running_ || running_->kind == RenderKind::background) return 0;
  return std::max(0.0, running_->cost_ms - static_cast<double>(now_us - running_->begun_us) / 1000);
}

void RenderQueue::cancel_all() const {
  for (const Line& line : lines_) {
    for (const auto& [owner, jobs] : line.owners) {
      for (const Waiting& waiting : jobs) waiting.next.job.cancel.cancel();
    }
  }
  if (running_) running_->cancel.cancel();
}

}  // namespace windsplat::tasks
