// The bytes of an array as one contiguous run, from the end of a file, a decoded stream or several
// files. Readers of plain formats combine these.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/files/files.hpp"

namespace windsplat::data::bytes {

class ByteStore {
 public:
  virtual ~ByteStore() = default;
  // Exactly `count` bytes. Errors: bad_data.
  virtual Result<void> read(std::uint64_t offset, unsigned char* out, std::size_t count) = 0;
  // Errors: bad_data if a file changed since it was opened.
  [[nodiscard]] virtual Result<void> check_unchanged() const = 0;
};

// The bytes of a file starting at an offset.
std::shared_ptr<ByteStore> file_store(std::shared_ptr<const InputFile> file, std::uint64_t skip);

// Part of a joined store: a file or, if the file is absent, bytes 0xff (NaN as float).
struct Piece {
  std::uint64_t bytes = 0;
  std::function<Result<std::shared_ptr<ByteStore>>()> open;  // empty: absent
};

// Concatenates pieces. Their files are opened on demand; a few stay open.
std::shared_ptr<ByteStore> joined_store(std::vector<Piece> pieces);

// Error for an absent file that `by` refers to; names the reference and the folder.
Error absent_companion(const std::string& name, const std::string& by);

// Opens the file that `by` refers to by name, in the same folder. Errors: as Files::open(), and
// absent_companion().
Result<std::shared_ptr<const InputFile>> open_named(Files& files, const std::string& name,
                                                    const std::string& by);

// Opens a companion again later; it must be unchanged since `identity` was taken.
Result<std::shared_ptr<const InputFile>> open_again(Files& files, const std::string& name,
                                                    const std::string& identity);

}  // namespace windsplat::data::bytes
