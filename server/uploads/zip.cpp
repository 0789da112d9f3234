// Every number of the archive is checked before it is used; entries are found by the central
// directory only.
#include "server/uploads/zip.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>

namespace windsplat::uploads {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t entries_max = 20'000;
constexpr std::uint64_t directory_bytes_max = std::uint64_t{8} << 20;
constexpr std::uint64_t ratio_max = 200;
constexpr std::uint64_t ratio_free_bytes = std::uint64_t{1} << 20;  // for archives of few bytes
constexpr std::uint64_t block_bytes = 4096;
constexpr std::size_t name_bytes_max = 512;
constexpr std::size_t depth_max = 16;
constexpr std::size_t piece_bytes = std::size_t{256} << 10;

constexpr std::size_t end_bytes = 22;
constexpr std::size_t comment_bytes_max = 65535;
constexpr std::size_t directory_entry_bytes = 46;
constexpr std::size_t local_header_bytes = 30;
constexpr std::uint32_t end_mark = 0x06054b50;
constexpr std::uint32_t directory_mark = 0x02014b50;
constexpr std::uint32_t local_mark = 0x04034b50;
constexpr std::uint32_t zip64_number = 0xffffffff;

using Bytes = std::vector<unsigned char>;

Error bad_zip(const std::string& why) {
  return make_error(ErrorKind::bad_data, "the ZIP archive " + why);
}

Error bad_entry(const ZipEntry& entry, const std::string& why) {
  return bad_zip("has an entry '" + printable(entry.name, 80) + "' " + why);
}

Error unpack_disk_error(int fault) {
  const bool full = fault == ENOSPC || fault == EDQUOT;
  return make_error(
      full ? ErrorKind::out_of_memory : ErrorKind::internal,
      "the ZIP archive cannot be unpacked: " + std::generic_category().message(fault));
}

std::uint32_t number_at(std::span<const unsigned char> bytes, std::size_t at, std::size_t width) {
  std::uint32_t value = 0;
  for (std::size_t n = 0; n < width; ++n) {
    value |= static_cast<std::uint32_t>(bytes[at + n]) << (8 * n);
  }
  return value;
}
std::uint32_t u16(std::span<const unsigned char> bytes, std::size_t at) {
  return number_at(bytes, at, 2);
}
std::uint32_t u32(std::span<const unsigned char> bytes, std::size_t at) {
  return number_at(bytes, at, 4);
}

// `count` bytes within the file.
Result<Bytes> read_at(int file, std::uint64_t at, std::size_t count) {
  Bytes out(count);
  for (std::size_t done = 0; done < count;) {
    const ssize_t got =
        ::pread(file, out.data() + done, count - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return unpack_disk_error(errno);
    if (got == 0) return bad_zip("ends early");
    done += static_cast<std::size_t>(got);
  }
  return out;
}

struct Directory {
  std::uint64_t at = 0;
  std::uint64_t bytes = 0;
  std::size_t entries = 0;
};

Result<Directory> find_directory(int file, std::uint64_t file_bytes) {
  if (file_bytes < end_bytes) return bad_zip("is shorter than its end record");
  const auto count =
      static_cast<std::size_t>(std::min<std::uint64_t>(file_bytes, end_bytes + comment_bytes_max));
  const auto tail = read_at(file, file_bytes - count, count);
  if (!tail) return tail.error();
  for (std::size_t at = count - end_bytes + 1; at-- > 0;) {
    if (u32(*tail, at) != end_mark) continue;
    if (at + end_bytes + u16(*tail, at + 20) != count) continue;  // its comment ends the file
    const std::uint64_t end_at = file_bytes - count + at;
    const Directory out{u32(*tail, at + 16), u32(*tail, at + 12), u16(*tail, at + 10)};
    if (out.at == zip64_number || out.entries == 0xffff) return bad_zip("has the form ZIP64");
    if (u16(*tail, at + 4) != 0 || u16(*tail, at + 6) != 0 || u16(*tail, at + 8) != out.entries) {
      return bad_zip("has several parts");
    }
    if (out.entries > entries_max || out.bytes > directory_bytes_max) {
      return bad_zip("has more than " + std::to_string(entries_max) + " entries");
    }
    if (out.at + out.bytes != end_at) return bad_zip("has a directory that is not before its end");
    return out;
  }
  return bad_zip("has no end record");
}

// Relative, of printable ASCII without backslashes; no part is empty, "." or "..".
bool is_safe_name(std::string_view name) {
  if (name.empty() || name.size() > name_bytes_max) return false;
  if (std::any_of(name.begin(), name.end(),
                  [](char c) { return c < ' ' || c > '~' || c == '\\'; })) {
    return false;
  }
  if (name.back() == '/') name.remove_suffix(1);
  std::size_t depth = 0;
  for (std::size_t at = 0; at <= name.size(); ++depth) {
    const std::size_t end = std::min(name.find('/', at), name.size());
    const std::string_view part = name.substr(at, end - at);
    if (part.empty() || part == "." || part == ".." || part.size() > 255) return false;
    at = end + 1;
  }
  return depth <= depth_max;
}

// What the upper bytes of the external attributes say, if the archive was made on Unix.
bool is_file_or_folder(std::uint32_t made_by, std::uint32_t attributes) {
  constexpr std::uint32_t unix_host = 3;
  if (made_by >> 8 != unix_host) return true;
  const auto type = static_cast<mode_t>(attributes >> 16) & S_IFMT;
  return type == 0 || type == S_IFREG || type == S_IFDIR;
}

// The entry at the beginning of the bytes, and how many it takes.
Result<std::pair<ZipEntry, std::size_t>> read_entry(std::span<const unsigned char> bytes) {
  if (bytes.size() < directory_entry_bytes || u32(bytes, 0) != directory_mark) {
    return bad_zip("has a malformed directory");
  }
  const std::size_t name_bytes = u16(bytes, 28);
  const std::size_t all =
      directory_entry_bytes + name_bytes + u16(bytes, 30) + std::size_t{u16(bytes, 32)};
  if (all > bytes.size()) return bad_zip("has a malformed directory");
  ZipEntry out;
  out.name.assign(reinterpret_cast<const char*>(bytes.data()) + directory_entry_bytes, name_bytes);
  out.crc = u32(bytes, 16);
  out.packed_bytes = u32(bytes, 20);
  out.bytes = u32(bytes, 24);
  out.header_at = u32(bytes, 42);
  const std::uint32_t method = u16(bytes, 10);
  out.deflated = method == Z_DEFLATED;
  if (!is_safe_name(out.name)) return bad_entry(out, "whose name is not a path within it");
  if ((u16(bytes, 8) & 1U) != 0) return bad_entry(out, "that is encrypted");
  if (method != 0 && !out.deflated) return bad_entry(out, "that is neither stored nor deflated");
  if (!is_file_or_folder(u16(bytes, 4), u32(bytes, 38))) {
    return bad_entry(out, "that is a link or a special file");
  }
  if (out.bytes == zip64_number || out.packed_bytes == zip64_number ||
      out.header_at == zip64_number) {
    return bad_entry(out, "of the form ZIP64");
  }
  if (!out.deflated && out.bytes != out.packed_bytes) return bad_entry(out, "of two sizes");
  if (out.name.back() == '/' && out.bytes > 0) return bad_entry(out, "that is a folder with bytes");
  return std::pair{std::move(out), all};
}

Result<void> check_sums(const std::vector<ZipEntry>& entries, std::uint64_t directory_at) {
  std::uint64_t packed = 0;
  std::uint64_t bytes = 0;
  for (const ZipEntry& entry : entries) {
    packed += entry.packed_bytes + local_header_bytes;
    bytes += entry.bytes;
  }
  if (packed > directory_at) return bad_zip("has entries that overlap");
  if (bytes > ratio_free_bytes + ratio_max * packed) {
    return bad_zip("has " + std::to_string(bytes) + " bytes in " + std::to_string(packed) +
                   ", more than " + std::to_string(ratio_max) + " times as many");
  }
  return {};
}

// Takes the bytes of an entry in pieces.
class EntryWriter {
 public:
  explicit EntryWriter(int file) : file_(file) {}

  Result<void> write(std::span<const unsigned char> bytes) {
    crc_ = ::crc32_z(crc_, bytes.data(), bytes.size());
    written_ += bytes.size();
    while (!bytes.empty()) {
      const ssize_t done = ::write(file_, bytes.data(), bytes.size());
      if (done < 0 && errno == EINTR) continue;
      if (done < 0) return unpack_disk_error(errno);
      bytes = bytes.subspan(static_cast<std::size_t>(done));
    }
    return {};
  }
  [[nodiscard]] std::uint64_t written() const { return written_; }
  [[nodiscard]] bool has(const ZipEntry& entry) const {
    return written_ == entry.bytes && crc_ == entry.crc;
  }

 private:
  int file_;
  uLong crc_ = ::crc32_z(0, nullptr, 0);
  std::uint64_t written_ = 0;
};

// Raw deflate -> bytes, never more than the entry declares.
class Inflater {
 public:
  Inflater() { ready_ = ::inflateInit2(&stream_, -MAX_WBITS) == Z_OK; }
  ~Inflater() {
    if (ready_) ::inflateEnd(&stream_);
  }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  Result<void> take(Bytes& packed, const ZipEntry& entry, EntryWriter& out) {
    stream_.next_in = packed.data();
    stream_.avail_in = static_cast<uInt>(packed.size());
    while (ready_ && !ended_) {
      stream_.next_out = room_.data();
      stream_.avail_out = static_cast<uInt>(room_.size());
      const int state = ::inflate(&stream_, Z_NO_FLUSH);
      const std::size_t made = room_.size() - stream_.avail_out;
      if (made > entry.bytes - out.written()) return bad_entry(entry, "longer than it declares");
      if (auto ok = out.write(std::span(room_).first(made)); !ok) return ok;
      ended_ = state == Z_STREAM_END;
      if (state == Z_BUF_ERROR || (state == Z_OK && made == 0 && stream_.avail_in == 0)) break;
      if (state != Z_OK && !ended_) return bad_entry(entry, "that is not deflated");
    }
    if (!ready_) return bad_entry(entry, "for which there is no memory");
    return {};
  }
  [[nodiscard]] bool has_ended() const { return ended_ && stream_.avail_in == 0; }

 private:
  z_stream stream_{};
  Bytes room_ = Bytes(piece_bytes);
  bool ready_ = false;
  bool ended_ = false;
};

// Where the packed bytes of an entry are.
Result<std::uint64_t> data_at(int file, const ZipEntry& entry, std::uint64_t file_bytes) {
  if (entry.header_at + local_header_bytes > file_bytes) return bad_entry(entry, "beyond its end");
  const auto header = read_at(file, entry.header_at, local_header_bytes);
  if (!header) return header.error();
  if (u32(*header, 0) != local_mark) return bad_entry(entry, "without a header");
  const std::uint64_t at =
      entry.header_at + local_header_bytes + u16(*header, 26) + u16(*header, 28);
  if (at + entry.packed_bytes > file_bytes) return bad_entry(entry, "beyond its end");
  return at;
}

Result<void> unpack_entry(int file, const ZipEntry& entry, std::uint64_t at, int to) {
  EntryWriter out(to);
  std::optional<Inflater> inflater;
  if (entry.deflated) inflater.emplace();
  for (std::uint64_t done = 0; done < entry.packed_bytes;) {
    const std::uint64_t left = entry.packed_bytes - done;
    auto piece = read_at(file, at + done,
                         static_cast<std::size_t>(std::min<std::uint64_t>(left, piece_bytes)));
    if (!piece) return piece.error();
    done += piece->size();
    auto ok = inflater ? inflater->take(*piece, entry, out) : out.write(*piece);
    if (!ok) return ok;
  }
  if (inflater && !inflater->has_ended()) return bad_entry(entry, "that is not deflated");
  if (!out.has(entry)) return bad_entry(entry, "with another size or checksum than it declares");
  return {};
}

// The folders above a file, or the folder itself.
Result<void> make_folders(const ZipEntry& entry, const fs::path& folder) {
  for (std::size_t at = entry.name.find('/'); at != std::string::npos;
       at = entry.name.find('/', at + 1)) {
    const fs::path path = folder / entry.name.substr(0, at);
    if (::mkdir(path.c_str(), S_IRWXU) == 0) continue;
    if (errno != EEXIST) return unpack_disk_error(errno);
  }
  return {};
}

}  // namespace

Result<std::vector<ZipEntry>> list_zip(int file, std::uint64_t file_bytes) {
  const auto directory = find_directory(file, file_bytes);
  if (!directory) return directory.error();
  const auto bytes = read_at(file, directory->at, static_cast<std::size_t>(directory->bytes));
  if (!bytes) return bytes.error();
  std::vector<ZipEntry> out;
  out.reserve(directory->entries);
  auto rest = std::span<const unsigned char>(*bytes);
  for (std::size_t n = 0; n < directory->entries; ++n) {
    auto entry = read_entry(rest);
    if (!entry) return entry.error();
    rest = rest.subspan(entry->second);
    out.push_back(std::move(entry->first));
  }
  if (!rest.empty()) return bad_zip("has a malformed directory");
  if (const auto ok = check_sums(out, directory->at); !ok) return ok.error();
  return out;
}

std::uint64_t disk_bytes_of(const std::vector<ZipEntry>& entries) {
  std::uint64_t blocks = 0;
  std::set<std::string_view> folders;
  for (const ZipEntry& entry : entries) {
    blocks += std::max<std::uint64_t>(1, (entry.bytes + block_bytes - 1) / block_bytes);
    const std::string_view name = entry.name;
    for (std::size_t at = name.find('/'); at != std::string_view::npos;
         at = name.find('/', at + 1)) {
      folders.insert(name.substr(0, at));
    }
  }
  return (blocks + folders.size()) * block_bytes;
}

Result<void> unpack_zip(int file, const std::vector<ZipEntry>& entries, const fs::path& folder) {
  struct stat facts {};
  if (::fstat(file, &facts) != 0) return unpack_disk_error(errno);
  const auto file_bytes = static_cast<std::uint64_t>(facts.st_size);
  for (const ZipEntry& entry : entries) {
    if (auto ok = make_folders(entry, folder); !ok) return ok;
    if (entry.name.back() == '/') continue;
    const auto at = data_at(file, entry, file_bytes);
    if (!at) return at.error();
    const int to = ::open((folder / entry.name).c_str(),
                          O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
    if (to < 0 && (errno == EEXIST || errno == ENOTDIR))
      return bad_entry(entry, "that it has twice");
    if (to < 0) return unpack_disk_error(errno);
    auto ok = unpack_entry(file, entry, *at, to);
    ::close(to);
    if (!ok) return ok;
  }
  return {};
}

}  // namespace windsplat::uploads
