// One opened dataset: its fields by step, loaded on first need and shared by all who hold them.
#pragma once

#include <any>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/model/source.hpp"
#include "server/data/resident/budget.hpp"

namespace windsplat::data {

// How volumes stay in memory.
enum class Storage {
  float32,
  packed16,  // 16 bits a value beside the few that are being drawn (packed.hpp)
};

// One opened dataset. A handle: copies are the same dataset. Thread-safe.
class Dataset {
 public:
  Dataset(std::unique_ptr<Source> source, std::string id, std::uint64_t bytes_max);
  // Shares the budget of a store's other datasets.
  Dataset(std::unique_ptr<Source> source, std::string id, std::shared_ptr<Budget> budget,
          Storage storage = Storage::float32);

  [[nodiscard]] const DatasetInfo& info() const;
  // The same as long as it is held; tells datasets of one id apart.
  [[nodiscard]] std::shared_ptr<const DatasetInfo> shared_info() const;

  // The field at the step; loads it if it is not resident. What a caller holds stays valid.
  // Errors: not_found (no such field or step, or forgotten while it was read), bad_data,
  // out_of_memory, not_resident (evicted while it was read), draining (after end()).
  Result<std::shared_ptr<const Volume>> volume(const std::string& field, std::size_t step);

  // The field at the step, coarser: averaged once on first need, shared and counted in the memory
  // limit like the volume itself, which need not stay resident for it. One that asks while another
  // averages waits for it. Nothing halved: the volume itself. Errors: those of volume();
  // out_of_memory also where there is room for the volume but not for its level beside it.
  Result<std::shared_ptr<const Volume>> level(const std::string& field, std::size_t step,
                                              const Coarsening& how);

  // A handle that never loads, averages or waits: what is not there is the error not_resident.
  [[nodiscard]] Dataset resident_only() const;
  // A handle for whoever holds what it needs: found even where it was taken off the list meanwhile.
  [[nodiscard]] Dataset held() const;
  // A handle that waits for room where others hold it (Budget::get(), in_turn). For one thread at a
  // time of all datasets that share a budget: one after the other has all that it needs. `cancel`
  // ends its waits for room, with the error cancelled.
  [[nodiscard]] Dataset in_turn(const CancelToken& cancel = {}) const;
  // A handle for what is not needed yet: it gives way to loads that somebody waits for, and evicts
  // nothing that is wished for.
  [[nodiscard]] Dataset prefetching() const;
  // So many bytes of work beside the volumes count in the limit for as long as the answer is held.
  // A handle in_turn() waits for room; others get what is there beside one that waits. Errors:
  // out_of_memory, cancelled.
  [[nodiscard]] Result<std::shared_ptr<const void>> reserve(std::uint64_t bytes) const;
  // Under which keys level() keeps its answer and what that is made of; none: no such field or
  // step.
  [[nodiscard]] std::vector<ResidentKey> keys_of(const std::string& field, std::size_t step,
                                                 const Coarsening& how) const;

  // What a caller derived from this dataset and would be slow to derive again: one value, replaced
  // by the next. Empty unless it was kept under this key.
  [[nodiscard]] std::any kept(const std::string& key) const;
  void keep(std::string key, std::any value);

  // A few numbers that follow from the data and whatever `key` names: made at most once while they
  // are remembered, which the last 256 keys are, so that what they were made of need not stay
  // resident. A failure is not remembered.
  Result<std::vector<double>> remembered(const std::string& key,
                                         const std::function<Result<std::vector<double>>()>& make);

  // Drops what nobody holds, ends a load in work.
  void evict();
  // The same of a dataset that is on the list no more.
  void forget();

  // From now on nothing is read: who asks gets draining. Ends a load in work, unless it is just
  // beginning: loading() tells.
  void end();

  // Lets the source give back what it keeps between reads if none was for so long.
  void release_idle(double idle_s);

  // Range and masked count of a field at a step that was ever loaded; none: it was not.
  struct Seen {
    std::array<float, 2> range{};
    std::int64_t masked = 0;
  };
  [[nodiscard]] std::optional<Seen> seen(const std::string& field, std::size_t step) const;

  struct Counts {
    std::uint64_t loads = 0;       // volumes read from the source
    std::uint64_t prefetched = 0;  // of these, before anyone asked
    std::uint64_t averages = 0;    // levels averaged
    std::uint64_t unpacked = 0;    // volumes had from their packed form
    std::uint64_t failures = 0;    // reads that failed
  };
  [[nodiscard]] Counts counts() const;
  [[nodiscard]] std::uint64_t resident_bytes() const;
  [[nodiscard]] std::uint64_t loads() const { return counts().loads; }
  [[nodiscard]] std::uint64_t averages() const { return counts().averages; }

  // The read in work, for whoever waits for it.
  struct Loading {
    std::string field;
    std::size_t step = 0;
    double done = 0;  // 0 to 1
  };
  [[nodiscard]] std::optional<Loading> loading() const;

  // Errors: out_of_memory, where one of the fields cannot be loaded at a step, not even alone: with
  // what all of them need, and the limit that would do.
  [[nodiscard]] Result<void> check_room(const std::vector<std::string>& fields) const;
  // Of a message, where the limit leaves no room for these fields together at a step: "; ..." with
  // what they need and the limit that would do. Empty where it does, and where nobody can raise it.
  [[nodiscard]] std::string beyond_limit(const std::vector<std::string>& fields) const;
  // The same behind an error for want of memory; others as they are.
  [[nodiscard]] Error with_need(Error error, const std::vector<std::string>& fields) const;

  // Counts what is known of the dataset, steps and places, in the memory limit too, where that is
  // more than a megabyte. Errors: out_of_memory.
  Result<void> charge_info();

  [[nodiscard]] Storage storage() const;
  // The most that a resident value of a field may err by being packed, in the units of its worst
  // component; 0 for float32.
  [[nodiscard]] float storage_error(const std::string& field) const;

 private:
  enum class Manner { in_turn, demand, held, resident_only, prefetch };
  struct State;
  Dataset(std::shared_ptr<State> state, Manner manner)
      : state_(std::move(state)), manner_(manner) {}

  [[nodiscard]] Urgency urgency() const;
  [[nodiscard]] Resident find_held(const ResidentKey& key) const;
  Result<std::shared_ptr<const Volume>> get(const ResidentKey& key, std::uint64_t bytes,
                                            const Budget::Make& make);

  std::shared_ptr<State> state_;
  Manner manner_ = Manner::demand;
  std::shared_ptr<OwnPins> own_;       // of in_turn: what it gave
  std::optional<CancelToken> cancel_;  // of in_turn
};

}  // namespace windsplat::data
