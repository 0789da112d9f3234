// The floats of a volume: written once by its producer, then shared read-only.
#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

namespace windsplat::data {

// A block of floats of fixed size. Large blocks use huge pages where available: renderers access
// whole volumes, and mapping them page by page took as long as reading them. Copies are deep.
class Samples {
 public:
  Samples() = default;
  explicit Samples(std::size_t count);  // zeros
  Samples(std::vector<float> values);   // NOLINT: a vector is samples
  Samples(std::initializer_list<float> values) : Samples(std::vector<float>(values)) {}
  Samples(const Samples& other) : Samples(other.size()) {
    std::copy(other.begin(), other.end(), data());
  }
  Samples(Samples&& other) noexcept
      : memory_(std::move(other.memory_)), count_(std::exchange(other.count_, 0)) {}
  Samples& operator=(Samples other) noexcept {
    memory_.swap(other.memory_);
    std::swap(count_, other.count_);
    return *this;
  }
  ~Samples() = default;

  [[nodiscard]] std::size_t size() const { return count_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }
  [[nodiscard]] const float* data() const { return memory_.get(); }
  [[nodiscard]] float* data() { return memory_.get(); }
  [[nodiscard]] const float* begin() const { return data(); }
  [[nodiscard]] const float* end() const { return data() + size(); }
  const float& operator[](std::size_t i) const { return data()[i]; }
  float& operator[](std::size_t i) { return data()[i]; }
  friend bool operator==(const Samples& a, const Samples& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

 private:
  std::shared_ptr<float> memory_;  // never shared with another buffer
  std::size_t count_ = 0;
};

}  // namespace windsplat::data
