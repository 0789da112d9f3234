// A reserved file descriptor: when all others are in use, it serves to accept and close the next
// connection instead of leaving the client waiting.
#pragma once

namespace windsplat::transport {

class SpareDescriptor {
 public:
  SpareDescriptor();
  ~SpareDescriptor();
  SpareDescriptor(const SpareDescriptor&) = delete;
  SpareDescriptor& operator=(const SpareDescriptor&) = delete;

  // Accepts and closes a pending connection; returns whether there was one.
  bool turn_away(int listening);

 private:
  int spare_ = -1;
};

}  // namespace windsplat::transport
