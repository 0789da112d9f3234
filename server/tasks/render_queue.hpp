// Scheduling of the renderer as a pure state machine: jobs and their run times in, the next job
// out. Has no thread, lock or clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>

#include "server/base/cancel.hpp"

namespace windsplat::tasks {

enum class RenderKind {
  stream,      // frames of sessions
  request,     // pictures requested over HTTP
  background,  // work without a waiting client: runs while the renderer is otherwise idle
};

struct RenderJob {
  RenderKind kind = RenderKind::request;
  std::uint64_t owner = 0;  // session or connection; jobs of one owner run in order
  CancelToken
      cancel;  // raised by the submitter, by cancel_all(), or when another job takes precedence
  // Called exactly once, cancelled or not, on the renderer's thread. Must not throw.
  std::function<void(std::int64_t queue_us)> run;
  bool admitted = false;      // continues a request that was admitted before: never refused
  double cost_ms = 0;         // estimate; 0: unknown
  std::string payer = {};     // address charged with the time; empty: none
  std::int64_t spent_us = 0;  // time of other threads for this job, charged with it
  // A request that is background work in its turn: it interrupts no other background work, and
  // nobody is refused because of it.
  bool is_background_turn = false;
};

// Usage of a shared resource by several parties. A party that becomes active again starts at the
// virtual time of the party being served, so that idle time earns no credit (start-time fair
// queueing: Goyal, Vin, Cheng 1997). The excess of a charge over the mean of the earlier ones is
// paid in parts, with each later charge one of `parts` of what is owed, so that one long job does
// not keep a party waiting for as many turns.
class Shares {
 public:
  Shares() = default;
  explicit Shares(std::int64_t parts) : parts_(parts) {}
  void come(std::uint64_t party);  // becomes active; cannot fail after expect()
  void expect(std::uint64_t party) { parties_[party]; }  // allocates ahead for come()
  void rest(std::uint64_t party);                        // becomes idle
  void begin(std::uint64_t party);
  // whole: not cancelled, so that it counts in the mean.
  void charge(std::uint64_t party, std::int64_t us, bool whole = true);
  [[nodiscard]] std::int64_t used_us(std::uint64_t party) const;
  [[nodiscard]] std::size_t known() const { return parties_.size(); }

 private:
  struct Party {
    std::int64_t used_us = 0;
    std::int64_t owed_us = 0;  // charged, not yet paid
    std::int64_t mean_us = 0;  // of recent charges; 0: none
    bool active = false;
  };
  std::int64_t parts_ = 1;
  std::map<std::uint64_t, Party> parties_;  // idle parties are kept only while their usage is above
                                            // the virtual time
  std::int64_t present_us_ = 0;
};

// Streams and requests share the renderer's time equally while both have jobs, and so do the owners
// within a kind: the next job is that of the owner with the least usage, then the earliest.
// Background jobs run when no other job waits. A running one is cancelled when another job arrives.
// An owner has at most one waiting background job: a newer one replaces it, and the cancelled one
// runs before all others so that its submitter is notified. The next job of an owner also runs
// first once it is cancelled, since it costs almost nothing.
class RenderQueue {
 public:
  struct Next {
    RenderJob job;
    std::int64_t since_us = 0;
  };

  // Strong exception guarantee if an allocation fails.
  void push(RenderJob job, std::int64_t now_us);
  // The job to run now, at the time from which rest_ms() counts. Call done() before the next.
  // nullopt: the queue is empty.
  std::optional<Next> pop(std::int64_t now_us = 0);
  void done(std::int64_t took_us);

  [[nodiscard]] bool empty() const { return waiting_ == 0; }
  // Waiting requests that are not cancelled; cancelled ones cost almost nothing.
  struct Load {
    std::size_t count = 0;
    double cost_ms = 0;
  };
  [[nodiscard]] Load requests_waiting() const;
  [[nodiscard]] Load requests_of(const std::string& payer) const;
  // Jobs that run before a new one of the payer: one of each other payer, since payers take turns.
  // A job of unknown cost counts as `unknown_ms`.
  [[nodiscard]] Load requests_before(const std::string& payer, double unknown_ms) const;
  [[nodiscard]] std::size_t streams_waiting() const;
  // Remaining estimated time of the running job.
  [[nodiscard]] double rest_ms(std::int64_t now_us) const;
  void cancel_all() const;  // waiting and running jobs

 private:
  struct Waiting {
    Next next;
    std::uint64_t arrival = 0;
  };
  using Jobs = std::list<Waiting>;  // jobs move between lists without allocation
  using Owners = std::map<std::uint64_t, Jobs>;
  struct Line {
    Owners owners;  // no list is empty
    Shares shares;
  };
  struct Running {
    RenderKind kind = RenderKind::request;
    std::uint64_t owner = 0;
    CancelToken cancel;
    bool charged = true;
    double cost_ms = 0;
    std::int64_t begun_us = 0;
  };

  [[nodiscard]] Line& line_of(RenderKind kind) { return lines_[static_cast<std::size_t>(kind)]; }
  [[nodiscard]] std::optional<RenderKind> next_kind() const;
  std::optional<Next> take(RenderKind kind);
  std::optional<Next> take_cancelled();
  static Waiting take_first(Line& line, Owners::iterator owner);
  Next begin(Waiting waiting, bool charged);
  template <class Wanted>
  [[nodiscard]] Load sum(double unknown_ms, const Wanted& wanted) const;

  std::array<Line, 3> lines_{{{{}, Shares(8)}, {}, {}}};  // per kind; streams pay in parts
  Shares kinds_;                                          // streams against requests
  Jobs replaced_;
  std::optional<Running> running_;
  std::uint64_t arrivals_ = 0;
  std::int64_t now_us_ = 0;  // start of the last job
  std::size_t waiting_ = 0;
};

}  // namespace windsplat::tasks
