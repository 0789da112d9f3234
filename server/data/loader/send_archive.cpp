// Loader side of unpack(): the bytes of the archive are parsed here only.
#include <unistd.h>

#include <cstdint>
#include <new>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "server/data/archive/zip.hpp"
#include "server/data/loader/bytes.hpp"
#include "server/data/loader/channel.hpp"
#include "server/data/loader/confine.hpp"
#include "server/data/loader/messages.hpp"
#include "server/data/loader/process.hpp"
#include "server/data/loader/unpack.hpp"

namespace windsplat::data::loader {

namespace {

// A directory of 16 MiB, its entries, and the room of zlib.
constexpr std::uint64_t memory_bytes = std::uint64_t{64} << 20;
constexpr std::uint64_t files_max = 16;

Result<void> say_to_daemon(Kind kind, std::string_view payload) {
  if (send_message(socket_of_loader, kind, payload, -1, {}) != Fate::done) ::_exit(1);
  return {};
}

// Which macOS adds to archives and folders; no data.
bool is_of_macos(const archive::ZipEntry& entry) {
  return entry.name.starts_with("__MACOSX/") || entry.name == ".DS_Store" ||
         entry.name.ends_with("/.DS_Store");
}

Result<void> send_entries(const Descriptor& file) {
  auto entries = archive::list_zip(file.number());
  if (!entries) return entries.error();
  std::erase_if(*entries, is_of_macos);
  Writer out;
  out.number(archive::disk_bytes_of(*entries));
  auto done = say_to_daemon(Kind::entries, out.bytes());
  for (const archive::ZipEntry& entry : *entries) {
    done = say_to_daemon(Kind::entry, entry.name);
    if (entry.is_folder()) continue;
    done = archive::read_zip_entry(file.number(), entry, [](std::span<const unsigned char> bytes) {
      return say_to_daemon(Kind::entry_bytes,
                           {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    });
    if (!done) return done;
  }
  return say_to_daemon(Kind::unpacked, {});
}

}  // namespace

void send_archive(const Descriptor& archive) {
  Confinement how;
  how.memory_bytes = memory_bytes;
  how.files = files_max;
  how.socket = socket_of_loader;
  Result<void> done = confine(std::move(how));
  try {
    if (done) done = send_entries(archive);
  } catch (const std::bad_alloc&) {
    done = make_error(ErrorKind::out_of_memory, "unpacking it needs more memory than a loader has");
  }
  if (!done) static_cast<void>(say_to_daemon(Kind::failed, encode_error(done.error())));
}

}  // namespace windsplat::data::loader
