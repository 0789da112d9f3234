// A dataset read by a loader, which is started on demand; volumes come back in shared memory.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/loader/arriving_volume.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/running_loader.hpp"
#include "server/data/loader/transfer.hpp"
#include "server/data/model/box.hpp"
#include "server/data/model/digest.hpp"
#include "server/data/model/stored.hpp"

namespace windsplat::data::loader {

namespace {

constexpr const char* invalid_numbers = "did not mask all invalid numbers";

std::size_t values_of(const Volume& volume) {
  return volume.samples() * static_cast<std::size_t>(volume.components);
}

Error wrong(const DatasetInfo& info, const std::string& how, const RunningLoader::Call& what) {
  return make_error(ErrorKind::bad_data,
                    "the loader of " + in_quotes(info.source) + ' ' + how + " while " + what.doing);
}

RunningLoader::Call call_for(const DatasetInfo& info, const Wanted& wanted) {
  RunningLoader::Call what;
  what.kind = Kind::read;
  what.payload = encode_wanted(wanted);
  what.answer = Kind::filled;
  what.doing = "reading " + in_quotes(info.fields[wanted.field].name);
  return what;
}

// Of what is decoded for a part: the chunks that it lies in, or its whole level, whose chunks are
// not known.
std::uint64_t decoded_bytes(const DatasetInfo& info, std::size_t field, const StoredPart& part) {
  const FieldInfo& about = info.fields[field];
  const auto dims = stored_dims(info, field, part.level, part.as).value_or(info.grid.dims());
  const auto values = static_cast<std::size_t>(components_of(about, part.as));
  const std::uint64_t all = whole_box(dims).samples() * values * sizeof(float);
  if (part.level > 0 || !about.is_read_by_boxes()) return all;
  const double share = decoded_share(part.box, 1, about, dims);
  return std::max(about.chunk_bytes, static_cast<std::uint64_t>(share * static_cast<double>(all)));
}

// The time of a call that reads so many bytes.
std::chrono::milliseconds time_to_read(const Limits& limits, std::uint64_t bytes) {
  return limits.read_time + std::chrono::milliseconds(bytes * 1000 / limits.read_bytes_per_second);
}

}  // namespace

struct RemoteSource::State {
  State(Location where, Limits most)
      : limits(cancelled_by(*this, std::move(most))),
        loader(std::move(where), limits),
        transfer_memory(limits.budget) {}

  static Limits cancelled_by(State& state, Limits limits) {
    limits.cancelled = [&state] { return state.is_cancelled(); };
    return limits;
  }

  const Limits limits;
  DatasetInfo info;
  std::string digest;  // digest of the info as received
  RunningLoader loader;
  std::optional<Transfer> transfer;  // as mapped by the loader
  std::set<std::size_t> wholes;      // fields that cannot be read in parts
  // Memory of a transfer that is reused; otherwise it belongs to the volume that is being read.
  Reservation transfer_memory;
  std::mutex mutex;  // guards the next three members
  bool under_way = false;
  bool cancelled = false;
  std::optional<CancelToken> opening;  // while it is opened

  [[nodiscard]] bool is_cancelled() {
    const std::lock_guard lock(mutex);
    return cancelled || (opening && opening->cancelled());
  }
  void set_opening(const std::optional<CancelToken>& cancel) {
    const std::lock_guard lock(mutex);
    opening.reset();
    if (cancel) opening.emplace(*cancel);
  }
  void begin() {
    const std::lock_guard lock(mutex);
    under_way = true;
    cancelled = false;
  }
  // Whether it was cancelled.
  bool finish() {
    const std::lock_guard lock(mutex);
    under_way = false;
    return cancelled;
  }
  void cancel() {
    const std::lock_guard lock(mutex);
    if (!under_way) return;
    cancelled = true;
    loader.process().kill();
  }

  // Ensures a running loader with the same files open as initially.
  Result<void> be_ready() {
    const Error is_over = make_error(ErrorKind::cancelled, "reading was cancelled");
    if (loader.process().runs()) return is_cancelled() ? Result<void>(is_over) : Result<void>();
    drop_transfer();
    auto encoded = loader.open();
    if (!encoded) return encoded.error();
    // cancel() could not end a loader that was just being started.
    if (is_cancelled()) return is_over;
    if (digest_of(*encoded) == digest) return {};
    release();
    return make_error(ErrorKind::bad_data,
                      in_quotes(info.source) + " has changed since it was opened; open it again");
  }

  void release() {
    loader.release();
    drop_transfer();
  }

  void drop_transfer() {
    transfer.reset();
    static_cast<void>(transfer_memory.resize(0));
  }

  // Reusing the transfer memory is faster, but only if volumes do not need the space.
  bool is_worth_keeping(std::uint64_t bytes) {
    constexpr std::uint64_t share = 8;
    if (bytes > Transfer::kept_bytes_max) return false;
    if (limits.budget && bytes > limits.budget->bytes_max() / share) return false;
    return static_cast<bool>(transfer_memory.resize(bytes, Urgency::prefetch));
  }

  Result<Volume> read(std::size_t field, std::size_t step, const StoredPart& part) {
    if (auto ready = be_ready(); !ready) return ready.error();
    const FieldInfo& about = info.fields[field];
    Volume volume;
    volume.dims = part.box.count;
    volume.components = components_of(about, part.as);
    const WindowSize window = window_size(volume);
    const bool is_whole = part == StoredPart{whole_box(info.grid.dims())};
    if (is_whole && window.layers > 0 && wholes.count(field) == 0 && is_there(window)) {
      auto done = read_in_parts(field, step, window, volume);
      if (!done) return done.error();
      if (*done) return volume;
      wholes.insert(field);
      // The loader's memory may have exceeded the limit meanwhile.
      if (auto ready = be_ready(); !ready) return ready.error();
    }
    if (auto done = read_at_once(field, step, part, volume); !done) return done.error();
    return volume;
  }

