// A file descriptor kept for when there is no other left: with it the next connection is taken and
// closed, where it would otherwise wait, and its client with it, until others have gone.
#pragma once

namespace windsplat::net {

class SpareDescriptor {
 public:
  SpareDescriptor();
  ~SpareDescriptor();
  SpareDescriptor(const SpareDescriptor&) = delete;
  SpareDescriptor& operator=(const SpareDescriptor&) = delete;

  // Takes what waits at the listening socket and closes it; whether there was anything.
  bool turn_away(int listening);

 private:
  int spare_ = -1;
};

}  // namespace windsplat::net
