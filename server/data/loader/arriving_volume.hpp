// A volume that a loader passes in parts, seen by the daemon: copies, masks and measures each part
// while the loader reads the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "server/data/model/volume.hpp"

namespace windsplat::data::loader {

// The window of volumes with such layers.
struct WindowSize {
  std::size_t layer = 0;   // samples of a layer
  std::size_t layers = 0;  // of each of its two halves
  [[nodiscard]] std::size_t floats() const { return 2 * layer * layers; }
};

// No layers: volumes of these dimensions are passed as a whole, because they fit into a window or
// their layers do not.
WindowSize window_size(const Volume& volume);

class ArrivingVolume {
 public:
  // volume.values: zeros. `window`: floats of both halves, which the loader may write at any time.
  ArrivingVolume(Volume& volume, const WindowSize& size, const float* window);

  // Takes the part that a message describes. False: it is malformed, or came before.
  [[nodiscard]] bool take(const std::string& payload);
  [[nodiscard]] bool is_complete() const { return complete_ == arrived_.size(); }
  // Sets range and masked. False: values are infinite.
  [[nodiscard]] bool finish() const;

 private:
  Volume& volume_;
  WindowSize size_;
  const float* window_;
  std::vector<std::uint8_t> arrived_;  // components of each layer, one bit each
  std::size_t complete_ = 0;           // layers of which all components have arrived
  VolumeMeasure measure_;
};

}  // namespace windsplat::data::loader
