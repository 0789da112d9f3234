// DIR/points.csv: every finished point of a study, one line each, appended as soon as it is
// measured, so that a study that was interrupted goes on where it stopped.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "server/base/error.hpp"
#include "server/study/types.hpp"

namespace windsplat::study {

// FNV-1a, 64 bits.
std::uint64_t hash_of(std::string_view bytes);

// 16 hexadecimal digits of a text that says all a result depends on: its hash.
std::string key_of(std::string_view text);

class PointsFile {
 public:
  // Reads what is there. A line that was cut off or is no point is left out, and the file is
  // written anew without it. Errors, which leave the file as it is: bad_data (a file that does not
  // open with our heading), internal (it cannot be read or written).
  static Result<PointsFile> open(const std::filesystem::path& path);

  [[nodiscard]] std::optional<Measurement> find(const std::string& key) const;
  [[nodiscard]] std::size_t size() const { return points_.size(); }

  // Errors: internal (the file cannot be written).
  Result<void> append(const std::string& key, const Measurement& measured);

 private:
  explicit PointsFile(std::filesystem::path path) : path_(std::move(path)) {}

  std::filesystem::path path_;
  std::map<std::string, Measurement> points_;
};

}  // namespace windsplat::study
