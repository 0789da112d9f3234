// Daemon side: sends a call, serves the requests of the loader and validates its answer. Any other
// event ends the loader and becomes an error of the call.
#include "server/data/loader/running_loader.hpp"

#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <mutex>
#include <utility>

#include "server/data/bytes/decode_limits.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/open/cases.hpp"

namespace windsplat::data::loader {

namespace {

struct Program {
  std::mutex mutex;
  std::string path;
  std::string cases;  // for cases of OpenFOAM and EnSight
};

Program& program() {
  static Program the_one;
  return the_one;
}

// Empty: not there.
std::string case_program_path() {
  const std::lock_guard lock(program().mutex);
  const std::string& path = program().cases;
  return !path.empty() && ::access(path.c_str(), X_OK) == 0 ? path : std::string();
}

// The executable that reads a location.
std::string program_for(const Location& location) {
  const std::string cases = case_program_path();
  if (cases.empty() || location.fetched) return program_path();
  return case_named(*direct_files(location)) == CaseFormat::none ? program_path() : cases;
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

// The loader's answer, or the error that its files have met instead.
Result<Message> checked(Files& files, Message heard) {
  files.forget_expected();
  if (auto fault = files.take_fault()) return std::move(*fault);
  if (heard.kind == Kind::failed) return decode_error(heard.payload);
  return heard;
}

std::string opening_limit(const Files& files, std::uint64_t memory_bytes) {
  const std::uint64_t bytes = std::min(opening_memory_bytes(files.opened_bytes()), memory_bytes);
  return "; the limit on memory for opening files of " + std::to_string(files.opened_bytes()) +
         " bytes is " + megabytes(bytes);
}

}  // namespace

std::string program_path() {
  const std::lock_guard lock(program().mutex);
  return program().path;
}

void set_program(std::string path) {
  const std::lock_guard lock(program().mutex);
  program().path = std::move(path);
}

void set_case_program(std::string path) {
  const std::lock_guard lock(program().mutex);
  program().cases = std::move(path);
}

bool has_case_program() { return !case_program_path().empty(); }

// Remaining time of a call.
struct RunningLoader::Patience {
  Clock::time_point end;
  Clock::time_point moved = Clock::now();  // time of the last message or progress of the loader
  Clock::time_point looked = Clock::now();
  Clock::time_point count_at{};  // when its memory is counted next
  std::chrono::nanoseconds cpu{};
  std::chrono::nanoseconds extra{};  // by which `end` may still be postponed
  std::chrono::nanoseconds postponed{};

