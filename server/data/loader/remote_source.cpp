// Daemon side: sends a call, serves the requests of the loader and validates its answer. Any other
// event ends the loader and becomes an error of the call.
#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <mutex>
#include <optional>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/bytes/decode_limits.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/loader/process.hpp"
#include "server/data/loader/transfer.hpp"
#include "server/data/model/digest.hpp"

namespace windsplat::data::loader {

namespace {

struct Program {
  std::mutex mutex;
  std::string path;
};

Program& program() {
  static Program the_one;
  return the_one;
}

std::string program_path() {
  const std::lock_guard lock(program().mutex);
  return program().path;
}

// A regular file below one of the folders where libraries keep their tables.
Descriptor open_of_library(const std::vector<std::string>& folders, const std::string& path) {
  for (const std::string& folder : folders) {
    if (!path.starts_with(folder + '/') || path.find('\0') != std::string::npos) continue;
    const std::size_t below = path.find_first_not_of('/', folder.size());
    if (below == std::string::npos) continue;  // the folder itself is not a file
    const Descriptor root(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    open_how how{};
    how.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;
    how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
    Descriptor file(static_cast<int>(
        ::syscall(SYS_openat2, root.number(), path.c_str() + below, &how, sizeof how)));
    struct stat status {};
    if (file && ::fstat(file.number(), &status) == 0 && S_ISREG(status.st_mode)) return file;
  }
  return Descriptor();
}

std::string seconds_text(std::chrono::milliseconds time) {
  const auto tenths = (time.count() + 50) / 100;
  return std::to_string(tenths / 10) + '.' + std::to_string(tenths % 10) + " s";
}

}  // namespace

void set_program(std::string path) {
  const std::lock_guard lock(program().mutex);
  program().path = std::move(path);
}

struct RemoteSource::State {
  // One call to the loader.
  struct Call {
    Kind kind = Kind::open;
    std::string payload;
    int descriptor = -1;
    Kind answer = Kind::opened;
    std::string doing;  // "opening it", "reading 'u'"
    std::chrono::milliseconds time{};
  };

  // Remaining time of a call.
  struct Patience {
    Clock::time_point end;
    Clock::time_point moved = Clock::now();  // time of the last message or progress of the loader
    Clock::time_point looked = Clock::now();
    std::chrono::nanoseconds cpu{};
  };

  State(Location where, Limits most)
      : location(std::move(where)),
        limits(std::move(most)),
        process_memory(limits.budget),
        transfer_memory(limits.budget) {}

  Location location;
  Limits limits;
  DatasetInfo info;
  std::string digest;  // the info as received
  std::vector<Companion> companions;
  std::uint64_t opened_bytes = 0;  // total size of the files read to open the dataset
  Progress progress;
  std::shared_ptr<Files> files;  // set while a loader runs
  Process process;
  std::optional<Transfer> transfer;  // as mapped by the loader
  Reservation process_memory;
  Reservation transfer_memory;  // true: a transfer that is reused; false: its memory belongs to the
                                // volume being read
  std::mutex mutex;             // guards the next two members
  bool under_way = false;
  bool cancelled = false;

  // Starts a loader, which opens the dataset; returns the encoded info.
  Result<std::string> start() {
    release();
    const std::string path = program_path();
    if (path.empty()) return make_error(ErrorKind::internal, "no loader executable is set");
    if (auto room = process_memory.resize(loader_bytes_min); !room) return room.error();
    if (auto started = process.start(path); !started) {
      release();
      return started.error();
    }
    files = direct_files(location);
    Task task;
    task.memory_bytes = limits.memory_bytes;
    task.library_folders = limits.library_folders;
    task.location.kind = location.kind;
    task.location.companions = location.companions;
    task.location.stem = location.stem;
    task.location.inside = location.inside;
    task.location.pattern = location.pattern.substr(location.pattern.find_last_of('/') + 1);
    for (const Location::Member& member : location.members) {
      task.location.members.push_back({member.name, {}});
    }
    auto answer =
        call({Kind::open, encode_task(task), -1, Kind::opened, "opening it", limits.open_time});
    if (!answer) {
      Error error = answer.error();
      // Without files, the loader has already exited because of lack of memory.
      if (files && error.kind == ErrorKind::out_of_memory) error.message += opening_limit();
      release();
      return error;
    }
    files->stop_counting();
    opened_bytes = files->opened_bytes();
    companions = files->companions();
    if (limits.reads_take_all) process.allow_memory(limits.memory_bytes);
    return std::move(answer->payload);
  }

