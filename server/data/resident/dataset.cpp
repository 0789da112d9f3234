// Volumes of one dataset: cached in the budget, or read, unpacked or reduced into it.
#include "server/data/resident/dataset.hpp"

#include <algorithm>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <utility>

#include "server/base/log.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/model/digest.hpp"
#include "server/data/model/packed.hpp"
#include "server/data/resident/sizes.hpp"
#include "server/data/resident/turnstile.hpp"

namespace windsplat::data {

namespace {

using VolumePtr = std::shared_ptr<const Volume>;

constexpr std::size_t remembered_max = 256;

Result<VolumePtr> as_volume(const Result<Resident>& kept) {
  if (!kept) return kept.error();
  return std::static_pointer_cast<const Volume>(*kept);
}

// Runs a function that makes a volume; exceptions become errors.
template <class Make>
Result<Resident> guarded(const FieldInfo& field, const Make& make) {
  try {
    Result<Volume> volume = make();
    if (!volume) {
      return volume.error();
    }
    return Resident(std::make_shared<const Volume>(std::move(*volume)));
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory,
                      "the machine has no memory left for " + in_quotes(field.name));
  } catch (const std::exception& fault) {
    // The text of an internal error is logged only, because it may contain source locations.
    log::error("loading failed", {{"field", field.name}, {"fault", fault.what()}});
    return make_error(ErrorKind::internal, "loading " + in_quotes(field.name) + " failed");
  }
}

}  // namespace

