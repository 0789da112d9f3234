// The input is a socket and not a pipe: writing to it with MSG_NOSIGNAL raises no SIGPIPE.
#include "server/movie/child.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <system_error>
#include <thread>
#include <utility>

#include "server/base/spawn.hpp"

namespace windsplat::movie {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::size_t errors_bytes_max = 4096;
constexpr std::size_t all_bytes_max = std::size_t{1} << 20U;
constexpr int look_every_ms = 50;  // at the cancel token
constexpr int first_free = 16;     // above the numbers that the child gets

Error not_started(const std::string& program, int reason) {
  return make_error(ErrorKind::internal, in_quotes(program) + " cannot be started: " +
                                             std::generic_category().message(reason));
}

Error was_cancelled() { return make_error(ErrorKind::cancelled, "the movie was cancelled"); }

data::Descriptor moved_up(data::Descriptor from) {
  return data::Descriptor(::fcntl(from.number(), F_DUPFD_CLOEXEC, first_free));
}

std::vector<std::string> environment_of_child() {
  std::vector<std::string> out{"LC_ALL=C"};
  // NOLINTNEXTLINE(concurrency-mt-unsafe): no thread sets any
  const char* const libraries = std::getenv("LD_LIBRARY_PATH");
  if (libraries != nullptr) out.push_back(std::string("LD_LIBRARY_PATH=") + libraries);
  return out;
}

struct Ends {
  int input, output, errors, file;  // of the child; file -1: none
};

int start_with(const std::string& program, std::vector<std::string> words, const Ends& ends,
               pid_t& id) {
  std::vector<PassedDescriptor> passed{{ends.input, 0}, {ends.output, 1}, {ends.errors, 2}};
  if (ends.file >= 0) passed.push_back({ends.file, file_of_child});
  return spawn(program, std::move(words), environment_of_child(), passed,
               file_of_child + (ends.file >= 0 ? 1 : 0), id);
}

}  // namespace

Result<Child> Child::start(const std::string& program, std::vector<std::string> arguments, int file,
                           Keeps keeps, std::chrono::milliseconds patience) {
  Child child;
  child.patience_ = patience;
  child.messages_bytes_max_ = keeps == Keeps::all ? all_bytes_max : errors_bytes_max;
  child.name_ = program.substr(program.rfind('/') + 1);
  std::array<int, 2> pair{-1, -1};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    return not_started(program, errno);
  }
  child.input_.reset(pair[0]);
  const data::Descriptor input = moved_up(data::Descriptor(pair[1]));
  if (::pipe2(pair.data(), O_CLOEXEC) != 0) return not_started(program, errno);
  child.errors_.reset(pair[0]);
  const data::Descriptor errors = moved_up(data::Descriptor(pair[1]));
  const data::Descriptor null =
      moved_up(data::Descriptor(::open("/dev/null", O_WRONLY | O_CLOEXEC)));
  const data::Descriptor copy(file < 0 ? -1 : ::fcntl(file, F_DUPFD_CLOEXEC, first_free));
  if (!input || !errors || !null || (file >= 0 && !copy)) return not_started(program, errno);
  for (const int ours : {child.input_.number(), child.errors_.number()}) {
    if (::fcntl(ours, F_SETFL, O_NONBLOCK) != 0) return not_started(program, errno);
  }
  arguments.insert(arguments.begin(), child.name_);
  const Ends ends{input.number(), (keeps == Keeps::all ? errors : null).number(), errors.number(),
                  copy.number()};
  if (const int fault = start_with(program, std::move(arguments), ends, child.id_); fault != 0) {
    child.id_ = -1;
    return not_started(program, fault);
  }
  return child;
}

Child::Child(Child&& other) noexcept
    : name_(std::move(other.name_)),
      id_(std::exchange(other.id_, -1)),
      input_(std::move(other.input_)),
      errors_(std::move(other.errors_)),
      messages_(std::move(other.messages_)),
      messages_bytes_max_(other.messages_bytes_max_),
      patience_(other.patience_) {}

Child::~Child() { kill_and_reap(); }

