// Where an array's bytes lie, as one run of them: a file's tail, an encoded stream unrolled, many
// files one after another. Readers of plain formats put these together.
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

// A file from an offset on.
std::shared_ptr<ByteStore> file_store(std::shared_ptr<const InputFile> file, std::uint64_t skip);

// One of many files, or none: of a piece that is absent every byte is 0xff, which as a float is
// not a number.
struct Piece {
  std::uint64_t bytes = 0;
  std::function<Result<std::shared_ptr<ByteStore>>()> open;  // empty: absent
};

// Pieces one after another, opened when they are read; a few stay open.
std::shared_ptr<ByteStore> joined_store(std::vector<Piece> pieces);

// Error for a file that `by` refers to and that is absent: names the reference and the folder.
Error absent_companion(const std::string& name, const std::string& by);

// The file of a name that the file `by` refers to, beside it. Errors: as Files::open(), and
// absent_companion().
Result<std::shared_ptr<const InputFile>> open_named(Files& files, const std::string& name,
                                                    const std::string& by);

// A companion opened again later; it must still be what it was when `identity` was taken.
Result<std::shared_ptr<const InputFile>> open_again(Files& files, const std::string& name,
                                                    const std::string& identity);

}  // namespace windsplat::data::bytes
