// Serialises values to the bytes of a message and back. The reader does not trust its input:
// missing or out-of-range values become zeros and finally an error.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace windsplat::data::loader {

class Writer {
 public:
  template <class T>
  void number(T value) {
    static_assert(std::is_arithmetic_v<T>);
    const auto at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  void count(std::size_t value) { number(static_cast<std::uint64_t>(value)); }
  void text(std::string_view value) {
    count(value.size());
    bytes_ += value;
  }
  void doubles(const std::vector<double>& values) { numbers(values); }
  template <class T>
  void numbers(const std::vector<T>& values) {
    static_assert(std::is_arithmetic_v<T>);
    count(values.size());
    const auto at = bytes_.size();
    bytes_.resize(at + values.size() * sizeof(T));
    // An empty vector has no address to copy from.
    if (!values.empty()) {
      std::memcpy(bytes_.data() + at, values.data(), values.size() * sizeof(T));
    }
  }
  // Reserves exactly this many more bytes.
  void reserve(std::size_t more) { bytes_.reserve(bytes_.size() + more); }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  T number() {
    static_assert(std::is_arithmetic_v<T> && !std::is_same_v<T, bool>);
    T value{};
    if (rest_.size() < sizeof value) {
      fail();
      return value;
    }
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_.remove_prefix(sizeof value);
    return value;
  }
  // The number of items that follow, each of at least `each` bytes; at most `most`.
  std::size_t count(std::size_t most, std::size_t each) {
    const auto value = number<std::uint64_t>();
    if (value > most || value > rest_.size() / each) {
      fail();
      return 0;
    }
    return static_cast<std::size_t>(value);
  }
  std::string text(std::size_t most) {
    const std::size_t size = count(most, 1);
    std::string out(rest_.substr(0, size));
    rest_.remove_prefix(size);
    return out;
  }
  std::vector<double> doubles(std::size_t most) { return numbers<double>(most); }
  template <class T>
  std::vector<T> numbers(std::size_t most) {
    static_assert(std::is_arithmetic_v<T>);
    std::vector<T> out(count(most, sizeof(T)));
    if (!out.empty()) std::memcpy(out.data(), rest_.data(), out.size() * sizeof(T));
    rest_.remove_prefix(out.size() * sizeof(T));
    return out;
  }
  void fail() {
    sound_ = false;
    rest_ = {};
  }
  [[nodiscard]] bool sound() const { return sound_; }
  // All values were present and no bytes remain.
  [[nodiscard]] bool complete() const { return sound_ && rest_.empty(); }

 private:
  std::string_view rest_;
  bool sound_ = true;
};

}  // namespace windsplat::data::loader