  // The loader waited for a file that was fetched.
  void postpone(std::chrono::nanoseconds waited) {
    const auto more = std::min(waited, extra);
    extra -= more;
    postponed += more;
    end += std::chrono::duration_cast<Clock::duration>(more);
  }
};

RunningLoader::RunningLoader(Location location, const Limits& limits)
    : location_(std::move(location)), limits_(limits), memory_(limits.budget) {}

Result<std::string> RunningLoader::open() {
  const std::string path = program_for(location_);
  if (path.empty()) return make_error(ErrorKind::internal, "no loader executable is set");
  Task task;
  task.memory_bytes = limits_.memory_bytes;
  task.library_folders = limits_.library_folders;
  task.location.kind = location_.kind;
  task.location.companions = location_.companions;
  task.location.fetched = location_.fetched;
  task.location.service = location_.service;
  task.location.stem = location_.stem;
  task.location.inside = location_.inside;
  task.location.selection = location_.selection;
  task.location.list = location_.list;
  task.location.pattern = location_.pattern.substr(location_.pattern.find_last_of('/') + 1);
  for (const Location::Member& member : location_.members) {
    task.location.members.push_back({member.name, {}});
  }
  const auto open_once = [&]() -> Result<Message> {
    release();
    if (auto room = memory_.resize(loader_bytes_min); !room) return room.error();
    if (auto started = process_.start(path); !started) return started.error();
    files_ = limits_.files ? limits_.files(location_, limits_.cancelled) : direct_files(location_);
    return call({Kind::open, encode_task(task), -1, Kind::opened, "opening it", limits_.open_time});
  };
  auto answer = open_once();
  if (!answer && files_ && files_->is_unfit_for_parts()) answer = open_once();
  if (!answer) {
    Error error = answer.error();
    // Without files, the loader has already exited because of lack of memory.
    if (files_ && error.kind == ErrorKind::out_of_memory) {
      error.message += opening_limit(*files_, limits_.memory_bytes);
    }
    release();
    return error;
  }
  files_->stop_counting();
  opened_bytes_ = files_->opened_bytes();
  companions_ = files_->companions();
  if (limits_.reads_take_all) process_.allow_memory(limits_.memory_bytes);
  return std::move(answer->payload);
}

Result<Message> RunningLoader::call(const Call& what) {
  Patience patience{.end = Clock::now() + what.time, .extra = limits_.fetch_time};
  process_.allow_cpu(std::chrono::ceil<std::chrono::seconds>(what.time));
  Fate fate = send_message(process_.socket(), what.kind, what.payload, what.descriptor,
                           next_deadline(patience));
  std::size_t questions = 0;
  bool has_parts = false;
  while (fate == Fate::done) {
    Message heard;
    const std::size_t bytes_max = what.answer == Kind::opened
                                      ? std::min<std::size_t>(info_bytes_max, limits_.memory_bytes)
                                      : std::size_t{question_bytes_max};
    const Result<Fate> waited = wait(patience);
    if (!waited) return crowded_out(waited.error(), what);
    fate = *waited;
    if (fate == Fate::done) {
      fate = receive_message(process_.socket(), heard, bytes_max, Descriptors::refused,
                             next_deadline(patience));
    }
    if (fate != Fate::done) break;
    const bool is_answer = heard.kind == what.answer || heard.kind == Kind::failed ||
                           (heard.kind == Kind::whole && what.take && !has_parts);
    if (is_answer) return checked(*files_, std::move(heard));
    has_parts = has_parts || heard.kind == Kind::part;
    fate = heard.kind == Kind::progress          ? hear_progress(heard.payload)
           : heard.kind == Kind::part            ? hear_part(heard.payload, what, patience)
           : ++questions > 2 * limits_.opens_max ? Fate::broken
                                                 : answer(heard, what.kind, patience);
    patience.moved = Clock::now();
  }
  return ended(fate, what, patience);
}

Deadline RunningLoader::next_deadline(const Patience& patience) const {
  return std::min(patience.end, Clock::now() + limits_.stall_time);
}

// Waits for the next message. Processor time counts as progress, since a reader may compute for a
// long time. Errors: out_of_memory, since readers allocate while they read; cancelled.
Result<Fate> RunningLoader::wait(Patience& patience) {
  constexpr std::chrono::milliseconds look_every{50};
  constexpr std::chrono::seconds pause_min{1};
  patience.looked = Clock::now();
  for (;;) {
    const auto now = Clock::now();
    const auto cpu = process_.cpu_time();
    if (cpu != patience.cpu) patience.moved = now;
    patience.cpu = cpu;
    // A period in which this process was suspended too does not count as a stall.
    if (now - patience.looked > pause_min) patience.moved += now - patience.looked;
    patience.looked = now;
    const auto end = std::min(patience.end, patience.moved + limits_.stall_time);
    if (now >= end) return wait_for_message(process_.socket(), now);
    if (limits_.cancelled && limits_.cancelled()) {
      return make_error(ErrorKind::cancelled, "it was cancelled");
    }
    if (now >= patience.count_at) {
      patience.count_at = now + look_every;
      if (auto room = count_memory(); !room) return room.error();
    }
    const Fate fate = wait_for_message(process_.socket(), std::min(end, now + look_every));
    if (fate != Fate::late) return fate;
  }
}

Result<void> RunningLoader::count_memory() {
  return memory_.resize(std::max(loader_bytes_min, process_.private_bytes()));
}

Fate RunningLoader::hear_progress(const std::string& payload) const {
  Reader in(payload);
  const auto done = in.number<double>();
  if (!in.complete() || !(done >= 0 && done <= 1)) return Fate::broken;
  if (progress_) progress_(done);
  return Fate::done;
}

Fate RunningLoader::hear_part(const std::string& payload, const Call& what,
                              const Patience& patience) {
  if (!what.take || !what.take(payload)) return Fate::broken;
  return send_message(process_.socket(), Kind::taken, {}, -1, next_deadline(patience));
}

// Answers a question of the loader during a call of that kind.
Fate RunningLoader::answer(const Message& question, Kind during, Patience& patience) {
  const Clock::time_point begin = Clock::now();
  const auto say = [&](Kind kind, std::string_view payload, int descriptor = -1) {
    if (location_.fetched) patience.postpone(Clock::now() - begin);
    return send_message(process_.socket(), kind, payload, descriptor, next_deadline(patience));
  };
  const std::string& name = question.payload;
  if (name.size() > question_bytes_max) return Fate::broken;
  if (question.kind == Kind::ask_open || question.kind == Kind::ask_parts) {
    const bool in_parts = question.kind == Kind::ask_parts;
    const auto file = in_parts ? files_->open_parts(name) : files_->open(name);
    if (during == Kind::open) process_.allow_memory(opening_memory_bytes(files_->opened_bytes()));
    return file ? say(Kind::descriptor, encode_parts((*file)->parts()), (*file)->descriptor())
                : say(Kind::no, encode_error(file.error()));
  }
  if (question.kind == Kind::ask_bytes) {
    Reader in(question.payload);
    const auto number = in.number<std::uint64_t>();
    const auto offset = in.number<std::uint64_t>();
    const auto count = in.number<std::uint64_t>();
    if (!in.complete()) return Fate::broken;
    const auto extent = files_->fetch_part(number, offset, count);
    if (!extent) return say(Kind::no, {});
    Writer out;
    out.number(extent->begin);
    out.number(extent->end);
    return say(Kind::extent, out.bytes());
  }
  if (question.kind == Kind::expect) {
    const auto expected = decode_expected(question.payload);
    if (!expected) return Fate::broken;
    files_->expect(*expected);
    return Fate::done;
  }
  if (question.kind == Kind::close_parts) {
    Reader in(question.payload);
    files_->close_parts(in.number<std::uint64_t>());
    return in.complete() ? Fate::done : Fate::broken;
  }
  if (question.kind == Kind::ask_list) {
    const auto names = files_->list(name);
    return names ? say(Kind::names, encode_names(*names))
                 : say(Kind::no, encode_error(names.error()));
  }
  if (question.kind == Kind::ask_exists) {
    return say(files_->exists(name) ? Kind::yes : Kind::no, {});
  }
  if (question.kind == Kind::ask_library) {
    const Descriptor file = open_of_library(limits_.library_folders, name);
    return file ? say(Kind::descriptor, {}, file.number()) : say(Kind::no, {});
  }
  return Fate::broken;
}

Error RunningLoader::crowded_out(const Error& error, const Call& what) {
  release();
  return make_error(error.kind,
                    loader_text() + " was terminated while " + what.doing + ": " + error.message);
}

// Returns why no answer was received. The loader has ended afterwards.
Error RunningLoader::ended(Fate fate, const Call& what, const Patience& patience) {
  constexpr std::chrono::milliseconds time_to_end{500};
  std::string how = process_.end(fate == Fate::closed ? time_to_end : std::chrono::milliseconds(0));
  release();
  if (fate == Fate::late && Clock::now() < patience.end) {
    how = "made no progress for " + seconds_text(limits_.stall_time) + " and was terminated";
  } else if (fate == Fate::late) {
    how = "was terminated after " +
          seconds_text(what.time +
                       std::chrono::duration_cast<std::chrono::milliseconds>(patience.postponed));
  } else if (fate != Fate::closed) {
    how = "violated the protocol and was terminated";
  } else if (how.ends_with(" 127")) {  // of the dynamic linker
    how += " (are the libraries that it needs installed? For cases: the package libvtk9.1)";
  }
  return make_error(ErrorKind::bad_data, loader_text() + ' ' + how + " while " + what.doing);
}

std::string RunningLoader::loader_text() const {
  return "the loader of " +
         in_quotes(location_.members.empty() ? location_.stem : location_.members.front().name);
}

void RunningLoader::release() {
  process_.end();
  files_.reset();
  static_cast<void>(memory_.resize(0));
}

}  // namespace windsplat::data::loader
