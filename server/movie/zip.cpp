#include "server/movie/zip.hpp"

#include <zlib.h>

#include <limits>
#include <utility>

namespace windsplat::movie {
namespace {

constexpr std::uint32_t header_signature = 0x04034b50;         // 4.3.7
constexpr std::uint32_t directory_signature = 0x02014b50;      // 4.3.12
constexpr std::uint32_t end64_signature = 0x06064b50;          // 4.3.14
constexpr std::uint32_t end64_locator_signature = 0x07064b50;  // 4.3.15
constexpr std::uint32_t end_signature = 0x06054b50;            // 4.3.16
constexpr std::uint16_t version_stored = 10;                   // 4.4.3.2
constexpr std::uint16_t version_zip64 = 45;
constexpr std::uint16_t made_on_unix = 3 << 8;            // 4.4.2
constexpr std::uint32_t mode_of_files = 0100644U << 16U;  // a plain file, rw-r--r--
constexpr std::uint16_t first_day = (1 << 5) | 1;         // 1 January 1980 (4.4.6)
constexpr std::uint16_t zip64_field = 1;                  // 4.5.3
constexpr std::uint32_t in_zip64 = 0xffffffff;            // the value is in the ZIP64 record
constexpr std::uint16_t count_in_zip64 = 0xffff;

// Little-endian fields.
class Record {
 public:
  Record& u16(std::uint64_t value) { return put(value, 2); }
  Record& u32(std::uint64_t value) { return put(value, 4); }
  Record& u64(std::uint64_t value) { return put(value, 8); }
  Record& text(const std::string& text) {
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    return *this;
  }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }

 private:
  Record& put(std::uint64_t value, int count) {
    for (int n = 0; n < count; ++n) {
      bytes_.push_back(static_cast<std::uint8_t>(value >> (8U * static_cast<unsigned>(n))));
    }
    return *this;
  }
  std::vector<std::uint8_t> bytes_;
};

std::uint32_t crc_of(std::span<const std::uint8_t> bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, bytes.data(), bytes.size()));
}

}  // namespace

Result<void> Zip::put(std::span<const std::uint8_t> bytes) {
  if (auto done = sink_(bytes); !done) return done;
  at_ += bytes.size();
  return {};
}

Result<void> Zip::add(const std::string& name, std::span<const std::uint8_t> bytes) {
  if (bytes.size() >= in_zip64) {
    return make_error(ErrorKind::too_large,
                      in_quotes(name) + " has 4 GiB or more, too much for a file in a .zip");
  }
  const Entry entry{name, crc_of(bytes), static_cast<std::uint32_t>(bytes.size()), at_};
  Record header;
  header.u32(header_signature).u16(version_stored).u16(0).u16(0);  // no flags, stored
  header.u16(0).u16(first_day).u32(entry.crc).u32(entry.bytes).u32(entry.bytes);
  header.u16(name.size()).u16(0).text(name);
  if (auto done = put(header.bytes()); !done) return done;
  if (auto done = put(bytes); !done) return done;
  entries_.push_back(entry);
  return {};
}

Result<void> Zip::finish() {
  const std::uint64_t directory = at_;
  for (const Entry& entry : entries_) {
    const bool far = entry.offset >= in_zip64;
    Record record;
    record.u32(directory_signature);
    record.u16(made_on_unix | (far ? version_zip64 : version_stored));
    record.u16(far ? version_zip64 : version_stored).u16(0).u16(0);
    record.u16(0).u16(first_day).u32(entry.crc).u32(entry.bytes).u32(entry.bytes);
    record.u16(entry.name.size()).u16(far ? 12 : 0).u16(0).u16(0).u16(0).u32(mode_of_files);
    record.u32(far ? in_zip64 : entry.offset).text(entry.name);
    if (far) record.u16(zip64_field).u16(8).u64(entry.offset);
    if (auto done = put(record.bytes()); !done) return done;
  }
  const std::uint64_t bytes = at_ - directory;
  const std::uint64_t count = entries_.size();
  const bool many = count >= count_in_zip64;
  const bool far = directory >= in_zip64 || bytes >= in_zip64;
  Record end;
  if (many || far) {
    constexpr std::uint64_t bytes_after_size = 44;  // 4.3.14.1
    end.u32(end64_signature).u64(bytes_after_size).u16(made_on_unix | version_zip64);
    end.u16(version_zip64).u32(0).u32(0).u64(count).u64(count).u64(bytes).u64(directory);
    end.u32(end64_locator_signature).u32(0).u64(at_).u32(1);
  }
  const std::uint64_t short_count = many ? count_in_zip64 : count;
  end.u32(end_signature).u16(0).u16(0).u16(short_count).u16(short_count);
  end.u32(bytes >= in_zip64 ? in_zip64 : bytes);
  end.u32(directory >= in_zip64 ? in_zip64 : directory).u16(0);
  return put(end.bytes());
}

}  // namespace windsplat::movie
