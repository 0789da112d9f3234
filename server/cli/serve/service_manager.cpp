// Environment variables -> a descriptor and datagrams.
#include "server/cli/serve/service_manager.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "server/base/log.hpp"

namespace windsplat::cli {
namespace {

constexpr int first_passed = 3;    // SD_LISTEN_FDS_START
constexpr timeval patience{1, 0};  // with a manager that does not read

// The value of a variable, which is removed; empty if it is not set.
std::string taken(const char* name) {
  // No thread has started that could change the environment.
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe)
  std::string text = value == nullptr ? "" : value;
  ::unsetenv(name);  // NOLINT(concurrency-mt-unsafe)
  return text;
}

std::optional<std::int64_t> number(const std::string& text) {
  std::int64_t value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || fault != std::errc() || end != text.data() + text.size() || value < 0) {
    return std::nullopt;
  }
  return value;
}

// The path of a UNIX socket, as of --listen; empty if it has none: an abstract name has no mode, so
// that every user of the machine may connect.
std::string unix_address(const sockaddr_un& name, socklen_t size) {
  constexpr std::size_t start = offsetof(sockaddr_un, sun_path);
  if (size <= start || name.sun_path[0] != '/') return {};
  return "unix:" + std::string(name.sun_path, ::strnlen(name.sun_path, size - start));
}

// "ADDRESS:PORT" or "unix:PATH" of a bound socket; empty if it is none of these.
std::string address_of(int socket) {
  sockaddr_storage name{};
  socklen_t size = sizeof name;
  if (::getsockname(socket, reinterpret_cast<sockaddr*>(&name), &size) != 0) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (name.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(name);
    ::inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    return text.data() + (':' + std::to_string(ntohs(v4.sin_port)));
  }
  if (name.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(name);
    ::inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
    return '[' + std::string(text.data()) + "]:" + std::to_string(ntohs(v6.sin6_port));
  }
  if (name.ss_family == AF_UNIX) return unix_address(reinterpret_cast<sockaddr_un&>(name), size);
  return {};
}

bool has_option(int socket, int option, int wanted) {
  int value = 0;
  socklen_t size = sizeof value;
  return ::getsockopt(socket, SOL_SOCKET, option, &value, &size) == 0 && value == wanted;
}

Result<std::optional<PassedSocket>> passed_socket() {
  const auto process = number(taken("LISTEN_PID"));
  const std::string counted = taken("LISTEN_FDS");
  taken("LISTEN_FDNAMES");
  if (!process || *process != ::getpid() || counted.empty() || counted == "0") {
    return std::optional<PassedSocket>();
  }
  if (number(counted) != 1) {
    return make_error(ErrorKind::invalid, "the service manager passed " + printable(counted) +
                                              " sockets (LISTEN_FDS); serve listens on one");
  }
  const std::string address = address_of(first_passed);
  if (address.empty() || !has_option(first_passed, SO_TYPE, SOCK_STREAM) ||
      !has_option(first_passed, SO_ACCEPTCONN, 1)) {
    return make_error(ErrorKind::invalid,
                      "the socket of the service manager (descriptor 3) is not a listening TCP "
                      "socket or UNIX socket with a path: ListenStream=ADDRESS:PORT or "
                      "ListenStream=/PATH, and Accept=no are needed");
  }
  ::fcntl(first_passed, F_SETFD, FD_CLOEXEC);
  return std::optional(PassedSocket{first_passed, address});
}

// A socket connected to the path or abstract name ("@name"); -1 if `name` is empty or of no use.
int connected_to(const std::string& name) {
  if (name.empty()) return -1;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const bool known = name.front() == '/' || name.front() == '@';
  if (!known || name.size() >= sizeof address.sun_path) {
    log::warn("the service manager's socket is not understood", {{"NOTIFY_SOCKET", name}});
    return -1;
  }
  std::copy(name.begin(), name.end(), address.sun_path);
  if (name.front() == '@') address.sun_path[0] = '\0';
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (socket >= 0 &&
      ::setsockopt(socket, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) == 0 &&
      ::connect(socket, reinterpret_cast<sockaddr*>(&address), size) == 0) {
    return socket;
  }
  log::warn("the service manager cannot be told of the state",
            {{"NOTIFY_SOCKET", name}, {"fault", std::generic_category().message(errno)}});
  if (socket >= 0) ::close(socket);
  return -1;
}

}  // namespace

Result<std::shared_ptr<const ServiceManager>> ServiceManager::from_environment() {
  const std::shared_ptr<ServiceManager> manager(new ServiceManager);
  const std::string notified = taken("NOTIFY_SOCKET");
  const auto watched_us = number(taken("WATCHDOG_USEC"));
  const std::string watched = taken("WATCHDOG_PID");
  auto socket = passed_socket();
  if (!socket) return socket.error();
  manager->socket_ = std::move(*socket);
  manager->told_ = connected_to(notified);
  const bool is_watched = watched.empty() || number(watched) == ::getpid();
  if (manager->told_ >= 0 && watched_us && is_watched) {
    manager->alive_every_ = std::chrono::milliseconds(*watched_us / 2000);
  }
  return std::shared_ptr<const ServiceManager>(manager);
}

ServiceManager::~ServiceManager() {
  if (told_ >= 0) ::close(told_);
}

void ServiceManager::tell(const std::string& text, int flags) const {
  if (told_ < 0) return;
  if (::send(told_, text.data(), text.size(), MSG_NOSIGNAL | flags) < 0) {
    log::warn("the service manager cannot be told of the state",
              {{"state", text}, {"fault", std::generic_category().message(errno)}});
  }
}

void ServiceManager::ready(std::string_view status) const {
  tell("READY=1\nSTATUS=" + std::string(status), 0);
}

void ServiceManager::reloading() const {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  const auto us = std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000;
  tell("RELOADING=1\nMONOTONIC_USEC=" + std::to_string(us), 0);
}

void ServiceManager::stopping() const { tell("STOPPING=1", 0); }

// The network thread must not wait; the next call comes before the manager's time is over.
void ServiceManager::alive() const { tell("WATCHDOG=1", MSG_DONTWAIT); }

}  // namespace windsplat::cli
