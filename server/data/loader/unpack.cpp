// Daemon side: the loader is believed nothing. Names lead nowhere else, files are new, and what is
// written fits what was reserved.
#include "server/data/loader/unpack.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <span>
#include <string>
#include <utility>

#include "server/base/disk_error.hpp"
#include "server/data/archive/zip.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/loader/process.hpp"
#include "server/data/loader/running_loader.hpp"

namespace windsplat::data::loader {

namespace {

constexpr std::chrono::seconds time_at_first{60};
constexpr std::uint64_t bytes_per_second = 10'000'000;
constexpr std::chrono::milliseconds look_every{100};  // whether it was cancelled
// Of the end of a message, from its first byte on.
constexpr std::chrono::milliseconds message_time{5'000};

Error not_stored(int fault) { return disk_error(fault, "the archive cannot be unpacked"); }

Error loader_failed(const std::string& how) {
  return make_error(ErrorKind::bad_data, "the loader of the archive " + how);
}

Error twice(const std::string& name) {
  return make_error(ErrorKind::bad_data,
                    "the ZIP archive has an entry '" + printable(name, 80) + "' that it has twice");
}

std::uint64_t blocks_of(std::uint64_t bytes) {
  return bytes / archive::block_bytes + (bytes % archive::block_bytes > 0 ? 1 : 0);
}

// Files below a folder, in the order in which they come.
class Written {
 public:
  explicit Written(std::filesystem::path folder) : folder_(std::move(folder)) {}

  void allow(std::uint64_t bytes) { blocks_left_ = bytes / archive::block_bytes; }

  Result<void> begin(const std::string& name) {
    file_.reset();
    if (!archive::is_path_within(name)) return loader_failed("has sent a name that is no path");
    if (auto ok = make_folders(name); !ok) return ok;
    if (name.back() == '/') return {};
    if (auto ok = charge(1); !ok) return ok;
    file_ =
        Descriptor(::open((folder_ / name).c_str(),
                          O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR));
    bytes_ = 0;
    if (file_) return {};
    return errno == EEXIST ? twice(name) : not_stored(errno);
  }

  Result<void> add(std::span<const char> bytes) {
    if (!file_) return loader_failed("has sent bytes of no file");
    // The first block is that of the file itself.
    const std::uint64_t more = std::max<std::uint64_t>(1, blocks_of(bytes_ + bytes.size())) -
                               std::max<std::uint64_t>(1, blocks_of(bytes_));
    if (auto ok = charge(more); !ok) return ok;
    bytes_ += bytes.size();
    while (!bytes.empty()) {
      const ssize_t done = ::write(file_.number(), bytes.data(), bytes.size());
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) return not_stored(errno);
      bytes = bytes.subspan(static_cast<std::size_t>(done));
    }
    return {};
  }

 private:
  Result<void> charge(std::uint64_t blocks) {
    if (blocks > blocks_left_) return loader_failed("has sent more than it announced");
    blocks_left_ -= blocks;
    return {};
  }

  // Those above a file, or the folder itself.
  Result<void> make_folders(const std::string& name) {
    for (std::size_t at = name.find('/'); at != std::string::npos; at = name.find('/', at + 1)) {
      const std::filesystem::path path = folder_ / name.substr(0, at);
      if (::mkdir(path.c_str(), S_IRWXU) == 0) {
        if (auto ok = charge(1); !ok) return ok;
        continue;
      }
      const int fault = errno;
      struct stat facts {};
      if (fault != EEXIST) return not_stored(fault);
      if (::lstat(path.c_str(), &facts) != 0) return not_stored(errno);
      if (!S_ISDIR(facts.st_mode)) return twice(name.substr(0, at));
    }
    return {};
  }

  const std::filesystem::path folder_;
  Descriptor file_;
  std::uint64_t bytes_ = 0;  // of the file
  std::uint64_t blocks_left_ = 0;
};

// The next message. Errors: cancelled.
Result<Fate> hear(int socket, const Unpacking& what, Clock::time_point end, Message& heard) {
  end = std::min(end, Clock::now() + what.stall_time);
  for (;;) {
    if (what.cancel.cancelled()) {
      return make_error(ErrorKind::cancelled, "the unpacking was cancelled");
    }
    const Fate fate = wait_for_message(socket, std::min(end, Clock::now() + look_every));
    if (fate == Fate::late && Clock::now() < end) continue;
    if (fate != Fate::done) return fate;
    return receive_message(socket, heard, question_bytes_max, Descriptors::refused,
                           std::min(end, Clock::now() + message_time));
  }
}

struct Taken {
  bool is_end = false;
  std::chrono::seconds more_time{0};  // for the loader
};

// One message of the loader.
Result<Taken> take(const Message& heard, const Unpacking& what, Written& written) {
  Taken out;
  out.is_end = heard.kind == Kind::unpacked;
  if (out.is_end) return out;
  if (heard.kind == Kind::failed) return decode_error(heard.payload);
  Result<void> done = loader_failed("violated the protocol");
  if (heard.kind == Kind::entries) {
    Reader in(heard.payload);
    const auto bytes = in.number<std::uint64_t>();
    if (!in.complete()) return done.error();
    if (done = what.reserve(bytes); done) {
      written.allow(bytes);
      out.more_time = std::chrono::seconds(bytes / bytes_per_second);
    }
  } else if (heard.kind == Kind::entry) {
    done = written.begin(heard.payload);
  } else if (heard.kind == Kind::entry_bytes) {
    done = written.add(heard.payload);
  }
  if (!done) return done.error();
  return out;
}

}  // namespace

Result<void> unpack(const Unpacking& what) {
  const Descriptor archive(::open(what.archive.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!archive) return not_stored(errno);
  const std::string program = program_path();
  if (program.empty()) return make_error(ErrorKind::internal, "no loader executable is set");
  Process process;
  if (auto started = process.start(program); !started) return started;
  process.allow_cpu(time_at_first);
  Written written(what.folder);
  auto end = Clock::now() + time_at_first;
  Fate fate = send_message(process.socket(), Kind::unpack, {}, archive.number(), end);
  bool is_first = true;
  while (fate == Fate::done) {
    Message heard;
    const auto received = hear(process.socket(), what, end, heard);
    if (!received) return received.error();
    fate = *received;
    if (fate != Fate::done) break;
    // What follows is bounded by the first message; room is reserved once.
    const bool opens = heard.kind == Kind::entries;
    if (opens != is_first && heard.kind != Kind::failed) {
      return loader_failed("violated the protocol");
    }
    is_first = false;
    const auto begun = Clock::now();
    const auto last = take(heard, what, written);
    if (!last) return last.error();
    if (last->is_end) return {};
    // The loader has no part in the time that writing takes.
    end += last->more_time + (Clock::now() - begun);
    if (opens) process.allow_cpu(time_at_first + last->more_time);
  }
  if (fate == Fate::late) return loader_failed("took too long and was terminated");
  if (fate != Fate::closed) return loader_failed("violated the protocol and was terminated");
  constexpr std::chrono::milliseconds time_to_end{500};
  return loader_failed(process.end(time_to_end));
}

}  // namespace windsplat::data::loader
