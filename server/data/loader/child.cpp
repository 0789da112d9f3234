// Loader side: receives a task, confines itself, opens the files and serves reads until the socket
// closes. File errors are sent as answers; channel errors end the process.
#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/loader/by_parts.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/confine.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/loader/process.hpp"
#include "server/data/loader/transfer.hpp"
#include "server/data/loader/unpack.hpp"
#include "server/data/loader/window.hpp"
#include "server/data/open/open.hpp"

namespace windsplat::data::loader {

namespace {

constexpr int niceness = 5;
constexpr std::chrono::milliseconds progress_every{50};
constexpr std::size_t answer_bytes_max = std::size_t{1} << 30;

// The channel is closed: no error can be reported.
[[noreturn]] void leave() { ::_exit(1); }

void say(Kind kind, std::string_view payload) {
  if (send_message(socket_of_loader, kind, payload, -1, {}) != Fate::done) leave();
}

void hear(Message& out) {
  do {
    if (receive_message(socket_of_loader, out, answer_bytes_max, Descriptors::taken, {}) !=
        Fate::done) {
      leave();
    }
  } while (is_of_window({static_cast<std::uint32_t>(out.kind), 0, out.payload.size()}));
}

// Files opened by the daemon: sends requests, receives descriptors.
class BrokeredFiles final : public Files {
 public:
  explicit BrokeredFiles(Location location) : location_(std::move(location)) {}
  [[nodiscard]] const Location& location() const override { return location_; }

  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    return open_by(Kind::ask_open, name);
  }
  Result<std::shared_ptr<const InputFile>> open_parts(const std::string& name) override {
    return open_by(Kind::ask_parts, name);
  }
  void expect(const Expected& what) override {
    constexpr std::size_t name_bytes_max = 4096;
    if (!location_.fetched || what.name.size() > name_bytes_max) return;
    Expected part = what;
    for (std::size_t at = 0; at == 0 || at < what.extents.size(); at += expected_extents_max) {
      const std::size_t end = std::min(what.extents.size(), at + expected_extents_max);
      part.extents.assign(what.extents.begin() + static_cast<std::ptrdiff_t>(at),
                          what.extents.begin() + static_cast<std::ptrdiff_t>(end));
      say(Kind::expect, encode_expected(part));
    }
  }
  Result<std::vector<std::string>> list(const std::string& folder) override {
    const Message answer = ask(Kind::ask_list, folder);
    if (answer.kind != Kind::names) return decode_error(answer.payload);
    return decode_names(answer.payload);
  }
  bool exists(const std::string& name) override {
    return ask(Kind::ask_exists, name).kind == Kind::yes;
  }

 private:
  Result<std::shared_ptr<const InputFile>> open_by(Kind how, const std::string& name) {
    Message answer = ask(how, name);
    if (answer.kind != Kind::descriptor) return decode_error(answer.payload);
    auto parts = decode_parts(answer.payload);
    if (!parts) return parts.error();
    const std::uint64_t number = parts->number;
    const int descriptor = place(answer.descriptor.give(), number);
    if (descriptor < 0) {
      return make_error(ErrorKind::bad_data, in_quotes(name) + ": too many files are open");
    }
    auto file =
        InputFile::adopt(descriptor, name.substr(name.find_last_of('/') + 1), std::move(*parts));
    if (file) count_opened(name, (*file)->size());
    if (!file || number == 0) return file;
    return std::shared_ptr<const InputFile>(file->get(),
                                            [kept = *file, number](const InputFile*) mutable {
                                              kept.reset();
                                              Writer out;
                                              out.number(number);
                                              say(Kind::close_parts, out.bytes());
                                            });
  }

  static Message ask(Kind what, const std::string& name) {
    Message out;
    if (name.size() > question_bytes_max) {
      out.kind = Kind::no;
      out.payload = encode_error(make_error(ErrorKind::bad_data, "a file name is too long"));
    } else {
      say(what, name);
      hear(out);
    }
    return out;
  }

  Location location_;
};

// Calls `work` and converts exceptions to errors.
template <class Work>
auto guarded(const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::bad_alloc&) {
    return make_error(ErrorKind::out_of_memory, "reading it needs more memory than a loader has");
  } catch (const std::exception& fault) {
    return make_error(ErrorKind::internal, "reading it failed: " + printable(fault.what()));
  }
}

// Fills the memory with what is asked for. false: it cannot be read in parts. `is_fresh`: the
// memory has not been written to yet.
Result<bool> fill(FileSource& source, const Wanted& wanted, const Mapping& memory, bool is_fresh) {
  const DatasetInfo& info = source.info();
  const std::array<int, 3> dims = info.grid.dims();
  const auto components =
      static_cast<std::size_t>(components_of(info.fields[wanted.field], wanted.part.as));
  const std::size_t samples = wanted.part.box.samples();
  const std::size_t layer = info.grid.samples() / info.grid.axes[2].coordinates.size();
  const std::size_t floats =
      wanted.window_layers > 0 ? 2 * layer * wanted.window_layers : samples * components;
  if (wanted.window_layers > info.grid.samples() || floats > memory.floats()) {
    return make_error(ErrorKind::internal, "the memory of a volume has the wrong size");
  }
  if (wanted.window_layers > 0) {
    Window window(socket_of_loader, memory.data(), layer, wanted.window_layers);
    auto done = guarded([&] { return source.fill_in_parts(wanted.field, wanted.step, window); });
    window.finish();
    return done;
  }
  // Overwrites numbers of the previous volume.
  if (!is_fresh) std::fill_n(memory.data(), floats, 0.0F);
  if (wanted.part == StoredPart{whole_box(dims)}) {
    auto done = source.fill(wanted.field, wanted.step, memory.data());
    if (!done) return done.error();
  } else {
    auto done = source.fill_part(wanted.field, wanted.step, wanted.part, memory.data());
    if (!done || !*done) return done;
  }
  mask_volume(memory.data(), samples, static_cast<int>(components));
  return true;
}