  [[nodiscard]] bool is_cancelled() {
    const std::lock_guard lock(mutex);
    return cancelled;
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
    process.kill();
  }

  // Ensures a running loader with the same files open as initially.
  Result<void> be_ready() {
    if (process.runs()) return {};
    auto encoded = start();
    if (!encoded) return encoded.error();
    if (digest_of(*encoded) == digest) return {};
    release();
    return make_error(ErrorKind::bad_data,
                      in_quotes(info.source) + " has changed since it was opened; open it again");
  }

  void release() {
    process.end();
    files.reset();
    drop_transfer();
    static_cast<void>(process_memory.resize(0));
  }

  void drop_transfer() {
    transfer.reset();
    static_cast<void>(transfer_memory.resize(0));
  }

  Result<Message> call(const Call& what) {
    Patience patience{Clock::now() + what.time};
    process.allow_cpu(std::chrono::ceil<std::chrono::seconds>(what.time));
    Fate fate = send_message(process.socket(), what.kind, what.payload, what.descriptor,
                             next_deadline(patience));
    std::size_t questions = 0;
    while (fate == Fate::done) {
      Message message;
      const std::size_t bytes_max =
          what.answer == Kind::opened ? opened_bytes_max() : std::size_t{question_bytes_max};
      const Result<Fate> waited = wait(patience);
      if (!waited) return crowded_out(waited.error(), what);
      fate = *waited;
      if (fate == Fate::done) {
        fate = receive_message(process.socket(), message, bytes_max, Descriptors::refused,
                               next_deadline(patience));
      }
      if (fate != Fate::done) break;
      if (message.kind == what.answer) return message;
      if (message.kind == Kind::failed) return decode_error(message.payload);
      fate = message.kind == Kind::progress ? receive_progress(message.payload)
             : ++questions > 2 * limits.opens_max
                 ? Fate::broken
                 : answer(message, what.kind, next_deadline(patience));
      patience.moved = Clock::now();
    }
    return ended(fate, what, patience);
  }

  [[nodiscard]] Deadline next_deadline(const Patience& patience) const {
    return std::min(patience.end, Clock::now() + limits.stall_time);
  }

  // Waits for the next message. Processor time counts as progress, since a reader may compute for
  // long. Errors: out_of_memory, since readers allocate while they read.
  [[nodiscard]] Result<Fate> wait(Patience& patience) {
    constexpr std::chrono::milliseconds look_every{50};
    constexpr std::chrono::seconds pause_min{1};
    patience.looked = Clock::now();
    for (;;) {
      const auto now = Clock::now();
      const auto cpu = process.cpu_time();
      if (cpu != patience.cpu) patience.moved = now;
      patience.cpu = cpu;
      // A period in which this process was suspended too does not count as a stall.
      if (now - patience.looked > pause_min) patience.moved += now - patience.looked;
      patience.looked = now;
      const auto end = std::min(patience.end, patience.moved + limits.stall_time);
      if (now >= end) return wait_for_message(process.socket(), now);
      if (auto room = count_memory(); !room) return room.error();
      const Fate fate = wait_for_message(process.socket(), std::min(end, now + look_every));
      if (fate != Fate::late) return fate;
    }
  }

  [[nodiscard]] std::string opening_limit() const {
    const std::uint64_t bytes =
        std::min(opening_memory_bytes(files->opened_bytes()), limits.memory_bytes);
    return "; the memory limit for opening files of " + std::to_string(files->opened_bytes()) +
           " bytes is " + megabytes(bytes);
  }

  // Private memory of the loader counts in the memory limit.
  Result<void> count_memory() {
    return process_memory.resize(std::max(loader_bytes_min, process.private_bytes()));
  }

