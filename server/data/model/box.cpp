// Boxes of samples, and the chunks of a file that they touch.
#include "server/data/model/box.hpp"

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include "server/base/check.hpp"

namespace windsplat::data {

namespace {

// A range of indices along an axis.
struct Run {
  int first = 0;
  int count = 1;
  [[nodiscard]] int end() const { return first + count; }
};

// The samples from the last multiple of `length`, counted from `origin`, up to the next.
Run run_at(int index, int length, int origin, int all) {
  int begin = index - (index - origin) % length;
  if (index < origin) begin = origin - length;  // origin < length: there is one run before it
  const int first = std::max(begin, 0);
  return {first, std::min(begin + length, all) - first};
}

Run chunk_at(int index, std::size_t axis, const FieldInfo& field, int all) {
  return run_at(index, field.box_chunk.at(axis), field.box_chunk_first.at(axis), all);
}

// Runs of at most `length` indices from `run`, which end at multiples of it counted from `origin`,
// and hold every `stride`-th index.
std::vector<Run> split(const Run& run, int stride, int length, int origin) {
  std::vector<Run> out;
  for (int at = run.first; at < run.end();) {
    const int end = run_at(at, length, origin, run.end()).end();
    const int last = at + (end - 1 - at) / stride * stride;
    out.push_back({at, last - at + 1});
    if (stride > run.end() - last) break;
    at = last + stride;
  }
  return out;
}

}  // namespace

std::size_t Box::samples() const {
  return static_cast<std::size_t>(count[0]) * static_cast<std::size_t>(count[1]) *
         static_cast<std::size_t>(count[2]);
}

Box whole_box(const std::array<int, 3>& dims) { return {{0, 0, 0}, dims}; }

bool is_within(const Box& box, const std::array<int, 3>& dims) {
  for (std::size_t a = 0; a < 3; ++a) {
    const int first = box.first.at(a);
    const int count = box.count.at(a);
    if (first < 0 || count < 1 || count > dims.at(a) || first > dims.at(a) - count) return false;
  }
  return true;
}

Volume cut(const Volume& volume, const Box& box) {
  WINDSPLAT_CHECK(is_within(box, volume.dims));
  Volume out;
  out.dims = box.count;
  out.components = volume.components;
  out.values = Samples(box.samples() * static_cast<std::size_t>(volume.components));
  const auto width = static_cast<std::size_t>(box.count[0]);
  float* to = out.values.data();
  for (int c = 0; c < volume.components; ++c) {
    for (int k = 0; k < box.count[2]; ++k) {
      for (int j = 0; j < box.count[1]; ++j) {
        const std::size_t layer =
            static_cast<std::size_t>(box.first[2] + k) * static_cast<std::size_t>(volume.dims[1]);
        const std::size_t row = layer + static_cast<std::size_t>(box.first[1] + j);
        const float* const from = volume.component(c) +
                                  row * static_cast<std::size_t>(volume.dims[0]) +
                                  static_cast<std::size_t>(box.first[0]);
        to = std::copy_n(from, width, to);
      }
    }
  }
  finish_volume(out);
  return out;
}

std::string key_of(const Box& box) {
  std::string text;
  for (const auto& three : {box.first, box.count}) {
    for (const int n : three) text += (text.empty() ? "" : ",") + std::to_string(n);
  }
  return text;
}

std::optional<Box> box_of(const std::string& key) {
  Box box;
  const char* at = key.data();
  const char* const end = at + key.size();
  for (auto* const three : {&box.first, &box.count}) {
    for (int& n : *three) {
      if (at != key.data() && (at == end || *at++ != ',')) return std::nullopt;
      const auto [after, fault] = std::from_chars(at, end, n);
      if (fault != std::errc()) return std::nullopt;
      at = after;
    }
  }
  return at == end ? std::optional(box) : std::nullopt;
}

Box box_around(const std::array<int, 3>& index, const FieldInfo& field,
               const std::array<int, 3>& dims) {
  constexpr int length_max = 64;
  Box out;
  for (std::size_t a = 0; a < 3; ++a) {
    Run run = chunk_at(index.at(a), a, field, dims.at(a));
    if (run.count > length_max) {
      const int first = index.at(a) - (index.at(a) - run.first) % length_max;
      run = {first, std::min(length_max, run.end() - first)};
    }
    out.first.at(a) = run.first;
    out.count.at(a) = run.count;
  }
  return out;
}

int layers_apart(const Box& box, int layer_stride, const FieldInfo& field,
                 const std::array<int, 3>& dims, double values_min) {
  const int chunk = field.box_chunk[2];
  double values = static_cast<double>(field.components.size()) * (layer_stride - chunk);
  for (const std::size_t a : {0U, 1U}) {
    values *= chunk_at(box.first.at(a) + box.count.at(a) - 1, a, field, dims.at(a)).end() -
              chunk_at(box.first.at(a), a, field, dims.at(a)).first;
  }
  return values >= values_min ? layer_stride : 1;
}

double decoded_share(const Box& box, int layer_stride, const FieldInfo& field,
                     const std::array<int, 3>& dims) {
  double share = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const int first = box.first.at(a);
    const int last = first + box.count.at(a) - 1;
    const int chunk = field.box_chunk.at(a);
    double samples =
        chunk_at(last, a, field, dims.at(a)).end() - chunk_at(first, a, field, dims.at(a)).first;
    if (a == 2 && layer_stride > chunk) {
      const int layers = (last - first) / layer_stride + 1;
      samples = std::min(samples, static_cast<double>(layers) * chunk);
    }
    share *= samples / dims.at(a);
  }
  return share;
}

std::uint64_t chunks_of(const Box& box, const FieldInfo& field) {
  std::uint64_t chunks = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const int length = field.box_chunk.at(a);
    const int first = box.first.at(a) + length - field.box_chunk_first.at(a);  // not negative
    const int last = first + box.count.at(a) - 1;
    chunks *= static_cast<std::uint64_t>(last / length - first / length + 1);
  }
  return chunks;
}

std::vector<Box> pieces_of(const Box& box, int layer_stride, const FieldInfo& field,
                           std::size_t values_max) {
  std::array<int, 3> length = field.box_chunk;
  auto values = static_cast<double>(field.components.size());
  for (const int n : length) values *= n;
  for (std::size_t a = 0; a < 3; ++a) {
    if (a == 2 && layer_stride > length[2]) continue;
    const double fit = std::max(1.0, static_cast<double>(values_max) / values);
    // Chunks of the box, cut ones at both ends included.
    const int along = box.count.at(a) / length.at(a) + 2;
    const int chunks = static_cast<int>(std::min<double>(fit, along));
    length.at(a) *= chunks;
    values *= chunks;
  }
  std::array<std::vector<Run>, 3> runs;
  for (std::size_t a = 0; a < 3; ++a) {
    runs.at(a) = split({box.first.at(a), box.count.at(a)}, a == 2 ? layer_stride : 1, length.at(a),
                       field.box_chunk_first.at(a));
  }
  std::vector<Box> out;
  for (const Run& z : runs[2]) {
    for (const Run& y : runs[1]) {
      for (const Run& x : runs[0]) {
        out.push_back({{x.first, y.first, z.first}, {x.count, y.count, z.count}});
      }
    }
  }
  return out;
}

}  // namespace windsplat::data
