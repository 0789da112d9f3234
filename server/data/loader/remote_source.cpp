// A dataset read by a loader, which is started on demand; volumes come back in shared memory.
#include <mutex>
#include <optional>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/running_loader.hpp"
#include "server/data/loader/transfer.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::loader {

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
  // Memory of a transfer that is reused; otherwise it belongs to the volume that is being read.
  Reservation transfer_memory;
  std::mutex mutex;  // guards the next three members
  bool under_way = false;
  bool cancelled = false;
  std::optional<CancelToken> opening;  // while it is opened

  // Starts a loader, which opens the dataset; returns the encoded info.
  Result<std::string> start() {
    release();
    return loader.open();
  }

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
    if (loader.process().runs()) return {};
    auto encoded = start();
    if (!encoded) return encoded.error();
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

  Result<Volume> read(std::size_t field, std::size_t step) {
    if (auto ready = be_ready(); !ready) return ready.error();
    // cancel() could not end a loader that was just being started.
    if (is_cancelled()) return make_error(ErrorKind::cancelled, "reading was cancelled");
    const FieldInfo& about = info.fields[field];
    Volume volume;
    volume.dims = info.grid.dims();
    volume.components = static_cast<int>(about.components.size());
    const std::size_t floats = volume.samples() * about.components.size();
    const std::uint64_t bytes = floats * sizeof(float);
    const bool is_new = !transfer || transfer->floats() < floats;
    if (is_new) {
      drop_transfer();
      auto made = Transfer::make(floats, is_worth_keeping(bytes));
      if (!made) return made.error();
      transfer = std::move(*made);
    }
    Writer request;
    request.number(static_cast<std::uint64_t>(field));
    request.number(static_cast<std::uint64_t>(step));
    request.number(static_cast<std::uint64_t>(transfer->is_kept() ? 1 : 0));
    RunningLoader::Call what{Kind::read,
                             request.bytes(),
                             is_new ? transfer->descriptor() : -1,
                             Kind::filled,
                             "reading " + in_quotes(about.name),
                             limits.read_time};
    what.time += std::chrono::milliseconds(bytes * 1000 / limits.read_bytes_per_second);
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
    if (!measure_volume(volume)) {
      release();
      return make_error(ErrorKind::bad_data, "the loader of " + in_quotes(info.source) +
                                                 " did not mask all invalid numbers while " +
                                                 what.doing);
    }
    return volume;
  }
};

RemoteSource::RemoteSource(std::unique_ptr<State> state) : state_(std::move(state)) {}
RemoteSource::~RemoteSource() = default;

const DatasetInfo& RemoteSource::info() const { return state_->info; }

Result<Volume> RemoteSource::read(std::size_t field, std::size_t step) {
  WINDSPLAT_CHECK(field < info().fields.size() && step < info().steps.size());
  state_->begin();
  auto out = state_->read(field, step);
  if (!state_->finish()) return out;
  state_->release();
  return make_error(ErrorKind::cancelled, "reading " + in_quotes(info().fields[field].name) +
                                              " of " + in_quotes(info().source) + " was cancelled");
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
  auto encoded = state->start();
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
