// Unpacks an archive of untrusted bytes: a loader reads it and sends names and bytes, which the
// daemon checks and writes below a folder.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "server/base/cancel.hpp"
#include "server/base/error.hpp"
#include "server/data/files/descriptor.hpp"

namespace windsplat::data::loader {

struct Unpacking {
  std::filesystem::path archive;  // a ZIP archive
  std::filesystem::path folder;   // empty
  // Called once, before anything is written, with the bytes of disk that files and folders will
  // take, in blocks of 4 KiB; no more is written. Its error ends the unpacking.
  std::function<Result<void>(std::uint64_t bytes)> reserve;
  // A loader that sends nothing for so long is ended.
  std::chrono::milliseconds stall_time{15'000};
  CancelToken cancel = {};
};

// Errors: bad_data (of the archive, or a loader that crashed, stalled or sent what is invalid),
// out_of_memory (disk full), internal (disk), cancelled, those of `reserve`; some files then
// remain.
Result<void> unpack(const Unpacking& what);

// In the loader, confined: sends the contents of an archive to the daemon.
void send_archive(const Descriptor& archive);

}  // namespace windsplat::data::loader
