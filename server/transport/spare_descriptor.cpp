// Releases the descriptor for one accept and reopens it.
#include "server/transport/spare_descriptor.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace windsplat::transport {
namespace {

int take() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

}  // namespace

SpareDescriptor::SpareDescriptor() : spare_(take()) {}

SpareDescriptor::~SpareDescriptor() {
  if (spare_ >= 0) ::close(spare_);
}

bool SpareDescriptor::turn_away(int listening) {
  if (spare_ >= 0) ::close(spare_);
  // The listening socket is non-blocking, as Asio sets it.
  const int taken = ::accept4(listening, nullptr, nullptr, SOCK_CLOEXEC);
  if (taken >= 0) ::close(taken);
  spare_ = take();
  return taken >= 0;
}

}  // namespace windsplat::transport
