#include "server/data/model/box_grid.hpp"

#include <algorithm>
#include <charconv>

#include "server/base/check.hpp"
#include "server/data/model/middles.hpp"

namespace windsplat::data {

namespace {

constexpr char begin_of_key = 'g';

// Reads numbers that are separated by commas or, between the first and the last of a range of
// numbers, by a dash.
class Numbers {
 public:
  explicit Numbers(const std::string& text) : at_(text.data()), end_(text.data() + text.size()) {}

  bool skip(char c) {
    if (at_ == end_ || *at_ != c) return false;
    ++at_;
    return true;
  }
  bool read(int& out) {
    const auto [after, fault] = std::from_chars(at_, end_, out);
    if (fault != std::errc() || out < 0) return false;
    at_ = after;
    return true;
  }
  [[nodiscard]] bool ended() const { return at_ == end_; }

 private:
  const char* at_;
  const char* end_;
};

std::size_t product(const std::array<int, 3>& counts) {
  return static_cast<std::size_t>(counts[0]) * static_cast<std::size_t>(counts[1]) *
         static_cast<std::size_t>(counts[2]);
}

void divide_bounds(BoxGrid& grid) {
  for (std::size_t a = 0; a < 3; ++a) {
    grid.count[a] = (grid.bounds.count[a] - 1) / grid.size[a] + 1;
  }
  grid.places.assign(product(grid.count), 0);
}

}  // namespace

std::size_t BoxGrid::index_of(const std::array<int, 3>& sample) const {
  std::size_t index = 0;
  for (std::size_t a = 3; a-- > 0;) {
    index = index * static_cast<std::size_t>(count[a]) +
            static_cast<std::size_t>((sample[a] - bounds.first[a]) / size[a]);
  }
  return index;
}

Box BoxGrid::box_at(std::size_t index) const {
  Box out;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto along = static_cast<std::size_t>(count[a]);
    const int offset = static_cast<int>(index % along) * size[a];
    index /= along;
    out.first[a] = bounds.first[a] + offset;
    out.count[a] = std::min(size[a], bounds.count[a] - offset);
  }
  return out;
}

std::vector<Box> BoxGrid::boxes() const {
  std::vector<Box> out;
  out.reserve(static_cast<std::size_t>(held));
  for (std::size_t index = 0; index < places.size(); ++index) {
    if (places[index] > 0) out.push_back(box_at(index));
  }
  return out;
}

std::size_t BoxGrid::number_of(const std::array<int, 3>& sample, int stride) const {
  for (std::size_t a = 0; a < 3; ++a) {
    const int beyond = sample[a] - bounds.first[a];
    if (beyond < 0 || beyond >= bounds.count[a]) return 0;
  }
  auto number = static_cast<std::size_t>(places[index_of(sample)]);
  for (std::size_t a = 3; a-- > 0;) {
    number = number * static_cast<std::size_t>((size[a] - 1) / stride + 1) +
             static_cast<std::size_t>((sample[a] - bounds.first[a]) % size[a] / stride);
  }
  return number;
}

BoxGrid grid_of(const std::vector<Box>& boxes, const std::array<int, 3>& size,
                const std::array<int, 3>& dims) {
  WINDSPLAT_CHECK(!boxes.empty());
  BoxGrid out;
  out.size = size;
  for (std::size_t a = 0; a < 3; ++a) {
    int first = dims[a];
    int end = 0;
    for (const Box& box : boxes) {
      first = std::min(first, box.first[a]);
      end = std::max(end, box.first[a] + size[a]);
    }
    out.bounds.first[a] = first;
    out.bounds.count[a] = std::min(end, dims[a]) - first;
  }
  divide_bounds(out);
  for (const Box& box : boxes) out.places[out.index_of(box.first)] = 1;
  for (int& place : out.places) {
    if (place != 0) place = ++out.held;
  }
  return out;
}

