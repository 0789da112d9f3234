// Four counts (width, height, pieces, evaluations), then RGBA; doubles as this machine keeps them.
#include "server/study/truth_file.hpp"

#include <cstring>
#include <fstream>
#include <iterator>
#include <string>

#include "server/base/whole_file.hpp"

namespace windsplat::study {

namespace {

constexpr std::size_t counts = 4;

}  // namespace

std::optional<Picture> read_truth(const std::filesystem::path& path, int width, int height) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  const std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::vector<double> numbers(bytes.size() / sizeof(double));
  const std::size_t expected =
      counts + 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (numbers.size() != expected || bytes.size() % sizeof(double) != 0) return std::nullopt;
  std::memcpy(numbers.data(), bytes.data(), bytes.size());
  if (numbers[0] != width || numbers[1] != height) return std::nullopt;
  Picture picture;
  picture.width = width;
  picture.height = height;
  picture.pieces = static_cast<std::int64_t>(numbers[2]);
  picture.evaluations = static_cast<std::int64_t>(numbers[3]);
  picture.rgba.assign(numbers.begin() + counts, numbers.end());
  return picture;
}

Result<void> write_truth(const std::filesystem::path& path, const Picture& picture) {
  std::vector<double> numbers{
      static_cast<double>(picture.width), static_cast<double>(picture.height),
      static_cast<double>(picture.pieces), static_cast<double>(picture.evaluations)};
  numbers.insert(numbers.end(), picture.rgba.begin(), picture.rgba.end());
  std::string bytes(numbers.size() * sizeof(double), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return write_whole_file(path, bytes);
}

}  // namespace windsplat::study
