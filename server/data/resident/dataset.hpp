// One opened dataset: its fields by step, loaded on first need and shared by all users.
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
#include "server/data/model/box.hpp"
#include "server/data/model/box_grid.hpp"
#include "server/data/model/coarsen.hpp"
#include "server/data/model/source.hpp"
#include "server/data/model/stored.hpp"
#include "server/data/resident/budget.hpp"

namespace windsplat::data {

// How volumes stay in memory.
enum class Storage {
  float32,
  packed16,  // 16 bits per value, unpacked for rendering (packed.hpp)
};

struct GatheredBoxes;

// A volume that is computed from a field at a step; by default the field itself.
struct Derivation {
  std::string variant;      // identifies it among those of the field; empty: the field itself
  std::uint64_t bytes = 0;  // of the volume
  std::function<Volume(const Volume&)> make;
  // What it is computed from in place of the field; null: the field.
  std::shared_ptr<const Derivation> from = nullptr;
  // Other fields at the same step, or what is derived from them, from which it is computed too, by
  // make_with() in place of make().
  struct Input {
    std::string field;
    std::shared_ptr<const Derivation> how;
  };
  std::vector<Input> others = {};
  std::function<Volume(const Volume&, const std::vector<std::shared_ptr<const Volume>>& others)>
      make_with = nullptr;
  // The source has the result stored: it is read, and neither made nor are its inputs loaded.
  std::optional<StoredPart> stored = std::nullopt;
  // The result is that of a grid of boxes, each of which is read, made or, from what is resident,
  // copied.
  std::shared_ptr<const GatheredBoxes> gathered = nullptr;
};

struct GatheredBoxes {
  BoxGrid grid;  // the variant of the whole ends with its key
  // What yields the n-th of BoxGrid::boxes(): stored, or made from what is stored. Their variants
  // are those of the whole, and end with the keys of their boxes.
  std::function<Derivation(std::size_t n)> part;
};

// One opened dataset. A handle: copies refer to the same dataset. Thread-safe.
class Dataset {
 public:
  Dataset(std::unique_ptr<Source> source, std::string id, std::uint64_t bytes_max);
  // Shares the budget with the other datasets of a store.
  Dataset(std::unique_ptr<Source> source, std::string id, std::shared_ptr<Budget> budget,
          Storage storage = Storage::float32);

  [[nodiscard]] const DatasetInfo& info() const;
  // Unique among the handles in existence; distinguishes successive datasets with one id.
  [[nodiscard]] std::shared_ptr<const DatasetInfo> shared_info() const;

  // The field at the step; loads it if it is not resident. Volumes held by a caller stay valid.
  // Errors: not_found (no such field or step, or removed during the read), bad_data, out_of_memory,
  // not_resident (evicted during the read), draining (after end()).
  Result<std::shared_ptr<const Volume>> volume(const std::string& field, std::size_t step);

  // The samples of a box: read without the others, or copied if the volume is resident. They are
  // kept under a key of their own, and evicted before volumes. Errors: those of volume(); invalid:
  // a box beyond the grid, or a field that is not read by boxes (reads_apart()).
  Result<std::shared_ptr<const Volume>> part(const std::string& field, std::size_t step,
                                             const Box& box);
  // Whether every `layer_stride`-th layer of these boxes is better read by part() than with the
  // volume, which is not resident: the volume does not fit into the memory limit, or costs far more
  // to read than these boxes and those read of it before. Never for a field that is not read by
  // boxes.
  [[nodiscard]] bool reads_apart(const std::string& field, std::size_t step,
                                 const std::vector<Box>& boxes, int layer_stride = 1) const;
  // Whether samples of a field can be read within the memory limit: its volume, or boxes.
  [[nodiscard]] bool reads_within_limit(const std::string& field) const;

  // The field at the step, reduced to a coarser level on first need. The level is shared and
  // counts towards the memory limit; the volume itself need not stay resident for it. Concurrent
  // callers wait for one computation. Level zero is the volume itself. Errors: those of volume();
  // out_of_memory also if there is room for the volume but not for its level in addition.
  Result<std::shared_ptr<const Volume>> level(const std::string& field, std::size_t step,
                                              const Coarsening& how);