void Child::kill_and_reap() noexcept {
  if (id_ <= 0) return;
  ::kill(id_, SIGKILL);
  int status = 0;
  while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
  }
  id_ = -1;
}

void Child::read_messages() {
  std::array<char, 1024> bytes{};
  while (errors_) {
    const ssize_t got = ::read(errors_.number(), bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return;
    if (got == 0) return errors_.reset();
    messages_.append(bytes.data(), static_cast<std::size_t>(got));
    if (messages_.size() > messages_bytes_max_) {
      messages_.erase(0, messages_.size() - messages_bytes_max_);
    }
  }
}

Clock::duration Child::wait(bool to_write) {
  const Clock::time_point since = Clock::now();
  // A negative descriptor is ignored (poll(2)).
  std::array<pollfd, 2> events{
      {{errors_.number(), POLLIN, 0}, {to_write ? input_.number() : -1, POLLOUT, 0}}};
  ::poll(events.data(), events.size(), look_every_ms);
  read_messages();
  return std::min<Clock::duration>(Clock::now() - since, std::chrono::milliseconds(look_every_ms));
}

Result<void> Child::write(std::span<const std::uint8_t> bytes, const CancelToken& cancel) {
  Clock::duration waited{};
  while (!bytes.empty()) {
    if (cancel.cancelled()) return was_cancelled();
    if (waited > patience_) return stalled("read nothing");
    const ssize_t sent = ::send(input_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent >= 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(sent));
      waited = {};
    } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
      waited += wait(true);
    } else if (errno != EINTR) {  // it reads no more: it has ended, or is about to
      const auto ended = status(cancel);
      return ended ? failed(*ended) : ended.error();
    }
  }
  return {};
}

Result<int> Child::status(const CancelToken& cancel) {
  input_.reset();
  Clock::duration waited{};
  while (errors_) {
    if (cancel.cancelled()) return was_cancelled();
    if (waited > patience_) return stalled("did not end");
    waited += wait(false);
  }
  while (true) {
    int status = 0;
    const pid_t ended = ::waitpid(id_, &status, WNOHANG);
    if (ended == id_) {
      id_ = -1;
      return status;
    }
    if (cancel.cancelled()) return was_cancelled();
    if (waited > patience_) return stalled("did not end");
    constexpr std::chrono::milliseconds moment{1};
    std::this_thread::sleep_for(moment);
    waited += moment;
  }
}

Error Child::stalled(const char* how) const {
  return make_error(
      ErrorKind::internal,
      name_ + ' ' + how + " for " + std::to_string(patience_.count()) + " ms and was terminated");
}

Error Child::failed(int status) const {
  std::string text = name_ + ' ';
  text += WIFSIGNALED(status) ? "was terminated by signal " + std::to_string(WTERMSIG(status))
                              : "ended with code " + std::to_string(WEXITSTATUS(status));
  std::string said = messages_;
  while (!said.empty() && (said.back() == '\n' || said.back() == ' ')) said.pop_back();
  constexpr std::size_t said_bytes_max = 600;  // the end, where the reason is
  if (said.size() > said_bytes_max) said.erase(0, said.size() - said_bytes_max);
  std::replace(said.begin(), said.end(), '\n', ' ');
  if (!said.empty()) text += ": " + printable(said, 1000);
  // ENOSPC, EDQUOT and EFBIG in LC_ALL=C.
  constexpr std::array faults{"No space left on device", "Disk quota exceeded", "File too large"};
  const bool too_large = WIFSIGNALED(status) && WTERMSIG(status) == SIGXFSZ;
  const bool full = too_large || std::any_of(faults.begin(), faults.end(), [&](const char* fault) {
                      return said.find(fault) != std::string::npos;
                    });
  return make_error(full ? ErrorKind::out_of_memory : ErrorKind::internal, std::move(text));
}

Result<void> Child::finish(const CancelToken& cancel) {
  const auto ended = status(cancel);
  if (!ended) return ended.error();
  if (WIFEXITED(*ended) && WEXITSTATUS(*ended) == 0) return {};
  return failed(*ended);
}

}  // namespace windsplat::movie