std::array<int, 3> dims_of(const BoxGrid& grid) {
  return {grid.size[0], grid.size[1], grid.size[2] * (grid.held + 1)};
}

std::size_t samples_of(const BoxGrid& grid) {
  return samples_of_box(grid) * static_cast<std::size_t>(grid.held + 1);
}

std::size_t samples_of_box(const BoxGrid& grid) { return product(grid.size); }

BoxGrid strided_grid(const BoxGrid& grid, int stride) {
  BoxGrid out = grid;
  out.bounds = strided_box(grid.bounds, stride);
  for (int& samples : out.size) samples = (samples - 1) / stride + 1;
  return out;
}

bool is_held_by(const BoxGrid& grid, const BoxGrid& by) {
  if (grid.size != by.size) return false;
  const auto is_held = [&](const Box& box) {
    for (std::size_t a = 0; a < 3; ++a) {
      const int end = by.bounds.first[a] + by.bounds.count[a];
      if (box.first[a] < by.bounds.first[a] || box.first[a] >= end) return false;
    }
    return by.places[by.index_of(box.first)] > 0;
  };
  const std::vector<Box> boxes = grid.boxes();
  return std::all_of(boxes.begin(), boxes.end(), is_held);
}

std::string key_of(const BoxGrid& grid) {
  std::string text(1, begin_of_key);
  text += key_of(grid.bounds);
  for (const int n : grid.size) text += ',' + std::to_string(n);
  const auto& places = grid.places;
  for (std::size_t index = 0; index < places.size(); ++index) {
    if (places[index] == 0) continue;
    const std::size_t first = index;
    while (index + 1 < places.size() && places[index + 1] != 0) ++index;
    text += ',' + std::to_string(first);
    if (index > first) text += '-' + std::to_string(index);
  }
  return text;
}

std::optional<BoxGrid> grid_of_key(const std::string& key) {
  Numbers numbers(key);
  if (!numbers.skip(begin_of_key)) return std::nullopt;
  BoxGrid out;
  bool first = true;
  for (auto* const three : {&out.bounds.first, &out.bounds.count, &out.size}) {
    for (int& n : *three) {
      if ((!first && !numbers.skip(',')) || !numbers.read(n)) return std::nullopt;
      first = false;
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (out.bounds.count[a] < 1 || out.size[a] < 1) return std::nullopt;
  }
  divide_bounds(out);
  while (!numbers.ended()) {
    int from = 0;
    if (!numbers.skip(',') || !numbers.read(from)) return std::nullopt;
    int to = from;
    if (numbers.skip('-') && !numbers.read(to)) return std::nullopt;
    if (static_cast<std::size_t>(to) >= out.places.size()) return std::nullopt;
    for (int index = from; index <= to; ++index) {
      out.places[static_cast<std::size_t>(index)] = ++out.held;
    }
  }
  return out;
}

std::array<int, 3> HeldPart::dims(int stride) const {
  if (!grid) return strided_box(box, stride).count;
  std::array<int, 3> out = grid->size;
  for (int& samples : out) samples = (samples - 1) / stride + 1;
  out[2] *= grid->held + 1;
  return out;
}

std::size_t HeldPart::number_of(const std::array<int, 3>& sample, int stride) const {
  if (grid) return grid->number_of(sample, stride);
  const Box kernels = stride == 1 ? box : strided_box(box, stride);
  std::size_t number = 0;
  for (std::size_t a = 3; a-- > 0;) {
    number = number * static_cast<std::size_t>(kernels.count[a]) +
             static_cast<std::size_t>(sample[a] / stride - kernels.first[a]);
  }
  return number;
}

std::size_t HeldPart::samples() const { return grid ? samples_of(*grid) : box.samples(); }

bool HeldPart::operator==(const HeldPart& other) const {
  if (box != other.box || (grid == nullptr) != (other.grid == nullptr)) return false;
  return grid == nullptr || *grid == *other.grid;
}

}  // namespace windsplat::data
