// A permutation of a counter with a random start.
#include "server/http/request_id.hpp"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cstdio>
#include <random>

namespace windsplat::http {

bool is_request_id(std::string_view text) {
  const auto fits = [](char c) {
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '.' ||
           c == '_' || c == '-';
  };
  return !text.empty() && text.size() <= request_id_bytes_max &&
         std::all_of(text.begin(), text.end(), fits);
}

RequestIds::RequestIds() : state_(std::random_device()()) {
  state_ = state_ << 32 | std::random_device()();
}

// Steele, Lea, Flood: SplitMix (2014).
std::string RequestIds::next() {
  state_ += 0x9e3779b97f4a7c15U;
  std::uint64_t mixed = state_;
  mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9U;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebU;
  mixed ^= mixed >> 31;
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016" PRIx64, mixed);
  return text.data();
}

}  // namespace windsplat::http
