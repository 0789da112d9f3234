// A limit of bytes -> what of it is for data, and how files are opened.
#include "server/cli/open_store.hpp"

#include <algorithm>

#include "server/data/grib/open.hpp"
#include "server/data/loader/loader.hpp"

namespace windsplat::cli {

namespace {

// A daemon without data, pictures in work and one loader.
constexpr std::uint64_t kept_back_bytes = std::uint64_t{128} << 20;
constexpr std::uint64_t loader_bytes_min = std::uint64_t{256} << 20;
constexpr std::uint64_t loader_bytes_max = std::uint64_t{2} << 30;

std::vector<std::string> folders_of(const std::string& joined) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < joined.size();) {
    const std::size_t end = std::min(joined.find(':', at), joined.size());
    if (end > at) out.push_back(joined.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

}  // namespace

data::StoreOptions store_options(std::uint64_t memory_bytes, data::Storage storage) {
  data::loader::Limits limits;
  limits.memory_bytes = std::clamp(memory_bytes / 4, loader_bytes_min, loader_bytes_max);
  limits.library_folders = folders_of(data::grib::definitions_folder());
  data::StoreOptions options;
  options.bytes_max = memory_bytes - std::min(memory_bytes / 2, kept_back_bytes);
  options.storage = storage;
  options.open = [limits](const data::Location& location) -> Result<std::unique_ptr<data::Source>> {
    auto source = data::loader::open(location, limits);
    if (!source) return source.error();
    return std::unique_ptr<data::Source>(std::move(*source));
  };
  return options;
}

}  // namespace windsplat::cli