  [[nodiscard]] std::size_t opened_bytes_max() const {
    return std::min<std::size_t>(info_bytes_max, limits.memory_bytes);
  }

  Fate receive_progress(const std::string& payload) const {
    Reader in(payload);
    const auto done = in.number<double>();
    if (!in.complete() || !(done >= 0 && done <= 1)) return Fate::broken;
    if (progress) progress(done);
    return Fate::done;
  }

  // Resources used during a call of that kind.
  [[nodiscard]] Fate answer(const Message& question, Kind during, const Deadline& deadline) {
    const auto say = [&](Kind kind, std::string_view payload, int descriptor = -1) {
      return send_message(process.socket(), kind, payload, descriptor, deadline);
    };
    const std::string& name = question.payload;
    if (name.size() > question_bytes_max) return Fate::broken;
    if (question.kind == Kind::ask_open) {
      const auto file = files->open(name);
      if (during == Kind::open) process.allow_memory(opening_memory_bytes(files->opened_bytes()));
      return file ? say(Kind::descriptor, {}, (*file)->descriptor())
                  : say(Kind::no, encode_error(file.error()));
    }
    if (question.kind == Kind::ask_list) {
      const auto names = files->list(name);
      return names ? say(Kind::names, encode_names(*names))
                   : say(Kind::no, encode_error(names.error()));
    }
    if (question.kind == Kind::ask_exists) {
      return say(files->exists(name) ? Kind::yes : Kind::no, {});
    }
    if (question.kind == Kind::ask_library) {
      const Descriptor file = open_of_library(limits.library_folders, name);
      return file ? say(Kind::descriptor, {}, file.number()) : say(Kind::no, {});
    }
    return Fate::broken;
  }

  Error crowded_out(const Error& error, const Call& what) {
    release();
    return make_error(error.kind,
                      loader_text() + " was ended while " + what.doing + ": " + error.message);
  }

  // Returns why no answer was received. The loader has ended afterwards.
  Error ended(Fate fate, const Call& what, const Patience& patience) {
    constexpr std::chrono::milliseconds time_to_end{500};
    std::string how =
        process.end(fate == Fate::closed ? time_to_end : std::chrono::milliseconds(0));
    release();
    if (fate == Fate::late && Clock::now() < patience.end) {
      how = "made no progress for " + seconds_text(limits.stall_time) + " and was ended";
    } else if (fate == Fate::late) {
      how = "was ended after " + seconds_text(what.time);
    } else if (fate != Fate::closed) {
      how = "violated the protocol and was ended";
    }
    return make_error(ErrorKind::bad_data, loader_text() + ' ' + how + " while " + what.doing);
  }

  [[nodiscard]] std::string loader_text() const {
    return "the loader of " +
           in_quotes(location.members.empty() ? location.stem : location.members.front().name);
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
    Call what{Kind::read,
              request.bytes(),
              is_new ? transfer->descriptor() : -1,
              Kind::filled,
              "reading " + in_quotes(about.name),
              limits.read_time};
    what.time += std::chrono::milliseconds(bytes * 1000 / limits.read_bytes_per_second);
    if (auto done = call(what); !done) {
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
    if (!count_memory()) release();
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

void RemoteSource::on_progress(Progress progress) { state_->progress = std::move(progress); }

void RemoteSource::cancel() { state_->cancel(); }

std::vector<Companion> RemoteSource::companions() const { return state_->companions; }

void RemoteSource::release() { state_->release(); }

pid_t RemoteSource::process() const { return state_->process.id(); }

Result<std::unique_ptr<RemoteSource>> open(Location location, Limits limits) {
  auto state = std::make_unique<RemoteSource::State>(std::move(location), std::move(limits));
  auto encoded = state->start();
  if (!encoded) return encoded.error();
  if (!state->count_memory()) state->release();  // the loader can be restarted after its answer
  auto info = decode_info(*encoded);
  if (!info) return info.error();
  state->info = std::move(*info);
  state->info.stored_bytes = state->opened_bytes;
  state->digest = digest_of(*encoded);
  return std::unique_ptr<RemoteSource>(new RemoteSource(std::move(state)));
}

}  // namespace windsplat::data::loader