struct Dataset::State {
  State(std::unique_ptr<Source> from, std::string id, std::shared_ptr<Budget> shared, Storage how)
      : source(std::move(from)),
        info(source->info()),
        budget(std::move(shared)),
        owner(budget->next_owner()),
        charged(budget, Reservation::Term::lasting),
        storage(how) {
    info.id = std::move(id);
    source->on_progress([this](double done) {
      const std::lock_guard lock(mutex);
      if (loading) loading->done = done;
    });
  }
  ~State() { budget->forget(owner); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // Validates field and step indices. Errors: not_found.
  [[nodiscard]] Result<std::size_t> find(const std::string& field, std::size_t step) const {
    const FieldInfo* found = info.find(field);
    if (found == nullptr) {
      return make_error(ErrorKind::not_found, "dataset " + in_quotes(info.id) + " has no field " +
                                                  in_quotes(field) + absence_text(info, field));
    }
    if (step >= info.steps.size()) {
      return make_error(ErrorKind::not_found, "dataset " + in_quotes(info.id) + " has no step " +
                                                  std::to_string(step) + "; its last step is " +
                                                  std::to_string(info.steps.size() - 1));
    }
    return static_cast<std::size_t>(found - info.fields.data());
  }

  // Bytes reserved in the limit while a field is read.
  [[nodiscard]] std::uint64_t bytes_beside(std::uint64_t loader_bytes) const {
    return charged.bytes() + (info.stored_bytes > 0 ? loader_bytes : 0);
  }

  [[nodiscard]] Error not_resident(std::size_t field, std::size_t step) const {
    return make_error(ErrorKind::not_resident, in_quotes(info.fields[field].name) + " at step " +
                                                   std::to_string(step) + " is not in memory yet");
  }

  // Reads the volume from its source, or unpacks it.
  Result<Resident> load(std::size_t field, std::size_t step, Urgency urgency) {
    const ResidentKey twin{owner, field, step, packed_variant};
    if (const Resident packed = budget->find_now(twin)) {
      add(&Counts::unpacked);
      return guarded(info.fields[field], [&]() -> Result<Volume> {
        return unpack(*std::static_pointer_cast<const PackedVolume>(packed));
      });
    }
    auto volume = read(field, step, urgency);
    if (volume && storage == Storage::packed16) {
      // If the packed form does not fit too, only the volume itself is kept.
      (void)budget->get(twin, values_of(info, field) * sizeof(std::uint16_t), Urgency::prefetch,
                        [&] { return pack_volume(field, *volume); });
    }
    return volume;
  }

  Result<Resident> read(std::size_t field, std::size_t step, Urgency urgency) {
    turnstile.enter(urgency);
    {
      const std::lock_guard lock(mutex);
      if (ended) {
        turnstile.leave();
        return why_cancelled();
      }
      ++counts.loads;
      counts.prefetched += urgency == Urgency::prefetch ? 1 : 0;
      loading = Loading{info.fields[field].name, step, 0};
    }
    Reservation inputs(budget);  // of a derived field of a sample; a loader counts its own memory
    const auto held =
        inputs.resize(info.stored_bytes == 0 ? info.fields[field].chunk_bytes : 0, urgency);
    auto volume = held ? guarded(info.fields[field], [&] { return source->read(field, step); })
                       : Result<Resident>(held.error());
    {
      const std::lock_guard lock(mutex);
      loading.reset();
      if (volume) {
        const auto& read = *std::static_pointer_cast<const Volume>(*volume);
        seen[{field, step}] = {read.range, read.masked};
      } else {
        ++counts.failures;
        if (volume.error().kind == ErrorKind::cancelled) volume = why_cancelled();
      }
    }
    turnstile.leave();
    budget->count_read(volume.has_value());
    return volume;
  }

  // The error of a read cancelled by end(), forget() or evict(), for its callers. Called with the
  // mutex held.
  [[nodiscard]] Error why_cancelled() const {
    if (ended) return make_error(ErrorKind::draining, "the server is shutting down");
    if (forgotten) {
      return make_error(ErrorKind::not_found,
                        "dataset " + in_quotes(info.id) + " was removed while it was read");
    }
    return make_error(ErrorKind::not_resident, "the memory of dataset " + in_quotes(info.id) +
                                                   " was released while it was read; try again");
  }

  Result<Resident> pack_volume(std::size_t field, const Resident& volume) {
    auto packed = pack(*std::static_pointer_cast<const Volume>(volume));
    if (!packed) {
      return make_error(ErrorKind::invalid, "the range of values is too large for packing");
    }
    const std::lock_guard lock(mutex);
    for (int c = 0; c < packed->components; ++c) {
      errors[field] = std::max(errors[field], packed->error(c));
    }
    return Resident(std::make_shared<const PackedVolume>(std::move(*packed)));
  }

  void add(std::uint64_t Counts::*count) {
    const std::lock_guard lock(mutex);
    ++(counts.*count);
  }

  std::unique_ptr<Source> source;
  DatasetInfo info;
  std::shared_ptr<Budget> budget;
  const std::uint64_t owner;
  Reservation charged;  // memory of the info
  const Storage storage;
  Turnstile turnstile;  // guards the source

  mutable std::mutex mutex;  // guards all members below
  Counts counts;
  std::optional<Loading> loading;
  bool ended = false;
  bool forgotten = false;
  std::map<std::pair<std::size_t, std::size_t>, Seen> seen;  // keyed by field and step
  std::map<std::size_t, float> errors;                       // packing errors, by field
  std::deque<std::pair<std::string, std::vector<double>>> remembered;
  std::string kept_key;
  std::any kept_value;
};

Dataset::Dataset(std::unique_ptr<Source> source, std::string id, std::uint64_t bytes_max)
    : Dataset(std::move(source), std::move(id), std::make_shared<Budget>(bytes_max)) {}

Dataset::Dataset(std::unique_ptr<Source> source, std::string id, std::shared_ptr<Budget> budget,
                 Storage storage)
    : state_(
          std::make_shared<State>(std::move(source), std::move(id), std::move(budget), storage)) {}

const DatasetInfo& Dataset::info() const { return state_->info; }

std::shared_ptr<const DatasetInfo> Dataset::shared_info() const { return {state_, &state_->info}; }

Dataset Dataset::resident_only() const { return {state_, Manner::resident_only}; }

Dataset Dataset::prefetching() const { return {state_, Manner::prefetch}; }

Dataset Dataset::in_turn(const CancelToken& cancel) const {
  Dataset out(state_, Manner::in_turn);
  out.cancel_ = cancel;
  out.own_ = std::make_shared<OwnPins>();
  return out;
}

Urgency Dataset::urgency() const {
  if (manner_ == Manner::in_turn) return Urgency::in_turn;
  return manner_ == Manner::prefetch ? Urgency::prefetch : Urgency::demand;
}

Result<Resident> Dataset::get(const ResidentKey& key, std::uint64_t bytes,
                              const Budget::Make& make) {
  auto kept = state_->budget->get(key, bytes, urgency(), make, own_ ? *own_ : OwnPins(),
                                  cancel_ ? &*cancel_ : nullptr);
  if (kept && own_) own_->insert(kept->get());
  return kept;
}

Result<VolumePtr> Dataset::volume(const std::string& field, std::size_t step) {
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) return index.error();
  const ResidentKey key{state_->owner, *index, step, ""};
  if (manner_ == Manner::resident_only) {
    const Resident there = state_->budget->find_now(key);
    return there ? as_volume(there) : state_->not_resident(*index, step);
  }
  return as_volume(get(key, values_of(state_->info, *index) * sizeof(float),
                       [&] { return state_->load(*index, step, urgency()); }));
}

