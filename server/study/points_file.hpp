// DIR/points.csv: one line per finished point of a study, appended as soon as it is measured, so
// that an interrupted study can resume.
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

// Hash of a string that lists everything on which a result depends: 16 hexadecimal digits.
std::string key_of(std::string_view text);

class PointsFile {
 public:
  // Reads an existing file. Truncated and malformed lines are skipped, and the file is rewritten
  // without them. Errors, which leave the file unchanged: bad_data (the file does not start with
  // the heading), internal (it cannot be read or written).
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
