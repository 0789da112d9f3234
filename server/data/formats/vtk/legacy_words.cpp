#include "server/data/formats/vtk/legacy_words.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "server/base/ascii.hpp"
#include "server/data/bytes/text.hpp"

namespace windsplat::data::vtk {

namespace {

constexpr std::size_t text_buffer_bytes = std::size_t{1} << 18;
constexpr std::size_t line_max = 4096;

}  // namespace

Result<std::string> Scanner::line() {
  std::string out;
  while (!ended()) {
    const auto byte = next();
    if (!byte) return byte.error();
    if (*byte == '\n') break;
    out += *byte;
    if (out.size() > line_max) return fault("a line longer than 4096 bytes");
  }
  return std::string(trim(out));
}

Result<std::string> Scanner::word() {
  std::string out;
  while (!ended()) {
    const auto byte = next();
    if (!byte) return byte.error();
    if (is_blank(*byte)) {
      if (out.empty()) continue;
      --at_;
      break;
    }
    out += *byte;
    if (out.size() > line_max) return fault("a word longer than 4096 bytes");
  }
  return out;
}

Result<void> Scanner::skip_words(std::uint64_t count) {
  bool within = false;
  std::uint64_t seen = 0;
  while (!ended()) {
    const auto byte = next();
    if (!byte) return byte.error();
    const bool blank = is_blank(*byte);
    if (blank && within && seen == count) {
      --at_;
      return {};
    }
    if (!blank && !within) {
      if (seen == count) {
        --at_;
        return {};
      }
      ++seen;
    }
    within = !blank;
  }
  return seen == count ? Result<void>() : Result<void>(fault("fewer values than declared"));
}

Result<void> Scanner::skip_bytes(std::uint64_t count) {
  if (count > file_->size() - at_) return fault("fewer bytes than declared");
  at_ += count;
  return {};
}

Error Scanner::fault(const std::string& what) const {
  return file_->fault("is malformed: " + what + " at byte " + std::to_string(at_));
}

Result<char> Scanner::next() {
  if (at_ < start_ || at_ >= start_ + buffer_.size()) {
    buffer_.resize(
        static_cast<std::size_t>(std::min<std::uint64_t>(text_buffer_bytes, file_->size() - at_)));
    start_ = at_;
    if (auto done = file_->read(start_, buffer_.data(), buffer_.size()); !done) {
      return done.error();
    }
  }
  return buffer_[static_cast<std::size_t>(at_++ - start_)];
}

std::optional<bytes::Scalar> type_named(const std::string& name) {
  constexpr std::array<std::pair<std::string_view, bytes::Scalar>, 14> names{{
      {"char", bytes::Scalar::int8},
      {"signed_char", bytes::Scalar::int8},
      {"unsigned_char", bytes::Scalar::uint8},
      {"short", bytes::Scalar::int16},
      {"unsigned_short", bytes::Scalar::uint16},
      {"int", bytes::Scalar::int32},
      {"unsigned_int", bytes::Scalar::uint32},
      {"long", bytes::Scalar::int64},
      {"unsigned_long", bytes::Scalar::uint64},
      {"vtktypeint64", bytes::Scalar::int64},
      {"vtktypeuint64", bytes::Scalar::uint64},
      {"vtkidtype", bytes::Scalar::int32},
      {"float", bytes::Scalar::float32},
      {"double", bytes::Scalar::float64},
  }};
  const auto* at =
      std::find_if(names.begin(), names.end(), [&](const auto& n) { return n.first == name; });
  if (at == names.end()) return {};
  return at->second;
}

std::string decoded(const std::string& name) {
  std::string out;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool escaped = name[i] == '%' && i + 2 < name.size() &&
                         bytes::hex_digit(name[i + 1]) >= 0 && bytes::hex_digit(name[i + 2]) >= 0;
    if (escaped) {
      out += static_cast<char>(bytes::hex_digit(name[i + 1]) * 16 + bytes::hex_digit(name[i + 2]));
      i += 2;
    } else {
      out += name[i];
    }
  }
  return out;
}

}  // namespace windsplat::data::vtk