  // The same for any volume that is computed from the field.
  Result<std::shared_ptr<const Volume>> derived(const std::string& field, std::size_t step,
                                                const Derivation& how);
  // The computation of level() from the field, or from what is derived from it.
  [[nodiscard]] Derivation reduction(const std::string& field, const Coarsening& how) const;
  // The same by what the source has stored: the level itself, or the middles of kernels from which
  // it is drawn. It has the bits of reduction(). nullopt: neither is stored.
  [[nodiscard]] std::optional<Derivation> stored_reduction(const std::string& field,
                                                           const Coarsening& how) const;
  [[nodiscard]] bool has(const std::string& field, std::size_t step, const Derivation& how) const;
  // Boxes, and grids of boxes, of which what `how` yields of `box` is resident, as their variants
  // end with their keys.
  [[nodiscard]] std::vector<HeldPart> resident_parts(const std::string& field, std::size_t step,
                                                     const Derivation& how, const Box& box) const;
  // Bytes of what a reduction of a field is computed from: by stored_reduction(), or by reduction()
  // if there is none.
  [[nodiscard]] std::uint64_t bytes_beside_level(const std::string& field,
                                                 const Coarsening& how) const;
  // Bytes of the least of a field that can be drawn: of its coarsest stored level, or those of
  // loading_bytes().
  [[nodiscard]] std::uint64_t least_bytes(const std::string& field) const;
  // Whether the fields at full detail fit into the memory limit together, beside a loader that
  // reads them.
  [[nodiscard]] bool fits_in_full(const std::vector<std::string>& fields) const;
  // Whether that much fits into the memory limit beside a loader that reads the fields.
  [[nodiscard]] bool fits_beside_loader(std::uint64_t bytes,
                                        const std::vector<std::string>& fields) const;
  // What the memory limit leaves beside a loader that reads boxes of the fields, in bytes.
  [[nodiscard]] std::uint64_t room_beside_boxes(const std::vector<std::string>& fields) const;
  // Whether that much fits into it.
  [[nodiscard]] bool fits_beside_boxes(std::uint64_t bytes,
                                       const std::vector<std::string>& fields) const;

  // The result of make(), which takes `bytes` bytes and follows from the description of the dataset
  // and `variant`: computed on first need, shared, counted and evicted like a level. A make() that
  // another caller cancelled is called again. Errors: out_of_memory, not_resident, those of make().
  Result<Resident> auxiliary(const std::string& variant, std::uint64_t bytes,
                             const std::function<Result<Resident>()>& make);
  [[nodiscard]] ResidentKey auxiliary_key(const std::string& variant) const;

  // Bytes of the field at a step, reduced in that way; 0: no such field.
  [[nodiscard]] std::uint64_t level_bytes(const std::string& field, const Coarsening& how) const;
  // Whether that much fits into the memory limit beside a loader, whatever is resident now.
  [[nodiscard]] bool is_within_limit(std::uint64_t bytes) const;

  // A handle that never loads, reduces or waits: absent volumes yield the error not_resident.
  [[nodiscard]] Dataset resident_only() const;
  // The same handle for work that a raised `cancel` ends: what auxiliary() computes for it polls
  // cancellation().
  [[nodiscard]] Dataset cancelled_by(const CancelToken& cancel) const;
  // That of cancelled_by() or in_turn(), otherwise one that is never raised.
  [[nodiscard]] CancelToken cancellation() const { return cancel_ ? *cancel_ : CancelToken(); }

  // A handle that waits for room used by others (Budget::get(), in_turn). Only one thread at a
  // time, among all datasets that share a budget, so that each gets all the room it needs. `cancel`
  // ends its waits for room with the error cancelled.
  [[nodiscard]] Dataset in_turn(const CancelToken& cancel = {}) const;
  // A handle for prefetching: it gives precedence to demanded loads and does not evict volumes with
  // prefetch requests.
  [[nodiscard]] Dataset prefetching() const;

  // A handle whose fields are those of this dataset minus those of `other`, at its step `step`
  // (empty: at the same step). Differences are kept like levels, and inputs are loaded as the
  // handle loads. Errors: invalid (different grids; `step` beyond the last).
  [[nodiscard]] Result<Dataset> minus(const Dataset& other, std::optional<std::size_t> step) const;
  // What a handle subtracts.
  struct Subtrahend {
    std::shared_ptr<const DatasetInfo> info;
    std::optional<std::size_t> step;  // empty: the same step
  };
  [[nodiscard]] std::optional<Subtrahend> subtrahend() const;  // nullopt: fields are as loaded
  // The handle without the difference.
  [[nodiscard]] Dataset minuend() const;
  // Changes whenever the data of the handle may have changed.
  [[nodiscard]] std::string digest() const;
  // Bytes of all volumes that are held at once while a field at a step is loaded; 0: no such field.
  [[nodiscard]] std::uint64_t loading_bytes(const std::string& field) const;

  // Reserves `bytes` of working memory in addition to the volumes while the result exists. A handle
  // in_turn() waits for room; meanwhile others get only the room that it does not need. Errors:
  // out_of_memory, cancelled.
  [[nodiscard]] Result<std::shared_ptr<const void>> reserve(std::uint64_t bytes) const;
  // The key under which derived() stores its result; nullopt: no such field or step.
  [[nodiscard]] std::optional<ResidentKey> key_of(const std::string& field, std::size_t step,
                                                  const Derivation& how) const;

  // A single cached value that is derived from this dataset and slow to recompute; a new value
  // replaces the last. Empty unless stored under this key.
  [[nodiscard]] std::any kept(const std::string& key) const;
  void keep(std::string key, std::any value);

