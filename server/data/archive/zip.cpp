// Every number of the archive is checked before it is used; entries are found by the central
// directory only.
#include "server/data/archive/zip.hpp"

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "server/base/disk_error.hpp"

namespace windsplat::data::archive {
namespace {

constexpr std::size_t entries_max = 100'000;
constexpr std::uint64_t directory_bytes_max = std::uint64_t{16} << 20;
constexpr std::uint64_t ratio_max = 200;
constexpr std::uint64_t archive_bytes_max = std::uint64_t{1} << 50;  // counted for the ratio
constexpr std::uint64_t ratio_free_bytes = std::uint64_t{1} << 20;   // for archives of few bytes
constexpr std::size_t name_bytes_max = 512;
constexpr std::size_t depth_max = 16;

constexpr std::size_t end_bytes = 22;
constexpr std::size_t comment_bytes_max = 65535;
constexpr std::size_t directory_entry_bytes = 46;
constexpr std::size_t local_header_bytes = 30;
constexpr std::uint32_t end_mark = 0x06054b50;
constexpr std::uint32_t directory_mark = 0x02014b50;
constexpr std::uint32_t local_mark = 0x04034b50;
// ZIP64: a number of 16 or 32 bits that is too small for its value has all bits set, and the value
// is elsewhere.
constexpr std::uint32_t elsewhere16 = 0xffff;
constexpr std::uint32_t elsewhere32 = 0xffffffff;
constexpr std::size_t locator_bytes = 20;
constexpr std::size_t end64_bytes = 56;
constexpr std::uint32_t locator_mark = 0x07064b50;
constexpr std::uint32_t end64_mark = 0x06064b50;
constexpr std::uint32_t zip64_field = 1;  // tag of an extra field

using Bytes = std::vector<unsigned char>;

Error bad_zip(const std::string& why) {
  return make_error(ErrorKind::bad_data, "the ZIP archive " + why);
}

Error bad_entry(const ZipEntry& entry, const std::string& why) {
  return bad_zip("has an entry '" + printable(entry.name, 80) + "' " + why);
}

Error unreadable(int fault) { return disk_error(fault, "the ZIP archive cannot be read"); }

using Span = std::span<const unsigned char>;

std::uint64_t number_at(Span bytes, std::size_t at, std::size_t width) {
  std::uint64_t value = 0;
  for (std::size_t n = 0; n < width; ++n) value |= std::uint64_t{bytes[at + n]} << (8 * n);
  return value;
}
std::uint32_t u16(Span bytes, std::size_t at) {
  return static_cast<std::uint32_t>(number_at(bytes, at, 2));
}
std::uint32_t u32(Span bytes, std::size_t at) {
  return static_cast<std::uint32_t>(number_at(bytes, at, 4));
}
std::uint64_t u64(Span bytes, std::size_t at) { return number_at(bytes, at, 8); }

Result<std::uint64_t> size_of(int file) {
  struct stat facts {};
  if (::fstat(file, &facts) != 0) return unreadable(errno);
  return static_cast<std::uint64_t>(facts.st_size);
}

// `count` bytes within the file.
Result<Bytes> read_at(int file, std::uint64_t at, std::size_t count) {
  Bytes out(count);
  for (std::size_t done = 0; done < count;) {
    const ssize_t got =
        ::pread(file, out.data() + done, count - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return unreadable(errno);
    if (got == 0) return bad_zip("ends early");
    done += static_cast<std::size_t>(got);
  }
  return out;
}

struct Directory {
  std::uint64_t at = 0;
  std::uint64_t bytes = 0;
  std::uint64_t entries = 0;
  std::uint64_t end_at = 0;  // of the first record after it
};

Result<Directory> checked_directory(const Directory& found, bool in_parts) {
  if (in_parts) return bad_zip("has several parts");
  if (found.entries > entries_max || found.bytes > directory_bytes_max) {
    return bad_zip("has more than " + std::to_string(entries_max) + " entries, or " +
                   std::to_string(directory_bytes_max) + " bytes of their names");
  }
  if (found.at > found.end_at || found.bytes != found.end_at - found.at) {
    return bad_zip("has a directory that is not before its end");
  }
  return found;
}

// The record of ZIP64 before the end record: found by its locator, which follows it.
Result<Directory> find_directory64(int file, std::uint64_t end_at) {
  if (end_at < locator_bytes + end64_bytes) return bad_zip("has no record of ZIP64");
  const std::uint64_t locator_at = end_at - locator_bytes;
  const auto locator = read_at(file, locator_at, locator_bytes);
  if (!locator) return locator.error();
  const std::uint64_t at = u64(*locator, 8);
  if (u32(*locator, 0) != locator_mark || at > locator_at - end64_bytes) {
    return bad_zip("has no record of ZIP64");
  }
  const auto end = read_at(file, at, end64_bytes);
  if (!end) return end.error();
  // Its length leaves out the mark and itself.
  if (u32(*end, 0) != end64_mark || u64(*end, 4) != locator_at - at - 12) {
    return bad_zip("has no record of ZIP64");
  }
  const bool in_parts = u32(*locator, 4) != 0 || u32(*locator, 16) > 1 || u32(*end, 16) != 0 ||
                        u32(*end, 20) != 0 || u64(*end, 24) != u64(*end, 32);
  return checked_directory({u64(*end, 48), u64(*end, 40), u64(*end, 32), at}, in_parts);
}

Result<Directory> find_directory(int file, std::uint64_t file_bytes) {
  if (file_bytes < end_bytes) return bad_zip("is shorter than its end record");
  const auto count = static_cast<std::size_t>(
      std::min<std::uint64_t>(file_bytes, locator_bytes + end_bytes + comment_bytes_max));
  const auto tail = read_at(file, file_bytes - count, count);
  if (!tail) return tail.error();
  for (std::size_t at = count - end_bytes + 1; at-- > 0;) {
    if (u32(*tail, at) != end_mark) continue;
    if (at + end_bytes + u16(*tail, at + 20) != count) continue;  // its comment ends the file
    const std::uint64_t end_at = file_bytes - count + at;
    const Directory found{u32(*tail, at + 16), u32(*tail, at + 12), u16(*tail, at + 10), end_at};
    const bool has_locator = at >= locator_bytes && u32(*tail, at - locator_bytes) == locator_mark;
    // As many entries as the mark of ZIP64 says are possible without it.
    if (found.at == elsewhere32 || found.bytes == elsewhere32 ||
        (found.entries == elsewhere16 && has_locator)) {
      return find_directory64(file, end_at);
    }
    return checked_directory(found, u16(*tail, at + 4) != 0 || u16(*tail, at + 6) != 0 ||
                                        u16(*tail, at + 8) != found.entries);
  }
  return bad_zip("has no end record");
}

// What the upper bytes of the external attributes say, if the archive was made on Unix.
bool is_file_or_folder(std::uint32_t made_by, std::uint32_t attributes) {
  constexpr std::uint32_t unix_host = 3;
  if (made_by >> 8 != unix_host) return true;
  const auto type = static_cast<mode_t>(attributes >> 16) & S_IFMT;
  return type == 0 || type == S_IFREG || type == S_IFDIR;
}

// The numbers of an entry that its extra fields have instead. False: they do not.
bool read_zip64(Span fields, ZipEntry& entry) {
  std::vector<std::uint64_t*> wanted;
  for (std::uint64_t* number : {&entry.bytes, &entry.packed_bytes, &entry.header_at}) {
    if (*number == elsewhere32) wanted.push_back(number);
  }
  if (wanted.empty()) return true;
  while (fields.size() >= 4) {
    const std::size_t bytes = u16(fields, 2);
    if (bytes > fields.size() - 4) return false;
    if (u16(fields, 0) == zip64_field) {
      if (bytes < 8 * wanted.size()) return false;
      for (std::size_t n = 0; n < wanted.size(); ++n) *wanted[n] = u64(fields, 4 + 8 * n);
      return true;
    }
    fields = fields.subspan(4 + bytes);
  }
  return false;
}

// The entry at the beginning of the bytes, and how many it takes.
Result<std::pair<ZipEntry, std::size_t>> read_entry(Span bytes) {
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
  if (!is_path_within(out.name)) {
    return bad_entry(out, "whose name is not a path within it, of printable ASCII");
  }
  if ((u16(bytes, 8) & 1U) != 0) return bad_entry(out, "that is encrypted");
  if (method != 0 && !out.deflated) return bad_entry(out, "that is neither stored nor deflated");
  if (!is_file_or_folder(u16(bytes, 4), u32(bytes, 38))) {
    return bad_entry(out, "that is a link or a special file");
  }
  if (!read_zip64(bytes.subspan(directory_entry_bytes + name_bytes, u16(bytes, 30)), out)) {
    return bad_entry(out, "whose sizes are missing");
  }
  if (!out.deflated && out.bytes != out.packed_bytes) return bad_entry(out, "of two sizes");
  if (out.is_folder() && out.bytes > 0) return bad_entry(out, "that is a folder with bytes");
  return std::pair{std::move(out), all};
}

Result<void> check_sums(const std::vector<ZipEntry>& entries, std::uint64_t directory_at) {
  // No sum overflows: what is left of the archive is compared.
  std::uint64_t left = directory_at;
  for (const ZipEntry& entry : entries) {
    if (left < local_header_bytes || entry.packed_bytes > left - local_header_bytes) {
      return bad_zip("has entries that overlap");
    }
    left -= entry.packed_bytes + local_header_bytes;
  }
  const std::uint64_t packed = directory_at - left;
  const std::uint64_t most = ratio_free_bytes + ratio_max * std::min(packed, archive_bytes_max);
  std::uint64_t bytes = 0;
  for (const ZipEntry& entry : entries) {
    if (entry.bytes > most - bytes) {
      return bad_zip("has more than " + std::to_string(most) + " bytes in " +
                     std::to_string(packed) + ", more than " + std::to_string(ratio_max) +
                     " times as many");
    }
    bytes += entry.bytes;
  }
  return {};
}

// The last entry of a name replaces the earlier ones: writers that only append change files so.
std::vector<ZipEntry> last_of_names(std::vector<ZipEntry> entries) {
  std::set<std::string> names;
  std::vector<ZipEntry> out;
  out.reserve(entries.size());
  for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
    if (names.insert(entry->name).second) out.push_back(std::move(*entry));
  }
  std::reverse(out.begin(), out.end());
  return out;
}

// Counts the bytes of an entry while it passes them on.
class EntryBytes {
 public:
  explicit EntryBytes(const TakeBytes& take) : take_(take) {}

