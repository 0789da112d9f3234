#include "server/session/pacing/video_choice.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <utility>

namespace windsplat::session {
namespace {

// MaxFS of ITU-T H.264, table A-1: macroblocks of a frame, by level_idc. An edge has at most
// sqrt(8 MaxFS) of them (A.3.1).
constexpr std::array<std::pair<int, int>, 9> levels{{{30, 1620},
                                                     {31, 3600},
                                                     {32, 5120},
                                                     {40, 8192},
                                                     {42, 8704},
                                                     {50, 22080},
                                                     {51, 36864},
                                                     {60, 139264},
                                                     {62, 139264}}};

constexpr int edge_least = 16;  // pixels
// The encoder's limit: 1920 x 1088.
constexpr int encoder_macroblocks = 120 * 68;

// Macroblocks of a codec avc1.64CCLL (RFC 6381, 3.3): High profile, level_idc LL. 0: another one.
int macroblocks_of(std::string_view codec) {
  constexpr std::string_view high = "avc1.64";
  constexpr std::size_t length = high.size() + 4;
  if (codec.size() != length || codec.substr(0, high.size()) != high) return 0;
  unsigned digits = 0;
  const char* const end = codec.data() + codec.size();
  const auto read = std::from_chars(codec.data() + high.size(), end, digits, 16);
  if (read.ec != std::errc() || read.ptr != end) return 0;
  const int level = static_cast<int>(digits & 0xffU);
  int most = 0;
  for (const auto& [least, macroblocks] : levels) {
    if (level >= least) most = macroblocks;
  }
  return most;
}

int macroblocks(int width, int height) { return ((width + 15) / 16) * ((height + 15) / 16); }

}  // namespace

void VideoChoice::announced(const std::vector<std::string>& codecs) {
  macroblocks_most_ = 0;
  for (const std::string& codec : codecs) {
    macroblocks_most_ = std::max(macroblocks_most_, macroblocks_of(codec));
  }
  needs_key_ = true;
  if (macroblocks_most_ == 0) end();
}

bool VideoChoice::choose(Micros low_us, Micros good_us, Micros budget, Micros now) {
  if (!possible_ || macroblocks_most_ == 0 || now < not_before_) {
    end();
    return false;
  }
  const bool argues = on_ ? 2 * good_us < budget : low_us > budget;
  count_ = argues ? count_ + 1 : 0;
  if (count_ >= (on_ ? frames_to_end : frames_to_begin)) {
    if (on_) {
      end();
    } else {
      on_ = true;
      count_ = 0;
    }
  }
  return on_;
}

bool VideoChoice::fits(int width, int height) const {
  const std::int64_t longest = (std::max(width, height) + 15) / 16;
  return std::min(width, height) >= edge_least &&
         macroblocks(width, height) <= std::min(macroblocks_most_, encoder_macroblocks) &&
         longest * longest <= std::int64_t{8} * macroblocks_most_;
}

void VideoChoice::started(Micros now) {
  in_use_ = true;
  used_at_ = now;
}

void VideoChoice::sent() { needs_key_ = false; }

void VideoChoice::failed(Micros now) {
  not_before_ = now + retry_us;
  end();
}

void VideoChoice::end() {
  on_ = false;
  needs_key_ = true;
  count_ = 0;
}

bool VideoChoice::take_ended(Micros now) {
  if (!in_use_ || (on_ && now < used_at_ + unused_us)) return false;
  in_use_ = false;
  needs_key_ = true;
  return true;
}

}  // namespace windsplat::session
