// Stored files -> a ZIP archive (PKWARE APPNOTE 6.3.9), written from its start to its end without
// seeking. Records of ZIP64 are written where a count, size or offset needs them.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::movie {

class Zip {
 public:
  using Sink = std::function<Result<void>(std::span<const std::uint8_t>)>;

  // `start`: bytes before the archive in the file that the sink writes.
  explicit Zip(Sink sink, std::uint64_t start = 0) : sink_(std::move(sink)), at_(start) {}

  // Appends a file that is not compressed, dated 1 January 1980 so that equal files make equal
  // archives. The name: ASCII, below 65,536 letters. Errors: those of the sink; too_large from 4
  // GiB.
  Result<void> add(const std::string& name, std::span<const std::uint8_t> bytes);

  // Writes the directory of the files; call it once. Errors: those of the sink.
  Result<void> finish();

  [[nodiscard]] std::size_t count() const { return entries_.size(); }

 private:
  struct Entry {
    std::string name;
    std::uint32_t crc = 0;
    std::uint32_t bytes = 0;
    std::uint64_t offset = 0;  // of its header in the file
  };
  Result<void> put(std::span<const std::uint8_t> bytes);

  Sink sink_;
  std::uint64_t at_;
  std::vector<Entry> entries_;
};

}  // namespace windsplat::movie
