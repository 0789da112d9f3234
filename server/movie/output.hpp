// Where a movie is written: a file that gets its name when it is complete, or an open descriptor.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"

namespace windsplat::movie {

// A file without a name in the folder for temporary files, open for reading and writing. A failed
// descriptor with errno set if there can be none.
data::Descriptor unnamed_file();

class Output {
 public:
  // A file beside `path` with a temporary name. Devices, pipes and descriptors of this process
  // (is_stream()) are opened instead. Errors: internal, out_of_memory.
  static Result<Output> at(const std::filesystem::path& path);
  // A copy of the descriptor.
  static Result<Output> to(int descriptor);
  // The same of a regular file, which programs write to directly.
  static Result<Output> in_place(int file);

  Output(Output&& other) noexcept;
  Output& operator=(Output&& other) = delete;
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;
  ~Output();  // removes the file unless it was completed

  // A regular file for another program to write, open while this object lives: for a stream an
  // unnamed one, whose content complete() copies. Errors: internal, out_of_memory.
  Result<int> file_for_program();

  // Appends. Errors: internal, out_of_memory if the disk is full.
  Result<void> write(std::span<const std::uint8_t> bytes);

  // Gives the file its name; what it replaces keeps its permissions. Errors: as write().
  Result<void> complete();

 private:
  Output() = default;
  [[nodiscard]] Error failed(const char* what, int fault) const;
  Result<void> copy_to_stream();

  std::filesystem::path path_;    // as given, for messages; empty: a descriptor
  std::filesystem::path target_;  // empty: a stream
  std::filesystem::path part_;    // empty: a stream
  data::Descriptor file_;         // of the part or the stream
  data::Descriptor unnamed_;      // of a stream, if another program writes
  bool in_place_ = false;
};

}  // namespace windsplat::movie