Result<VolumePtr> Dataset::level(const std::string& field, std::size_t step,
                                 const Coarsening& how) {
  return derived(field, step, reduction(field, how));
}

Derivation Dataset::reduction(const std::string& field, const Coarsening& how) const {
  if (how.halvings == std::array{0, 0, 0}) return {};
  return {digest_of(data::key_of(how)), level_bytes(field, how),
          [state = state_, how](const Volume& fine) {
            state->add(&Counts::levels);
            return coarsen(fine, how);
          }};
}

Result<VolumePtr> Dataset::derived(const std::string& field, std::size_t step,
                                   const Derivation& how) {
  if (how.variant.empty()) return volume(field, step);
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) return index.error();
  const ResidentKey key{state_->owner, *index, step, how.variant};
  if (manner_ == Manner::resident_only) {
    const Resident there = state_->budget->find_now(key);
    return there ? as_volume(there) : state_->not_resident(*index, step);
  }
  if (const auto there = state_->budget->find(key)) {
    if (*there && own_) own_->insert((*there)->get());
    return as_volume(*there);
  }
  // Keep references, so that no volume is evicted before the result is computed from it.
  std::vector<VolumePtr> others;
  const auto fine = inputs(field, step, how, others);
  if (!fine) return fine.error();
  const auto made = get(key, how.bytes, [&] {
    return guarded(state_->info.fields[*index], [&]() -> Result<Volume> {
      return how.others.empty() ? how.make(**fine) : how.make_with(**fine, others);
    });
  });
  // The volume is not yet shared.
  if (own_) own_->erase(own_->find(fine->get()));
  for (const VolumePtr& other : others) {
    if (own_) own_->erase(own_->find(other.get()));
  }
  return as_volume(made);
}

// What a volume is computed from: that of its own field, and those of others.
Result<VolumePtr> Dataset::inputs(const std::string& field, std::size_t step, const Derivation& how,
                                  std::vector<VolumePtr>& others) {
  for (const auto& [other, its] : how.others) {
    auto one = its ? derived(other, step, *its) : volume(other, step);
    if (!one) return one;
    others.push_back(std::move(*one));
  }
  return how.from ? derived(field, step, *how.from) : volume(field, step);
}

Result<Resident> Dataset::auxiliary(const std::string& variant, std::uint64_t bytes,
                                    const std::function<Resident()>& make) {
  const ResidentKey key = auxiliary_key(variant);
  if (manner_ == Manner::resident_only) {
    Resident there = state_->budget->find_now(key);
    if (there) return there;
    return make_error(ErrorKind::not_resident, "a part of the view is not in memory yet");
  }
  return get(key, bytes, [&]() -> Result<Resident> { return make(); });
}

ResidentKey Dataset::auxiliary_key(const std::string& variant) const {
  return {state_->owner, no_field, 0, variant};
}

std::uint64_t Dataset::level_bytes(const std::string& field, const Coarsening& how) const {
  const DatasetInfo& info = state_->info;
  const Result<std::size_t> index = state_->find(field, 0);
  if (!index) return 0;
  auto components = static_cast<int>(info.fields[*index].components.size());
  const bool whole = how.halvings == std::array{0, 0, 0};
  if (!whole) components = reduced_components(components, how.reduction);
  std::uint64_t bytes = sizeof(float) * static_cast<std::uint64_t>(components);
  for (std::size_t a = 0; a < 3; ++a) {
    bytes *= static_cast<std::uint64_t>(halved(info.grid.dims()[a], how.halvings[a]));
  }
  return bytes;
}

bool Dataset::is_within_limit(std::uint64_t bytes) const {
  return bytes + state_->bytes_beside(loader_bytes_min) <= state_->budget->bytes_max();
}

Result<std::shared_ptr<const void>> Dataset::reserve(std::uint64_t bytes) const {
  const auto held = std::make_shared<Reservation>(state_->budget);
  const auto taken =
      held->take(bytes, urgency(), own_ ? *own_ : OwnPins(), cancel_ ? &*cancel_ : nullptr);
  if (!taken) return taken.error();
  return std::shared_ptr<const void>(held);
}

