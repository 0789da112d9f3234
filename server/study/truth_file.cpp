// Six numbers (width, height, pieces, evaluations, seconds, tolerance), then RGBA; doubles in
// native byte order. The first eight bytes are their hash.
#include "server/study/truth_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "server/base/whole_file.hpp"
#include "server/study/points_file.hpp"

namespace windsplat::study {

namespace {

constexpr std::size_t header_numbers = 6;
constexpr std::size_t hash_bytes = sizeof(std::uint64_t);

}  // namespace

std::optional<KeptTruth> read_truth(const std::filesystem::path& path, int width, int height,
                                    double tolerance) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  const std::size_t expected =
      header_numbers + 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (bytes.size() != hash_bytes + expected * sizeof(double)) return std::nullopt;
  std::uint64_t hash = 0;
  std::memcpy(&hash, bytes.data(), hash_bytes);
  if (hash != hash_of(std::string_view(bytes).substr(hash_bytes))) return std::nullopt;
  std::vector<double> numbers(expected);
  std::memcpy(numbers.data(), bytes.data() + hash_bytes, expected * sizeof(double));
  if (numbers[0] != width || numbers[1] != height || numbers[5] != tolerance) return std::nullopt;
  if (!std::all_of(numbers.begin(), numbers.end(), [](double v) { return std::isfinite(v); })) {
    return std::nullopt;
  }
  KeptTruth truth;
  truth.picture.width = width;
  truth.picture.height = height;
  truth.picture.pieces = static_cast<std::int64_t>(numbers[2]);
  truth.picture.evaluations = static_cast<std::int64_t>(numbers[3]);
  truth.seconds = numbers[4];
  truth.tolerance = numbers[5];
  truth.picture.rgba.assign(numbers.begin() + header_numbers, numbers.end());
  return truth;
}

Result<void> write_truth(const std::filesystem::path& path, const KeptTruth& truth) {
  const Picture& picture = truth.picture;
  std::vector<double> numbers{static_cast<double>(picture.width),
                              static_cast<double>(picture.height),
                              static_cast<double>(picture.pieces),
                              static_cast<double>(picture.evaluations),
                              truth.seconds,
                              truth.tolerance};
  numbers.insert(numbers.end(), picture.rgba.begin(), picture.rgba.end());
  std::string bytes(hash_bytes + numbers.size() * sizeof(double), '\0');
  std::memcpy(bytes.data() + hash_bytes, numbers.data(), numbers.size() * sizeof(double));
  const std::uint64_t hash = hash_of(std::string_view(bytes).substr(hash_bytes));
  std::memcpy(bytes.data(), &hash, hash_bytes);
  return write_whole_file(path, bytes);
}

}  // namespace windsplat::study