  // Whether the transfer memory can be used as a window, now or once it is made.
  bool is_there(const WindowSize& window) {
    if (transfer && transfer->is_kept() && transfer->floats() >= window.floats()) return true;
    drop_transfer();
    return is_worth_keeping(window.floats() * sizeof(float));
  }

  // false: the field can only be read as a whole; the volume has no values.
  Result<bool> read_in_parts(std::size_t field, std::size_t step, const WindowSize& window,
                             Volume& volume) {
    // First, as it may fail: later, the loader has memory that is not known here, or the reverse.
    volume.values = Samples(values_of(volume));
    const bool is_new = !transfer;
    if (is_new) {
      auto made = Transfer::make(window.floats(), true);
      if (!made) return made.error();
      transfer = std::move(*made);
    }
    RunningLoader::Call what =
        call_for(info, {field, step, {whole_box(volume.dims)}, window.layers, true});
    what.time = time_to_read(limits, values_of(volume) * sizeof(float));
    if (is_new) what.descriptor = transfer->descriptor();
    ArrivingVolume arriving(volume, window, transfer->values());
    what.take = [&](const std::string& payload) { return arriving.take(payload); };
    const auto done = loader.call(what);
    if (!done) {
      // The loader has ended, or may or may not have mapped the memory.
      if (loader.is_released() || is_new) drop_transfer();
      return done.error();
    }
    if (!loader.count_memory()) release();
    if (done->kind == Kind::whole) {
      volume.values = {};
      return false;
    }
    const bool is_complete = arriving.is_complete();
    if (is_complete && arriving.finish()) return true;
    release();
    return wrong(info, is_complete ? invalid_numbers : "sent an incomplete volume", what);
  }

  // The samples of a part, in one piece.
  Result<void> read_at_once(std::size_t field, std::size_t step, const StoredPart& part,
                            Volume& volume) {
    const std::size_t floats = values_of(volume);
    const bool is_new = !transfer || transfer->floats() < floats;
    if (is_new) {
      drop_transfer();
      auto made = Transfer::make(floats, is_worth_keeping(floats * sizeof(float)));
      if (!made) return made.error();
      transfer = std::move(*made);
    }
    RunningLoader::Call what = call_for(info, {field, step, part, 0, transfer->is_kept()});
    what.time = time_to_read(limits, decoded_bytes(info, field, part));
    if (is_new) what.descriptor = transfer->descriptor();
    if (auto done = loader.call(what); !done) {
      if (loader.is_released()) drop_transfer();  // has ended
      // Pages written by the loader are freed with the loader unless the transfer is reused.
      if (transfer && !transfer->is_kept()) release();
      if (is_new) drop_transfer();  // the loader may or may not have mapped it
      return done.error();
    }
    volume.values = transfer->take(floats);
    if (!transfer->is_kept()) {
      const bool is_over = transfer->close();
      drop_transfer();
      if (!is_over) release();
    }
    if (!loader.count_memory()) release();
    if (measure_part(info, field, step, part.as, volume)) return {};
    release();
    return wrong(info, invalid_numbers, what);
  }
};

RemoteSource::RemoteSource(std::unique_ptr<State> state) : state_(std::move(state)) {}
RemoteSource::~RemoteSource() = default;

const DatasetInfo& RemoteSource::info() const { return state_->info; }

template <class Read>
Result<Volume> RemoteSource::run(std::size_t field, std::size_t step, const Read& read) {
  WINDSPLAT_CHECK(field < info().fields.size() && step < info().steps.size());
  state_->begin();
  auto out = read();
  if (!state_->finish()) return out;
  state_->release();
  return make_error(ErrorKind::cancelled, "reading " + in_quotes(info().fields[field].name) +
                                              " of " + in_quotes(info().source) + " was cancelled");
}

Result<Volume> RemoteSource::read(std::size_t field, std::size_t step) {
  return run(field, step,
             [&] { return state_->read(field, step, {whole_box(info().grid.dims())}); });
}

Result<Volume> RemoteSource::read_part(std::size_t field, std::size_t step,
                                       const StoredPart& part) {
  if (auto fine = check_part(field, part); !fine) return fine.error();
  if (!info().fields.at(field).is_read_by_boxes()) return Source::read_part(field, step, part);
  return run(field, step, [&] { return state_->read(field, step, part); });
}

void RemoteSource::on_progress(Progress progress) {
  state_->loader.on_progress(std::move(progress));
}

void RemoteSource::cancel() { state_->cancel(); }

std::vector<Companion> RemoteSource::companions() const { return state_->loader.companions(); }

void RemoteSource::release() { state_->release(); }

pid_t RemoteSource::process() const { return state_->loader.process().id(); }

Result<std::unique_ptr<RemoteSource>> open(Location location, Limits limits,
                                           const CancelToken& cancel) {
  auto state = std::make_unique<RemoteSource::State>(std::move(location), std::move(limits));
  state->set_opening(cancel);
  auto encoded = state->loader.open();
  state->set_opening({});
  if (!encoded) return encoded.error();
  if (!state->loader.count_memory()) state->release();  // after its answer it can be restarted
  auto info = decode_info(*encoded);
  if (!info) return info.error();
  state->info = std::move(*info);
  state->info.stored_bytes = state->loader.opened_bytes();
  state->digest = digest_of(*encoded);
  return std::unique_ptr<RemoteSource>(new RemoteSource(std::move(state)));
}

}  // namespace windsplat::data::loader
