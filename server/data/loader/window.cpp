// Messages part and taken, in the loader.
#include "server/data/loader/window.hpp"

#include <unistd.h>

#include <csignal>
#include <cstdint>

#include "server/data/loader/bytes.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::data::loader {

namespace {

// Halves that the daemon has not taken yet. Changed by a signal handler too, but only while the
// loader is in a system call.
volatile std::sig_atomic_t& pending() {
  static volatile std::sig_atomic_t count = 0;
  return count;
}

}  // namespace

bool is_of_window(const Frame& frame) {
  if (frame.kind != static_cast<std::uint32_t>(Kind::taken) || frame.bytes != 0) return false;
  pending() = pending() - 1;
  return true;
}

float* Window::room() {
  wait_for(1);
  return memory_ + half_ * layers_ * layer_;
}

void Window::take(const VolumePart& part) {
  // Values beyond the range of floats; the daemon makes the mask common to all components.
  mask_volume(memory_ + half_ * layers_ * layer_, part.layers * layer_, 1);
  Writer out;
  out.count(part.component);
  out.count(part.first);
  out.count(part.layers);
  out.count(half_);
  if (send_message(socket_, Kind::part, out.bytes(), -1, {}) != Fate::done) ::_exit(1);
  pending() = pending() + 1;
  half_ = 1 - half_;
}

void Window::finish() const { wait_for(0); }

void Window::wait_for(int pending_max) const {
  while (pending() > pending_max) {
    Frame frame;
    if (receive_bytes(socket_, reinterpret_cast<char*>(&frame), sizeof frame, nullptr, {}) !=
            Fate::done ||
        !is_of_window(frame)) {
      ::_exit(1);  // the channel to the daemon is out of sync
    }
  }
}

}  // namespace windsplat::data::loader
