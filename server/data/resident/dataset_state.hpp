// What the handles of a dataset share: its source and what is known of it. Internal to the handles.
#pragma once

#include <algorithm>
#include <any>
#include <cstdint>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/base/log.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/model/middles.hpp"
#include "server/data/model/packed.hpp"
#include "server/data/resident/dataset.hpp"
#include "server/data/resident/remembered.hpp"
#include "server/data/resident/sizes.hpp"
#include "server/data/resident/turnstile.hpp"

namespace windsplat::data {

// The volume of a result of the budget.
inline Result<std::shared_ptr<const Volume>> as_volume(const Result<Resident>& kept) {
  if (!kept) return kept.error();
  return std::static_pointer_cast<const Volume>(*kept);
}

// Bricks of what is stored of a derivation itself.
inline std::uint64_t bricks_in(const DatasetInfo& info, std::size_t field, const Derivation& how) {
  if (how.stored) return bricks_of(info, field, *how.stored);
  if (!how.gathered) return 0;
  auto part = how.gathered->part(0).stored;
  if (!part) return 0;
  std::uint64_t bricks = 0;
  for (const Box& box : how.gathered->grid.boxes()) {
    part->box = box;
    bricks += bricks_of(info, field, *part);
  }
  return bricks;
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

// What was read of a field at a step.
struct StepReads {
  std::optional<Dataset::Seen> seen;  // of the volume
  double apart = 0;  // the share of the step that was decoded for boxes since the volume was read
};

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

  // What is in memory of a field at a step, and counted if it is stored as `part`. Errors:
  // not_resident.
  [[nodiscard]] Result<std::shared_ptr<const Volume>> had(
      const Resident& there, std::size_t field, std::size_t step,
      const std::optional<StoredPart>& part = std::nullopt) const {
    if (!there) {
      return make_error(ErrorKind::not_resident, in_quotes(info.fields[field].name) + " at step " +
                                                     std::to_string(step) +
                                                     " is not in memory yet");
    }
    if (part) budget->bricks().had(bricks_of(info, field, *part));
    return std::static_pointer_cast<const Volume>(there);
  }

  // Reads the volume from its source, or unpacks it.
  Result<Resident> load(std::size_t field, std::size_t step, Urgency urgency) {
    const ResidentKey twin{owner, field, step, packed_variant};
    if (const Resident packed = budget->find_now(twin)) {
      add(&Counts::unpacked);
      budget->bricks().had(bricks_of(info, field, {whole_box(info.grid.dims())}));
      return guarded(info.fields[field], [&]() -> Result<Volume> {
        return unpack(*std::static_pointer_cast<const PackedVolume>(packed));
      });
    }
    auto volume = read(field, step, urgency, nullptr);
    if (volume && storage == Storage::packed16) {
      // If the packed form does not fit too, only the volume itself is kept.
      (void)budget->get(twin, values_of(info, field) * sizeof(std::uint16_t), Urgency::prefetch,
                        [&] { return pack_volume(field, *volume); });
    }
    return volume;
  }

  // part null: all samples. Middles of kernels are taken from the volume if it is resident.
  Result<Resident> read(std::size_t field, std::size_t step, Urgency urgency,
                        const StoredPart* part) {
    const std::uint64_t bricks =
        bricks_of(info, field, part ? *part : StoredPart{whole_box(info.grid.dims())});
    // Values that were packed are not those stored.
    if (part && part->as == StoredAs::strided && storage == Storage::float32) {
      if (const Resident all = budget->find_now({owner, field, step, ""})) {
        budget->bricks().had(bricks);
        return guarded(info.fields[field], [&] {
          return middles(*std::static_pointer_cast<const Volume>(all), 1 << part->level, part->box);
        });
      }
    }
    budget->bricks().wait_for(bricks);
    turnstile.enter(urgency);
    {
      const std::lock_guard lock(mutex);
      if (ended) {
        turnstile.leave();
        budget->bricks().end_wait(bricks, 0);
        return why_cancelled();
      }
      ++counts.loads;
      counts.prefetched += urgency == Urgency::prefetch ? 1 : 0;
      loading = Loading{info.fields[field].name, step, 0};
    }
    Reservation inputs(budget);  // of a derived field of a sample; a loader counts its own memory
    const auto held =
        inputs.resize(info.stored_bytes == 0 ? info.fields[field].chunk_bytes : 0, urgency);
    const auto values = [&] {
      return part ? source->read_part(field, step, *part) : source->read(field, step);
    };
    auto volume = held ? guarded(info.fields[field], values) : Result<Resident>(held.error());
    {
      const std::lock_guard lock(mutex);
      loading.reset();
      if (volume && part != nullptr) {
        if (part->level == 0) {
          reads[{field, step}].apart +=
              decoded_share(part->box, 1, info.fields[field], info.grid.dims());
        }
      } else if (volume) {
        const auto& read = *std::static_pointer_cast<const Volume>(*volume);
        reads[{field, step}] = {Seen{read.range, read.masked}, 0};
      } else {
        ++counts.failures;
        if (volume.error().kind == ErrorKind::cancelled) volume = why_cancelled();
      }
    }
    turnstile.leave();
    const bool has_bricks = volume && bricks > 0;
    const auto bytes = has_bricks ? std::static_pointer_cast<const Volume>(*volume)->bytes() : 0;
    budget->bricks().end_wait(bricks, bytes);
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
  Remembered remembered;

  mutable std::mutex mutex;  // guards all members below
  Counts counts;
  std::optional<Loading> loading;
  bool ended = false;
  bool forgotten = false;
  std::map<std::pair<std::size_t, std::size_t>, StepReads> reads;  // keyed by field and step
  std::map<std::size_t, float> errors;                             // packing errors, by field
  std::string kept_key;
  std::any kept_value;
};

}  // namespace windsplat::data
