// Measurements <-> lines of text; numbers round-trip exactly.
#include "server/study/points_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <system_error>
#include <vector>

#include "server/base/whole_file.hpp"

namespace windsplat::study {

namespace {

constexpr const char* heading = "key,rmse,max,psnr,flip,ms,msMin,msMax,stable\n";
constexpr std::size_t key_digits = 16;
constexpr std::size_t numbers = 8;

Error cannot(const char* what, const std::filesystem::path& path) {
  std::string message = std::string(what) + " '";
  message += printable(path.native());
  message += "'";
  if (errno != 0) {
    message += ": ";
    message += std::generic_category().message(errno);
  }
  return make_error(ErrorKind::internal, std::move(message));
}

std::string line_of(const std::string& key, const Measurement& m) {
  std::string line = key;
  for (const double v :
       {m.rmse, m.max, m.psnr, m.flip, m.ms, m.ms_min, m.ms_max, m.stable ? 1.0 : 0.0}) {
    std::array<char, 40> text{};
    std::snprintf(text.data(), text.size(), ",%.17g", v);
    line += text.data();
  }
  line += '\n';
  return line;
}

// nullopt if the line is malformed.
std::optional<std::pair<std::string, Measurement>> read_line(const std::string& line) {
  std::string key = line.substr(0, line.find(','));
  if (key.size() != key_digits || key.find_first_not_of("0123456789abcdef") != std::string::npos) {
    return std::nullopt;
  }
  std::array<double, numbers> values{};
  const char* at = line.c_str() + key.size();
  for (double& value : values) {
    if (*at != ',') return std::nullopt;
    char* end = nullptr;
    value = std::strtod(at + 1, &end);
    if (end == at + 1) return std::nullopt;
    at = end;
  }
  if (*at != '\0') return std::nullopt;
  const auto [rmse, max, psnr, flip, ms, ms_min, ms_max, stable] = values;
  return std::pair{std::move(key),
                   Measurement{rmse, max, psnr, flip, ms, ms_min, ms_max, stable == 1.0}};
}

// nullopt if there is no file.
Result<std::string> read_whole(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in.is_open()) {
    if (errno == ENOENT) return std::string();
    return cannot("cannot read", path);
  }
  std::string text;
  std::array<char, 1U << 16U> block{};
  while (in.read(block.data(), block.size()) || in.gcount() > 0) {
    text.append(block.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) return cannot("cannot read", path);
  return text;
}

}  // namespace

std::uint64_t hash_of(std::string_view bytes) {
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char c : bytes) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 0x100000001b3U;
  }
  return hash;
}

std::string key_of(std::string_view text) {
  std::array<char, key_digits + 1> digits{};
  std::snprintf(digits.data(), digits.size(), "%016llx",
                static_cast<unsigned long long>(hash_of(text)));
  return digits.data();
}

Result<PointsFile> PointsFile::open(const std::filesystem::path& path) {
  PointsFile file(path);
  const auto whole = read_whole(path);
  if (!whole) return whole.error();
  const std::string& text = *whole;
  std::string good = heading;
  if (!text.empty() && !text.starts_with(heading)) {
    std::string message = "'";
    message += printable(path.native());
    message += "' does not belong to a study: it does not start with the heading of points.csv";
    return make_error(ErrorKind::bad_data, std::move(message));
  }
  for (std::size_t start = text.find('\n') + 1; start != 0 && start < text.size();) {
    const std::size_t end = text.find('\n', start);
    if (end == std::string::npos) break;
    const std::string line = text.substr(start, end - start);
    if (const auto point = read_line(line)) {
      file.points_.insert_or_assign(point->first, point->second);
      good += line;
      good += '\n';
    }
    start = end + 1;
  }
  if (good != text) {
    if (const auto written = write_whole_file(path, good); !written) return written.error();
  }
  return file;
}

std::optional<Measurement> PointsFile::find(const std::string& key) const {
  const auto at = points_.find(key);
  if (at == points_.end()) return std::nullopt;
  return at->second;
}

Result<void> PointsFile::append(const std::string& key, const Measurement& measured) {
  errno = 0;
  std::ofstream out(path_, std::ios::binary | std::ios::app);
  out << line_of(key, measured) << std::flush;
  if (!out) return cannot("cannot write", path_);
  points_.insert_or_assign(key, measured);
  return {};
}

}  // namespace windsplat::study
