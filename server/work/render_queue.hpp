// Whose job the renderer runs next, as a pure state machine: jobs and the times they took in, the
// next job out. It owns no thread, lock or clock.
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

namespace windsplat::net {

enum class RenderKind {
  stream,      // frames of sessions
  request,     // pictures that were asked for by HTTP
  background,  // what nobody waits for: runs while there is nothing else to do
};

struct RenderJob {
  RenderKind kind = RenderKind::request;
  std::uint64_t owner = 0;  // session or connection; jobs of one owner run in order
  CancelToken cancel;       // raised from outside, by cancel_all(), or for a job that goes first
  // Runs once, cancelled or not, on the renderer's thread. Must not throw.
  std::function<void(std::int64_t queue_us)> run;
  bool admitted = false;   // the rest of a request that was let in before: never refused
  double cost_ms = 0;      // as far as it can be told before; 0: unknown
  std::string payer = {};  // the address that its time is charged to; empty: nobody's
};

// How much each of several parties has used of something they share. One that comes back starts
// with what the one served at present had used when its turn came: its rest gives it nothing to
// take all later with (start-time fair queueing: Goyal, Vin, Cheng 1997).
class Shares {
 public:
  void come(std::uint64_t party);  // it has something to do; after expect() it cannot fail
  void expect(std::uint64_t party) { parties_[party]; }  // memory for it to come
  void rest(std::uint64_t party);                        // it has nothing to do any more
  void begin(std::uint64_t party);
  void charge(std::uint64_t party, std::int64_t us) { parties_[party].used_us += us; }
  [[nodiscard]] std::int64_t used_us(std::uint64_t party) const;
  [[nodiscard]] std::size_t known() const { return parties_.size(); }

 private:
  struct Party {
    std::int64_t used_us = 0;
    bool active = false;
  };
  std::map<std::uint64_t, Party> parties_;  // those that are idle only while they are ahead
  std::int64_t present_us_ = 0;
};

// Streams and requests share the renderer's time equally while both have something to do, and so do
// the owners within a kind: next is whoever used least, then whoever came first. Background jobs
// run when nothing of the others waits; one that runs is cancelled when such a job comes, and an
// owner has one of them waiting at most: a newer one takes its place, and the older one, cancelled,
// runs before all others so that whoever gave it is told. So does the next job of an owner once it
// is cancelled: it costs next to nothing.
class RenderQueue {
 public:
  struct Next {
    RenderJob job;
    std::int64_t since_us = 0;
  };

  // Where memory fails for it, nothing has changed.
  void push(RenderJob job, std::int64_t now_us);
  // The job to run now, at the time that rest_ms() counts from; done() before the next. None:
  // nothing waits.
  std::optional<Next> pop(std::int64_t now_us = 0);
  void done(std::int64_t took_us);

  [[nodiscard]] bool empty() const { return waiting_ == 0; }
  // Requests whose answer somebody still waits for; the others cost next to nothing.
  struct Load {
    std::size_t count = 0;
    double cost_ms = 0;
  };
  [[nodiscard]] Load requests_waiting() const;
  [[nodiscard]] Load requests_of(const std::string& payer) const;
  // Those that come before a new one of the payer's: one of each other payer, since they take
  // turns; one of unknown cost is taken for `unknown_ms`.
  [[nodiscard]] Load requests_before(const std::string& payer, double unknown_ms) const;
  // Of the job that runs, as far as its cost was known.
  [[nodiscard]] double rest_ms(std::int64_t now_us) const;
  void cancel_all() const;  // what waits and what runs

 private:
  struct Waiting {
    Next next;
    std::uint64_t arrival = 0;
  };
  using Jobs = std::list<Waiting>;  // which moves from one to another without memory
  using Owners = std::map<std::uint64_t, Jobs>;
  struct Line {
    Owners owners;  // none of them empty
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

  std::array<Line, 3> lines_;  // by kind
  Shares kinds_;               // streams against requests
  Jobs replaced_;
  std::optional<Running> running_;
  std::uint64_t arrivals_ = 0;
  std::int64_t now_us_ = 0;  // when a job was last given out
  std::size_t waiting_ = 0;
};

}  // namespace windsplat::net
