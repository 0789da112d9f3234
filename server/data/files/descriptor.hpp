// An open file descriptor that closes itself.
#pragma once

#include <unistd.h>

#include <utility>

namespace windsplat::data {

class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(other.give()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    if (this != &other) reset(other.give());
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() { reset(); }

  [[nodiscard]] int number() const { return number_; }  // -1: none
  explicit operator bool() const { return number_ >= 0; }
  [[nodiscard]] int give() { return std::exchange(number_, -1); }
  void reset(int number = -1) {
    if (number_ >= 0) ::close(number_);
    number_ = number;
  }

 private:
  int number_ = -1;
};

}  // namespace windsplat::data
