// Volumes of one dataset: cached in the budget, or read, unpacked or reduced into it.
#include "server/data/resident/dataset.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "server/data/model/digest.hpp"
#include "server/data/model/middles.hpp"
#include "server/data/resident/dataset_state.hpp"

namespace windsplat::data {

namespace {

using VolumePtr = std::shared_ptr<const Volume>;

// Whether a store that is made of the dataset would have levels of these fields.
bool may_get_levels(const DatasetInfo& info, const std::vector<std::string>& fields) {
  return info.stored == nullptr &&
         std::all_of(fields.begin(), fields.end(), [&](const std::string& name) {
           const FieldInfo* const field = info.find(name);
           return field != nullptr && !field->derived && field->is_read_by_boxes();
         });
}

}  // namespace

Dataset::Dataset(std::unique_ptr<Source> source, std::string id, std::uint64_t bytes_max)
    : Dataset(std::move(source), std::move(id), std::make_shared<Budget>(bytes_max)) {}

Dataset::Dataset(std::unique_ptr<Source> source, std::string id, std::shared_ptr<Budget> budget,
                 Storage storage)
    : state_(
          std::make_shared<State>(std::move(source), std::move(id), std::move(budget), storage)) {}

const DatasetInfo& Dataset::info() const { return state_->info; }

std::shared_ptr<const DatasetInfo> Dataset::shared_info() const { return {state_, &state_->info}; }

Dataset Dataset::with(Manner manner) const {
  Dataset out(state_, manner);
  out.minus_ = minus_;
  out.minus_step_ = minus_step_;
  return out;
}

Dataset Dataset::resident_only() const { return with(Manner::resident_only); }

Dataset Dataset::prefetching() const { return with(Manner::prefetch); }

Dataset Dataset::in_turn(const CancelToken& cancel) const {
  Dataset out = with(Manner::in_turn);
  out.cancel_ = cancel;
  out.own_ = std::make_shared<OwnPins>();
  return out;
}

Dataset Dataset::cancelled_by(const CancelToken& cancel) const {
  Dataset out = *this;
  out.cancel_ = cancel;
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
  if (minus_) return difference(field, *index, step);
  const ResidentKey key{state_->owner, *index, step, ""};
  const StoredPart whole{whole_box(state_->info.grid.dims())};
  if (manner_ == Manner::resident_only) {
    return state_->had(state_->budget->find_now(key), *index, step, whole);
  }
  bool was_there = true;
  auto kept = get(key, values_of(state_->info, *index) * sizeof(float), [&] {
    was_there = false;
    return state_->load(*index, step, urgency());
  });
  if (kept && was_there) state_->budget->bricks().had(bricks_of(state_->info, *index, whole));
  return as_volume(kept);
}

Result<VolumePtr> Dataset::level(const std::string& field, std::size_t step,
                                 const Coarsening& how) {
  const auto stored = stored_reduction(field, how);
  return derived(field, step, stored ? *stored : reduction(field, how));
}

Derivation Dataset::reduction(const std::string& field, const Coarsening& how) const {
  if (how.halvings == std::array{0, 0, 0}) return {};
  const auto level = level_of(state_->info, how.halvings);
  return {(level ? level_variant(*level) : "") + digest_of(data::key_of(how)),
          level_bytes(field, how), [state = state_, how](const Volume& fine) {
            state->add(&Counts::levels);
            return coarsen(fine, how);
          }};
}

std::optional<Derivation> Dataset::stored_reduction(const std::string& field,
                                                    const Coarsening& how) const {
  const DatasetInfo& info = state_->info;
  const Result<std::size_t> index = state_->find(field, 0);
  if (!index || minus_ || how.halvings == std::array{0, 0, 0}) return std::nullopt;
  Derivation out = reduction(field, how);
  if (const auto level = stored_level(info, *index, how)) {
    out.variant = level_variant(level->level) + digest_of(data::key_of(how));
    out.make = nullptr;
    out.stored = level;
    return out;
  }
  if (how.reduction != Reduction::drawn) return std::nullopt;
  if (!stored_middles(info, *index, how.stride)) return std::nullopt;
  out.from = std::make_shared<const Derivation>(*stored_reduction(field, middles_of(how.stride)));
  out.make = [state = state_, how, dims = info.grid.dims()](const Volume& strided) {
    state->add(&Counts::levels);
    return draw(strided, how, dims);
  };
  return out;
}

std::uint64_t Dataset::bytes_beside_level(const std::string& field, const Coarsening& how) const {
  const DatasetInfo& info = state_->info;
  const Result<std::size_t> index = state_->find(field, 0);
  if (!index) return 0;
  if (minus_) return loading_bytes(field);
  if (stored_level(info, *index, how)) return 0;
  const bool from_middles =
      how.reduction == Reduction::drawn && stored_middles(info, *index, how.stride);
  return from_middles ? level_bytes(field, middles_of(how.stride)) : loading_bytes(field);
}

std::uint64_t Dataset::least_bytes(const std::string& field) const {
  const DatasetInfo& info = state_->info;
  const std::uint64_t whole = loading_bytes(field);
  const Result<std::size_t> index = state_->find(field, 0);
  if (!index || minus_ || info.stored == nullptr) return whole;
  const bool is_vector = info.fields[*index].kind == FieldKind::vector;
  const StoredAs as = is_vector ? StoredAs::drawn : StoredAs::two_values;
  const auto dims = stored_dims(info, *index, info.stored->levels.size() - 1, as);
  if (!dims) return whole;
  const auto values = static_cast<std::uint64_t>(components_of(info.fields[*index], as));
  return std::min(whole, whole_box(*dims).samples() * values * sizeof(float));
}

bool Dataset::fits_in_full(const std::vector<std::string>& fields) const {
  const std::set<std::string> counted(fields.begin(), fields.end());
  std::uint64_t bytes = 0;
  for (const std::string& field : counted) bytes += loading_bytes(field);
  return fits_beside_loader(bytes, fields);
}

bool Dataset::fits_beside_loader(std::uint64_t bytes,
                                 const std::vector<std::string>& fields) const {
  if (state_->info.stored == nullptr) return is_within_limit(bytes);
  return bytes + state_->bytes_beside(reading_bytes_of_store(state_->info, fields)) <=
         state_->budget->bytes_max();
}

bool Dataset::fits_beside_boxes(std::uint64_t bytes, const std::vector<std::string>& fields) const {
  return bytes <= room_beside_boxes(fields);
}

std::uint64_t Dataset::room_beside_boxes(const std::vector<std::string>& fields) const {
  std::uint64_t reading = 0;
  for (const std::string& field : fields) {
    const FieldInfo* const about = state_->info.find(field);
    if (about != nullptr) reading = std::max(reading, reading_box_bytes(*about));
  }
  const std::uint64_t beside = state_->bytes_beside(reading);
  return state_->budget->bytes_max() - std::min(beside, state_->budget->bytes_max());
}

Result<VolumePtr> Dataset::derived(const std::string& field, std::size_t step,
                                   const Derivation& how) {
  if (how.variant.empty()) return volume(field, step);
  const Result<std::size_t> index = state_->find(field, step);
  if (!index) return index.error();
  const ResidentKey key{state_->owner, *index, step, variant_of(how.variant, step)};
  if (manner_ == Manner::resident_only) {
    auto there = state_->had(state_->budget->find_now(key), *index, step);
    if (there) state_->budget->bricks().had(bricks_in(state_->info, *index, how));
    return there;
  }
  // A gathering that another caller cancelled begins again.
  const auto is_to_be_repeated = [&](const Result<Resident>& answer) {
    return how.gathered && !answer && answer.error().kind == ErrorKind::cancelled &&
           !cancellation().cancelled();
  };
  auto there = state_->budget->find(key);
  while (there && is_to_be_repeated(*there)) there = state_->budget->find(key);
  if (there) {
    if (*there) state_->budget->bricks().had(bricks_in(state_->info, *index, how));
    if (*there && own_) own_->insert((*there)->get());
    return as_volume(*there);
  }
  if (how.stored) {
    return as_volume(
        get(key, how.bytes, [&] { return state_->read(*index, step, urgency(), &*how.stored); }));
  }
  if (how.gathered) {
    const auto make = [&] {
      return guarded(state_->info.fields[*index], [&] { return gather(*index, step, how); });
    };
    auto answer = get(key, how.bytes, make);
    while (is_to_be_repeated(answer)) answer = get(key, how.bytes, make);
    return as_volume(answer);
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
                                    const std::function<Result<Resident>()>& make) {
  const ResidentKey key = auxiliary_key(variant);
  if (manner_ == Manner::resident_only) {
    Resident there = state_->budget->find_now(key);
    if (there) return there;
    return make_error(ErrorKind::not_resident, "a part of the view is not in memory yet");
  }
  const CancelToken own = cancellation();
  for (;;) {
    auto kept = get(key, bytes, make);
    const bool others = !kept && kept.error().kind == ErrorKind::cancelled && !own.cancelled();
    if (!others) return kept;
  }
}

ResidentKey Dataset::auxiliary_key(const std::string& variant) const {
  return {state_->owner, no_field, 0, name_of_subtrahend() + variant};
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
  return ResidentKey{state_->owner, *index, step, variant_of(how.variant, step)};
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
    const std::string& of, const std::function<Result<std::vector<double>>()>& make) {
  using Meeting = Remembered::Meeting;
  const Meeting meeting = manner_ == Manner::resident_only ? Meeting::leave
                          : manner_ == Manner::in_turn     ? Meeting::disregard
                                                           : Meeting::wait;
  return state_->remembered.get(name_of_subtrahend() + of, meeting, cancellation(), make);
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
  const auto found = state_->reads.find({*index, step});
  if (found != state_->reads.end() && found->second.seen) return found->second.seen;
  const StoredRange* const stored = stored_range(state_->info, *index, step);
  return stored == nullptr ? std::nullopt : std::optional(Seen{stored->range, stored->masked});
}

Dataset::Counts Dataset::counts() const {
  const std::lock_guard lock(state_->mutex);
  return state_->counts;
}

std::uint64_t Dataset::resident_bytes() const {
  return state_->budget->bytes_of(state_->owner) + state_->charged.bytes();
}

std::vector<std::uint64_t> Dataset::resident_bytes_of_levels() const {
  const auto& stored = state_->info.stored;
  return state_->budget->bytes_of_levels(state_->owner, stored ? stored->levels.size() : 0);
}

std::optional<Dataset::Loading> Dataset::loading() const {
  const std::lock_guard lock(state_->mutex);
  return state_->loading;
}

Result<void> Dataset::check_room(const std::vector<std::string>& fields) const {
  for (const std::string& field : fields) {
    const std::uint64_t bytes = least_bytes(field);
    if (is_within_limit(bytes)) continue;
    return make_error(ErrorKind::out_of_memory, in_quotes(field) + " needs " + megabytes(bytes) +
                                                    " at a step; " + state_->budget->limit_text() +
                                                    beyond_limit(fields));
  }
  return {};
}

std::string Dataset::beyond_limit(const std::vector<std::string>& fields) const {
  const Budget& budget = *state_->budget;
  std::uint64_t bytes = bytes_at_a_step(state_->info, fields);
  std::uint64_t operands = 0;  // of the largest difference, beside all of them
  for (const std::string& field : fields) {
    operands = std::max(operands, loading_bytes(field) - level_bytes(field, {}));
  }
  bytes += operands;
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
  text += budget.name().raised(all) + " would suffice";
  if (minus_ || !may_get_levels(state_->info, fields)) return text;
  return text + "; a store that 'windsplat convert' makes of the dataset is drawn within less";
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