// Libraries allocate and free chunk-sized buffers at every read. Returning them to the system each
// time would cost a third of the read time, because pages are cleared and mapped anew. If memory is
// scarce, that cost is accepted.
void keep_freed_memory(std::uint64_t memory_bytes) {
  constexpr std::uint64_t mapped_from = 32U << 20U;  // the maximum that glibc allows
  constexpr std::uint64_t kept = 48U << 20U;
  ::mallopt(M_MMAP_THRESHOLD, static_cast<int>(std::min(mapped_from, memory_bytes / 8)));
  ::mallopt(M_TRIM_THRESHOLD, static_cast<int>(std::min(kept, memory_bytes / 8)));
}

class Loader {
 public:
  void open(const std::string& payload) {
    auto task = decode_task(payload);
    if (!task) leave();
    keep_freed_memory(task->memory_bytes);
    Confinement how;
    how.memory_bytes = task->memory_bytes;
    how.opening_bytes = opening_memory_bytes(0);
    how.files = task->location.members.size() + open_besides_members_max;
    how.socket = socket_of_loader;
    how.library_folders = std::move(task->library_folders);
    if (auto done = confine(std::move(how)); !done) {
      say(Kind::failed, encode_error(done.error()));
      leave();
    }
    const auto files = std::make_shared<BrokeredFiles>(std::move(task->location));
    const auto opened = guarded([&]() -> Result<std::string> {
      auto source = open_dataset(files);
      if (!source) return source.error();
      source_ = std::move(*source);
      return encode_info(source_->info());
    });
    if (!opened) {
      say(Kind::failed, encode_error(opened.error()));
      return;
    }
    source_->on_progress([this](double done) { tell(done); });
    say(Kind::opened, *opened);
  }

  void read(Message& message) {
    if (!source_) leave();
    const auto wanted = decode_wanted(message.payload, source_->info());
    told_ = Clock::now();
    const auto done = guarded([&]() -> Result<bool> {
      if (!wanted) return wanted.error();
      const bool is_fresh = static_cast<bool>(message.descriptor);
      if (is_fresh) {
        memory_ = Mapping();
        auto mapped = Mapping::of(message.descriptor, true);
        message.descriptor.reset();
        if (!mapped) return mapped.error();
        memory_ = std::move(*mapped);
      }
      return fill(*source_, *wanted, memory_, is_fresh);
    });
    if (!wanted || !wanted->keeps_memory) memory_ = Mapping();
    if (!done) {
      say(Kind::failed, encode_error(done.error()));
    } else {
      say(*done ? Kind::filled : Kind::whole, {});
    }
  }

 private:
  void tell(double done) {
    const auto now = Clock::now();
    if (now - told_ < progress_every) return;
    told_ = now;
    Writer out;
    out.number(done);
    say(Kind::progress, out.bytes());
  }

  std::unique_ptr<FileSource> source_;
  Mapping memory_;  // receives volumes until it is replaced
  Clock::time_point told_;
};

// Ends this process with the daemon, even during a read: the daemon's end of the pipe closes, and
// the default action of SIGIO ends the process. (The parent death signal is unsuitable: it is sent
// when the thread that started the process ends.)
bool end_with_daemon() {
  if (::fcntl(life_of_loader, F_SETOWN, ::getpid()) != 0) return false;
  const int flags = ::fcntl(life_of_loader, F_GETFL);
  if (flags < 0 || ::fcntl(life_of_loader, F_SETFL, flags | O_ASYNC | O_NONBLOCK) != 0) {
    return false;
  }
  pollfd event{life_of_loader, POLLIN, 0};
  return ::poll(&event, 1, 0) == 0;
}

}  // namespace

int run() {
  std::signal(SIGIO, SIG_DFL);
  if (!end_with_daemon()) {
    std::fputs("windsplat: 'load' is internal and cannot be run directly\n", stderr);
    return 2;
  }
  static_cast<void>(::setpriority(PRIO_PROCESS, 0, niceness));
  Loader loader;
  for (;;) {
    Message message;
    const Fate fate =
        receive_message(socket_of_loader, message, answer_bytes_max, Descriptors::taken, {});
    if (fate == Fate::closed) ::_exit(0);  // skips exit handlers of libraries and sanitizers
    if (fate != Fate::done) leave();
    if (message.kind == Kind::open) {
      loader.open(message.payload);
    } else if (message.kind == Kind::read) {
      loader.read(message);
    } else if (message.kind == Kind::unpack && message.descriptor) {
      send_archive(message.descriptor);
    } else {
      leave();
    }
  }
}

}  // namespace windsplat::data::loader