std::optional<ResidentKey> Dataset::key_of(const std::string& field, std::size_t step,
                                           const Derivation& how) const {
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) return std::nullopt;
  return ResidentKey{state_->owner, *index, step, how.variant};
}

std::any Dataset::kept(const std::string& key) const {
  const std::lock_guard lock(state_->mutex);
  return state_->kept_key == key ? state_->kept_value : std::any();
}

void Dataset::keep(std::string key, std::any value) {
  const std::lock_guard lock(state_->mutex);
  state_->kept_key = std::move(key);
  state_->kept_value = std::move(value);
}

Result<std::vector<double>> Dataset::remembered(
    const std::string& key, const std::function<Result<std::vector<double>>()>& make) {
  {
    const std::lock_guard lock(state_->mutex);
    for (const auto& [known, numbers] : state_->remembered) {
      if (known == key) return numbers;
    }
  }
  auto numbers = make();
  if (numbers) {
    const std::lock_guard lock(state_->mutex);
    state_->remembered.emplace_back(key, *numbers);
    if (state_->remembered.size() > remembered_max) state_->remembered.pop_front();
  }
  return numbers;
}

void Dataset::evict() {
  state_->source->cancel();
  state_->budget->evict(state_->owner);
}

void Dataset::forget() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->forgotten = true;
  }
  evict();
}

void Dataset::end() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->ended = true;
  }
  state_->source->cancel();
}

void Dataset::release_idle(double idle_s) {
  if (!state_->turnstile.enter_if_idle(idle_s)) return;
  state_->source->release();
  state_->turnstile.leave();
}

std::optional<Dataset::Seen> Dataset::seen(const std::string& field, std::size_t step) const {
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) return std::nullopt;
  const std::lock_guard lock(state_->mutex);
  const auto found = state_->seen.find({*index, step});
  return found == state_->seen.end() ? std::nullopt : std::optional(found->second);
}

Dataset::Counts Dataset::counts() const {
  const std::lock_guard lock(state_->mutex);
  return state_->counts;
}

std::uint64_t Dataset::resident_bytes() const {
  return state_->budget->bytes_of(state_->owner) + state_->charged.bytes();
}

std::optional<Dataset::Loading> Dataset::loading() const {
  const std::lock_guard lock(state_->mutex);
  return state_->loading;
}

Result<void> Dataset::check_room(const std::vector<std::string>& fields) const {
  for (const std::string& field : fields) {
    const std::uint64_t bytes = bytes_at_a_step(state_->info, {field});
    if (is_within_limit(bytes)) continue;
    return make_error(ErrorKind::out_of_memory, in_quotes(field) + " needs " + megabytes(bytes) +
                                                    " at a step; " + state_->budget->limit_text() +
                                                    beyond_limit(fields));
  }
  return {};
}

std::string Dataset::beyond_limit(const std::vector<std::string>& fields) const {
  const Budget& budget = *state_->budget;
  const std::uint64_t bytes = bytes_at_a_step(state_->info, fields);
  const std::uint64_t all = bytes + state_->bytes_beside(reading_bytes(state_->info, fields));
  if (all <= budget.bytes_max() || !budget.name().raised) return "";
  std::string text = "; ";
  if (fields.size() > 1) {
    for (std::size_t i = 0; i < fields.size(); ++i) {
      text += i == 0 ? "" : i + 1 < fields.size() ? ", " : " and ";
      text += in_quotes(fields[i]);
    }
    text += " need " + megabytes(bytes) + " together: ";
  }
  return text + budget.name().raised(all) + " would suffice";
}

Error Dataset::with_need(Error error, const std::vector<std::string>& fields) const {
  if (error.kind == ErrorKind::out_of_memory) error.message += beyond_limit(fields);
  return error;
}

Result<void> Dataset::charge_info() {
  constexpr std::uint64_t free_bytes = std::uint64_t{1} << 20;
  constexpr std::uint64_t copies = 2;  // the source has a copy
  const std::uint64_t bytes = copies * bytes_of(state_->info);
  if (bytes <= free_bytes) return {};
  return state_->charged.resize(bytes);
}

Storage Dataset::storage() const { return state_->storage; }

float Dataset::storage_error(const std::string& field) const {
  const Result<std::size_t> index = state_->find(field, 0);
  if (!index) return 0;
  const std::lock_guard lock(state_->mutex);
  const auto found = state_->errors.find(*index);
  return found == state_->errors.end() ? 0 : found->second;
}

}  // namespace windsplat::data
