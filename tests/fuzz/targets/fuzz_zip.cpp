// ZIP archives of clients: what the directory declares holds for the bytes that come out.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <span>
#include <string>

#include "server/data/archive/zip.hpp"
#include "server/data/files/descriptor.hpp"
#include "tests/fuzz/support/check.hpp"

namespace {

using fuzz::expect;
namespace archive = windsplat::data::archive;
using windsplat::Result;

void read(int file, const archive::ZipEntry& entry) {
  std::uint64_t count = 0;
  const auto done = archive::read_zip_entry(file, entry, [&](std::span<const unsigned char> bytes) {
    expect(!bytes.empty() && bytes.size() <= archive::piece_bytes, "a piece is within its limit");
    count += bytes.size();
    expect(count <= entry.bytes, "an entry is no longer than it declares", entry.name);
    return Result<void>();
  });
  expect(!done || count == entry.bytes, "an entry that was read is whole", entry.name);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const windsplat::data::Descriptor file(::memfd_create("archive", MFD_CLOEXEC));
  expect(::write(file.number(), data, size) == static_cast<ssize_t>(size), "a file in memory");
  const auto entries = archive::list_zip(file.number());
  if (!entries) {
    expect(!entries.error().message.empty(), "a refusal has a reason");
    return 0;
  }
  std::uint64_t bytes = 0;
  for (const archive::ZipEntry& entry : *entries) {
    expect(archive::is_path_within(entry.name), "a name is a path within it", entry.name);
    expect(entry.packed_bytes <= size, "an entry is within the archive", entry.name);
    bytes += entry.bytes;
  }
  expect(bytes <= (std::uint64_t{1} << 20) + 200 * size, "what is declared is within the ratio");
  expect(archive::disk_bytes_of(*entries) >= bytes, "blocks have room for the bytes");
  for (const archive::ZipEntry& entry : *entries) {
    if (!entry.is_folder()) read(file.number(), entry);
  }
  return 0;
}