  Result<void> add(Span bytes) {
    crc_ = ::crc32_z(crc_, bytes.data(), bytes.size());
    count_ += bytes.size();
    return bytes.empty() ? Result<void>() : take_(bytes);
  }
  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] bool are_of(const ZipEntry& entry) const {
    return count_ == entry.bytes && crc_ == entry.crc;
  }

 private:
  const TakeBytes& take_;
  uLong crc_ = ::crc32_z(0, nullptr, 0);
  std::uint64_t count_ = 0;
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

  Result<void> take(Bytes& packed, const ZipEntry& entry, EntryBytes& out) {
    stream_.next_in = packed.data();
    stream_.avail_in = static_cast<uInt>(packed.size());
    while (ready_ && !ended_) {
      stream_.next_out = room_.data();
      stream_.avail_out = static_cast<uInt>(room_.size());
      const int state = ::inflate(&stream_, Z_NO_FLUSH);
      const std::size_t made = room_.size() - stream_.avail_out;
      if (made > entry.bytes - out.count()) return bad_entry(entry, "longer than it declares");
      if (auto ok = out.add(std::span(room_).first(made)); !ok) return ok;
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
  if (file_bytes < local_header_bytes || entry.header_at > file_bytes - local_header_bytes) {
    return bad_entry(entry, "beyond its end");
  }
  const auto header = read_at(file, entry.header_at, local_header_bytes);
  if (!header) return header.error();
  if (u32(*header, 0) != local_mark) return bad_entry(entry, "without a header");
  const std::uint64_t at =
      entry.header_at + local_header_bytes + u16(*header, 26) + u16(*header, 28);
  if (at > file_bytes || entry.packed_bytes > file_bytes - at) {
    return bad_entry(entry, "beyond its end");
  }
  return at;
}

}  // namespace

bool is_path_within(std::string_view name) {
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

Result<std::vector<ZipEntry>> list_zip(int file) {
  const auto file_bytes = size_of(file);
  if (!file_bytes) return file_bytes.error();
  const auto directory = find_directory(file, *file_bytes);
  if (!directory) return directory.error();
  const auto bytes = read_at(file, directory->at, static_cast<std::size_t>(directory->bytes));
  if (!bytes) return bytes.error();
  std::vector<ZipEntry> out;
  out.reserve(static_cast<std::size_t>(directory->entries));
  auto rest = Span(*bytes);
  for (std::uint64_t n = 0; n < directory->entries; ++n) {
    auto entry = read_entry(rest);
    if (!entry) return entry.error();
    rest = rest.subspan(entry->second);
    out.push_back(std::move(entry->first));
  }
  if (!rest.empty()) return bad_zip("has a malformed directory");
  if (const auto ok = check_sums(out, directory->at); !ok) return ok.error();
  return last_of_names(std::move(out));
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

Result<void> read_zip_entry(int file, const ZipEntry& entry, const TakeBytes& take) {
  const auto file_bytes = size_of(file);
  if (!file_bytes) return file_bytes.error();
  const auto at = data_at(file, entry, *file_bytes);
  if (!at) return at.error();
  EntryBytes out(take);
  std::optional<Inflater> inflater;
  if (entry.deflated) inflater.emplace();
  for (std::uint64_t done = 0; done < entry.packed_bytes;) {
    const std::uint64_t left = entry.packed_bytes - done;
    auto piece = read_at(file, *at + done,
                         static_cast<std::size_t>(std::min<std::uint64_t>(left, piece_bytes)));
    if (!piece) return piece.error();
    done += piece->size();
    auto ok = inflater ? inflater->take(*piece, entry, out) : out.add(*piece);
    if (!ok) return ok;
  }
  if (inflater && !inflater->has_ended()) return bad_entry(entry, "that is not deflated");
  if (!out.are_of(entry)) {
    return bad_entry(entry, "with another size or checksum than it declares");
  }
  return {};
}

}  // namespace windsplat::data::archive
