// Copies a part before it is examined, since the loader could change the window meanwhile.
#include "server/data/loader/arriving_volume.hpp"

#include <algorithm>
#include <cstring>

#include "server/data/loader/bytes.hpp"

namespace windsplat::data::loader {

namespace {

constexpr std::size_t half_floats = std::size_t{512} << 10;  // unless a layer is larger
constexpr std::size_t layer_floats_max = std::size_t{4} << 20;
constexpr std::size_t zeros_at_once = std::size_t{16} << 10;  // floats, a block of pages

bool are_zero(const float* values, std::size_t count) {
  constexpr std::size_t lanes = 64;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    std::uint32_t any = 0;
    for (std::size_t l = 0; l < lanes; ++l) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, values + i + l, sizeof bits);
      any |= bits;
    }
    if (any != 0) return false;
  }
  for (; i < count; ++i) {
    std::uint32_t bits = 0;
    std::memcpy(&bits, values + i, sizeof bits);
    if (bits != 0) return false;
  }
  return true;
}

// Into memory that is zero: what stays zero is not written, so that large blocks take no memory.
void copy_to_zeros(const float* from, std::size_t count, float* to) {
  for (std::size_t done = 0; done < count; done += zeros_at_once) {
    const std::size_t some = std::min(zeros_at_once, count - done);
    if (!are_zero(from + done, some)) std::copy_n(from + done, some, to + done);
  }
}

}  // namespace

WindowSize window_size(const Volume& volume) {
  WindowSize out;
  out.layer = static_cast<std::size_t>(volume.dims[0]) * static_cast<std::size_t>(volume.dims[1]);
  if (out.layer > layer_floats_max) return {};
  out.layers = std::max<std::size_t>(1, half_floats / out.layer);
  const bool is_larger =
      volume.samples() * static_cast<std::size_t>(volume.components) > out.floats();
  return is_larger ? out : WindowSize();
}

ArrivingVolume::ArrivingVolume(Volume& volume, const WindowSize& size, const float* window)
    : volume_(volume),
      size_(size),
      window_(window),
      arrived_(static_cast<std::size_t>(volume.dims[2])) {}

bool ArrivingVolume::take(const std::string& payload) {
  Reader in(payload);
  const auto component = in.number<std::uint64_t>();
  const auto first = in.number<std::uint64_t>();
  const auto layers = in.number<std::uint64_t>();
  const auto half = in.number<std::uint64_t>();
  const auto components = static_cast<std::uint64_t>(volume_.components);
  if (!in.complete() || component >= components || layers == 0 || layers > size_.layers ||
      half > 1 || first >= arrived_.size() || layers > arrived_.size() - first) {
    return false;
  }
  const auto bit = static_cast<std::uint8_t>(1U << component);
  const auto begin = arrived_.begin() + static_cast<std::ptrdiff_t>(first);
  const auto end = begin + static_cast<std::ptrdiff_t>(layers);
  if (std::any_of(begin, end, [bit](std::uint8_t seen) { return (seen & bit) != 0; })) return false;
  copy_to_zeros(window_ + half * size_.layers * size_.layer, layers * size_.layer,
                volume_.values.data() + component * volume_.samples() + first * size_.layer);
  const auto all = static_cast<std::uint8_t>((1U << components) - 1);
  for (std::size_t layer = first; layer < first + layers; ++layer) {
    arrived_[layer] = static_cast<std::uint8_t>(arrived_[layer] | bit);
    if (arrived_[layer] != all) continue;
    ++complete_;
    const std::size_t from = layer * size_.layer;
    if (components > 1) mask_samples(volume_, from, from + size_.layer);
    measure_.add(volume_, from, from + size_.layer);
  }
  return true;
}

bool ArrivingVolume::finish() const { return measure_.finish(volume_); }

}  // namespace windsplat::data::loader
