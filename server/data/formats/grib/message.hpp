// A GRIB message decoded by ecCodes, and its keys. The caller holds the lock of the library.
#pragma once

#include <eccodes.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace windsplat::data::grib {

class Message {
 public:
  explicit Message(const std::vector<unsigned char>& bytes)
      : handle_(codes_handle_new_from_message(nullptr, bytes.data(), bytes.size())) {}
  ~Message() {
    if (handle_ != nullptr) codes_handle_delete(handle_);
  }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;

  [[nodiscard]] codes_handle* handle() const { return handle_; }
  [[nodiscard]] std::string text(const char* key) const {
    std::array<char, 512> out{};
    std::size_t length = out.size();
    if (codes_get_string(handle_, key, out.data(), &length) != CODES_SUCCESS) return {};
    return {out.data()};
  }
  [[nodiscard]] long whole(const char* key, long otherwise) const {
    long value = 0;
    return codes_get_long(handle_, key, &value) == CODES_SUCCESS ? value : otherwise;
  }
  [[nodiscard]] double number(const char* key) const {
    double value = 0;
    return codes_get_double(handle_, key, &value) == CODES_SUCCESS
               ? value
               : std::numeric_limits<double>::quiet_NaN();
  }
  // The expected count of numbers; none otherwise.
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t expected) const {
    std::size_t count = 0;
    if (codes_get_size(handle_, key, &count) != CODES_SUCCESS || count != expected) return {};
    std::vector<double> out(count);
    if (codes_get_double_array(handle_, key, out.data(), &count) != CODES_SUCCESS) return {};
    out.resize(count == expected ? count : 0);
    return out;
  }
  // The expected count of positive whole numbers; none otherwise.
  [[nodiscard]] std::vector<std::size_t> counts(const char* key, std::size_t expected) const {
    std::size_t count = 0;
    if (codes_get_size(handle_, key, &count) != CODES_SUCCESS || count != expected) return {};
    std::vector<long> read(count);
    if (codes_get_long_array(handle_, key, read.data(), &count) != CODES_SUCCESS ||
        count != expected || *std::min_element(read.begin(), read.end()) < 1) {
      return {};
    }
    return {read.begin(), read.end()};
  }

 private:
  codes_handle* handle_;
};

}  // namespace windsplat::data::grib
