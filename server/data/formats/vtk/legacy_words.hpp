// Words and lines of a legacy VTK file, and the meaning of type names.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/bytes/scalar.hpp"
#include "server/data/files/input_file.hpp"

namespace windsplat::data::vtk {

// Words and lines of a file with their offsets.
class Scanner {
 public:
  explicit Scanner(std::shared_ptr<const InputFile> file) : file_(std::move(file)) {}

  [[nodiscard]] std::uint64_t at() const { return at_; }
  [[nodiscard]] bool ended() const { return at_ >= file_->size(); }

  // Reads to the end of the line and skips it. Errors: a line beyond the limit.
  Result<std::string> line();
  // Returns an empty word at the end of the file.
  Result<std::string> word();
  Result<void> skip_words(std::uint64_t count);
  Result<void> skip_bytes(std::uint64_t count);
  void back_to(std::uint64_t place) { at_ = place; }

  [[nodiscard]] Error fault(const std::string& what) const;

 private:
  Result<char> next();

  std::shared_ptr<const InputFile> file_;
  std::uint64_t at_ = 0;
  std::uint64_t start_ = 0;
  std::vector<char> buffer_;
};

// The type of an array's values, given its name in the file in lower case.
std::optional<bytes::Scalar> type_named(const std::string& name);

// Decodes percent-encoded names.
std::string decoded(const std::string& name);

}  // namespace windsplat::data::vtk
