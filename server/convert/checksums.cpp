#include "server/convert/checksums.hpp"

#include <charconv>
#include <cstdio>
#include <fstream>
#include <vector>

#include "server/data/formats/zarr/crc32c.hpp"

namespace windsplat::convert {

namespace {

const unsigned char* octets(std::string_view bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

}  // namespace

Checksum checksum_of(std::string_view bytes) {
  return {bytes.size(), data::zarr::crc32c(octets(bytes), bytes.size())};
}

Result<Checksum> checksum_of_file(const std::filesystem::path& path, const CancelToken& cancel) {
  constexpr std::size_t piece = std::size_t{1} << 20;
  std::ifstream file(path, std::ios::binary);
  std::vector<char> bytes(piece);
  Checksum out;
  while (file) {
    if (cancel.cancelled()) return make_error(ErrorKind::cancelled, "interrupted");
    file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    const auto count = static_cast<std::size_t>(file.gcount());
    out.crc32c = data::zarr::crc32c(octets({bytes.data(), count}), count, out.crc32c);
    out.bytes += count;
  }
  if (file.eof()) return out;
  return make_error(ErrorKind::not_found, "cannot read " + in_quotes(path.native()));
}

std::string text_of(const Checksums& checksums) {
  std::string out;
  for (const auto& [path, sum] : checksums) {
    char crc[9];
    std::snprintf(crc, sizeof crc, "%08x", sum.crc32c);
    out += crc + (' ' + std::to_string(sum.bytes)) + ' ' + path + '\n';
  }
  return out;
}

Result<Checksums> parse_checksums(const std::string& text) {
  Checksums out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    Checksum sum;
    const char* const stop = text.data() + (end == std::string::npos ? at : end);
    const auto crc = std::from_chars(text.data() + at, stop, sum.crc32c, 16);
    const bool has_crc = crc.ec == std::errc() && crc.ptr < stop && *crc.ptr == ' ';
    const auto size = std::from_chars(has_crc ? crc.ptr + 1 : stop, stop, sum.bytes);
    if (!has_crc || size.ec != std::errc() || size.ptr >= stop || *size.ptr != ' ') {
      return make_error(ErrorKind::bad_data,
                        std::string(checksums_name) + " is not a list of checksums");
    }
    out.insert_or_assign(std::string(size.ptr + 1, stop), sum);
    at = end + 1;
  }
  return out;
}

std::string without_contents(std::string text, const std::string& contents) {
  for (std::size_t at = text.find(contents); !contents.empty() && at != std::string::npos;
       at = text.find(contents, at + contents.size())) {
    text.replace(at, contents.size(), no_contents);
  }
  return text;
}

}  // namespace windsplat::convert
