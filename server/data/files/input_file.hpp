// One regular file, open for reading. Renaming or deleting it has no effect.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/base/error.hpp"

namespace windsplat::data {

// Of a file whose bytes are fetched when they are read (Files::fetch_part()).
struct FileParts {
  std::uint64_t number = 0;  // 0: all bytes are present
  std::string state;         // identifies the bytes of the file; empty: its times do
};

// Thread-safe: every read passes its own offset.
class InputFile {
 public:
  // Takes ownership of an open descriptor; `name` is for messages. Errors: bad_data if it is empty
  // or not a regular file.
  static Result<std::shared_ptr<const InputFile>> adopt(int descriptor, std::string name,
                                                        FileParts parts = {});
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }  // without its folder
  [[nodiscard]] std::uint64_t size() const { return stamp_.bytes; }
  [[nodiscard]] int descriptor() const { return descriptor_; }
  [[nodiscard]] const FileParts& parts() const { return parts_; }
  // Exactly `count` bytes. Errors: bad_data if the file ends earlier or cannot be read.
  Result<void> read(std::uint64_t offset, void* out, std::size_t count) const;
  // The first bytes as text, at most `bytes_max`.
  [[nodiscard]] Result<std::string> head(std::size_t bytes_max) const;

  // Name, size and modification time or state of the parts, so independent of the folder of the
  // file.
  [[nodiscard]] std::string identity() const;
  // Errors: bad_data if size or time of change differs from that at opening.
  [[nodiscard]] Result<void> check_unchanged() const;
  // A path through which a library can open this open file.
  [[nodiscard]] std::string library_path() const;

  // bad_data: "'name' what".
  [[nodiscard]] Error fault(const std::string& what) const;

 private:
  struct Stamp {
    std::uint64_t bytes = 0;
    std::int64_t seconds = 0;
    std::int64_t nanoseconds = 0;
    bool operator==(const Stamp&) const = default;
  };
  InputFile(int descriptor, std::string name, FileParts parts)
      : descriptor_(descriptor), name_(std::move(name)), parts_(std::move(parts)) {}

  int descriptor_;
  std::string name_;
  FileParts parts_;
  Stamp stamp_;
};

}  // namespace windsplat::data