  // A few numbers derived from the data and identified by `key`: computed once and cached (the last
  // 256 keys), so that the volumes need not stay resident. Failures are not cached. While a thread
  // computes them, others wait for the result, and compute it if that one fails; a handle that is
  // resident_only() does not wait, and what one in_turn() computes is not waited for. Errors: those
  // of `make`; cancelled, by cancellation() during the wait; not_resident.
  Result<std::vector<double>> remembered(const std::string& key,
                                         const std::function<Result<std::vector<double>>()>& make);

  // Drops unreferenced volumes and cancels a running load.
  void evict();
  // The same for a dataset that is no longer listed.
  void forget();

  // Ends reading: later calls return draining. Cancels a running load, unless it is just starting;
  // see loading().
  void end();

  // Frees the read caches of the source if nothing was read for `idle_s`.
  void release_idle(double idle_s);

  // Range and masked count of a field at a step that was loaded before, or that the source has
  // stored; nullopt: never loaded.
  struct Seen {
    std::array<float, 2> range{};
    std::int64_t masked = 0;
  };
  [[nodiscard]] std::optional<Seen> seen(const std::string& field, std::size_t step) const;

  struct Counts {
    std::uint64_t loads = 0;       // volumes read from the source
    std::uint64_t prefetched = 0;  // number of loads before the first request
    std::uint64_t levels = 0;      // levels computed
    std::uint64_t unpacked = 0;    // volumes restored from their packed form
    std::uint64_t failures = 0;    // reads that failed
  };
  [[nodiscard]] Counts counts() const;
  [[nodiscard]] std::uint64_t resident_bytes() const;
  // The same of each stored level, full detail first: volumes and boxes of the fields, at all
  // steps, and the middles of kernels stored there. Differences and regions are of no level.
  [[nodiscard]] std::vector<std::uint64_t> resident_bytes_of_levels() const;
  [[nodiscard]] std::uint64_t loads() const { return counts().loads; }
  [[nodiscard]] std::uint64_t levels() const { return counts().levels; }

  // The running read, for progress reports.
  struct Loading {
    std::string field;
    std::size_t step = 0;
    double done = 0;  // fraction, 0 to 1
  };
  [[nodiscard]] std::optional<Loading> loading() const;

  // Errors: out_of_memory if one of the fields cannot be loaded at a step even alone: states the
  // memory that all of them need and the limit that would suffice.
  [[nodiscard]] Result<void> check_room(const std::vector<std::string>& fields) const;
  // Suffix of a message if the limit leaves no room for these fields together at a step: "; ..."
  // with the memory they need and the limit that would suffice. Empty if they fit, or if the limit
  // is not configurable.
  [[nodiscard]] std::string beyond_limit(const std::vector<std::string>& fields) const;
  // Appends the suffix to an out_of_memory error; other errors are unchanged.
  [[nodiscard]] Error with_need(Error error, const std::vector<std::string>& fields) const;

  // Counts metadata of the dataset (steps and positions) in the memory limit if they exceed one
  // megabyte. Errors: out_of_memory.
  Result<void> charge_info();

  [[nodiscard]] Storage storage() const;
  // The largest error of a resident value of a field due to packing, in the units of its worst
  // component; 0 for float32.
  [[nodiscard]] float storage_error(const std::string& field) const;

 private:
  enum class Manner { in_turn, demand, resident_only, prefetch };
  struct State;
  Dataset(std::shared_ptr<State> state, Manner manner)
      : state_(std::move(state)), manner_(manner) {}

  [[nodiscard]] Dataset with(Manner manner) const;
  [[nodiscard]] Urgency urgency() const;
  // Of a key: `variant` of the fields that the handle yields.
  [[nodiscard]] std::string variant_of(const std::string& variant, std::size_t step) const;
  [[nodiscard]] std::string name_of_subtrahend() const;
  Result<std::shared_ptr<const Volume>> difference(const std::string& field, std::size_t index,
                                                   std::size_t step);
  Result<Resident> get(const ResidentKey& key, std::uint64_t bytes, const Budget::Make& make);
  // The dataset that is subtracted.
  [[nodiscard]] Dataset other() const;
  // The boxes of a derivation that has them.
  Result<Volume> gather(std::size_t field, std::size_t step, const Derivation& how);
  Result<std::shared_ptr<const Volume>> inputs(const std::string& field, std::size_t step,
                                               const Derivation& how,
                                               std::vector<std::shared_ptr<const Volume>>& others);

  std::shared_ptr<State> state_;
  Manner manner_ = Manner::demand;
  std::shared_ptr<State> minus_;  // of the dataset that is subtracted; null: none
  std::optional<std::size_t> minus_step_;
  std::shared_ptr<OwnPins> own_;       // for handles in_turn(): volumes they returned
  std::optional<CancelToken> cancel_;  // for handles in_turn() or cancelled_by()
};

}  // namespace windsplat::data
