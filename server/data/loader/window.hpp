// Shared memory through which a volume passes in parts, as the loader sees it: two halves, one of
// which is filled while the daemon takes the other.
#pragma once

#include <cstddef>

#include "server/data/loader/channel.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data::loader {

// Counts a half that the daemon has taken. False: the frame is another message. Async-signal-safe:
// the answers to requests of a signal handler come after these frames.
bool is_of_window(const Frame& frame);

class Window final : public PartTaker {
 public:
  // `memory`: two halves of `layers` layers of `layer` samples each. Errors of the socket end the
  // process, as the daemon has then closed it.
  Window(int socket, float* memory, std::size_t layer, std::size_t layers)
      : socket_(socket), memory_(memory), layer_(layer), layers_(layers) {}

  [[nodiscard]] std::size_t layers_max() const override { return layers_; }
  // Waits until its half is free.
  float* room() override;
  void take(const VolumePart& part) override;
  // Waits until the daemon has taken all parts.
  void finish() const;

 private:
  void wait_for(int pending_max) const;

  int socket_;
  float* memory_;
  std::size_t layer_;
  std::size_t layers_;
  std::size_t half_ = 0;
};

}  // namespace windsplat::data::loader
