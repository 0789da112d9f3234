// Divides the memory limit between data and loaders, and opens files.
#include "server/cli/open_store.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <string_view>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/cf/grid/crs_wkt.hpp"
#include "server/data/derived/source.hpp"
#include "server/data/files/files.hpp"
#include "server/data/formats/grib/open.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/samples/samples.hpp"

namespace windsplat::cli {

namespace {

// Memory of a loader: a quarter of the limit within these bounds, or half of a limit whose quarter
// is below the lower bound.
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

std::uint64_t data_bytes_of(std::uint64_t memory_bytes) {
  return memory_bytes - program_bytes - memory_bytes / data_bytes_a_summary_byte;
}

}  // namespace

std::uint64_t ground_bytes_of(std::uint64_t memory_bytes) {
  constexpr std::uint64_t summaries = std::uint64_t{64} << 20;
  const std::uint64_t part = memory_bytes / data_bytes_a_summary_byte;
  return std::min(std::max(part, summaries) - summaries, summaries);
}

namespace {

data::LimitName limit_name(std::uint64_t memory_bytes) {
  data::LimitName name;
  name.text = "--memory-limit " + bytes_text(memory_bytes);
  name.raised = [](std::uint64_t data_bytes) {
    constexpr std::uint64_t unit = std::uint64_t{1} << 20;
    const std::uint64_t all =
        (data_bytes + program_bytes) / (data_bytes_a_summary_byte - 1) * data_bytes_a_summary_byte +
        data_bytes_a_summary_byte;
    return "--memory-limit " +
           bytes_text(std::max((all + unit - 1) / unit * unit, memory_bytes_min));
  };
  return name;
}

// The time of fetching is bounded for each file; a call may fetch many.
constexpr std::chrono::minutes fetch_time_of_a_call{30};

void let_fetch(data::loader::Limits& limits, const FetcherPtr& fetcher) {
  limits.fetch_time = fetch_time_of_a_call;
  limits.files = [fetcher](const data::Location& location, std::function<bool()> cancelled) {
    return location.fetched ? data::fetch::fetched_files(*fetcher, location, std::move(cancelled))
                            : data::direct_files(location);
  };
}

Result<void> check_host(const data::fetch::Fetcher* fetcher, const data::Location& location) {
  if (fetcher != nullptr) return fetcher->check(location);
  return make_error(
      ErrorKind::invalid,
      in_quotes(location.members.empty() ? location.folder : location.members.front().path) +
          " is a URL: files are fetched only from the hosts of --data-host, and none is "
          "given");
}

// Tables of the libraries, and how files are fetched.
void add_surroundings(data::loader::Limits& limits, const FetcherPtr& fetcher) {
  limits.library_folders = folders_of(data::grib::definitions_folder());
  if (std::string folder = data::cf::projection_database_folder(); !folder.empty()) {
    limits.library_folders.push_back(std::move(folder));
  }
  if (fetcher) let_fetch(limits, fetcher);
}

Result<std::unique_ptr<data::Source>> open_location(const data::Location& location,
                                                    const data::loader::Limits& limits,
                                                    const data::fetch::Fetcher* fetcher,
                                                    const CancelToken& cancel) {
  if (location.fetched) {
    if (auto permitted = check_host(fetcher, location); !permitted) return permitted.error();
  }
  auto source = data::loader::open(location, limits, cancel);
  if (!source) return source.error();
  return std::unique_ptr<data::Source>(std::move(*source));
}

data::StoreOptions options_of(std::uint64_t memory_bytes, data::Storage storage,
                              data::loader::Limits limits, FetcherPtr fetcher) {
  data::StoreOptions options;
  WINDSPLAT_CHECK(memory_bytes >= memory_bytes_min);
  options.bytes_max = data_bytes_of(memory_bytes);
  options.budget = std::make_shared<data::Budget>(options.bytes_max, limit_name(memory_bytes));
  limits.memory_bytes =
      std::clamp(memory_bytes / 4, std::min(loader_bytes_min, memory_bytes / 2), loader_bytes_max);
  limits.budget = options.budget;
  options.storage = storage;
  add_surroundings(limits, fetcher);
  options.open = [limits, fetcher = std::move(fetcher)](const data::Location& location,
                                                        const CancelToken& cancel) {
    return open_location(location, limits, fetcher.get(), cancel);
  };
  return options;
}

}  // namespace

Result<std::unique_ptr<data::Source>> open_source(const std::string& name,
                                                  std::uint64_t loader_bytes,
                                                  const FetcherPtr& fetcher,
                                                  const CancelToken& cancel) {
  if (const auto sample = data::sized_sample(name)) {
    auto source = data::open_sample(sample->name, sample->dims);
    if (!source) return source.error();
    return std::unique_ptr<data::Source>(data::derived::with_derived_fields(std::move(*source)));
  }
  const auto location = data::locate(name);
  if (!location) return location.error();
  data::loader::Limits limits;
  limits.memory_bytes = loader_bytes;
  add_surroundings(limits, fetcher);
  return open_location(*location, limits, fetcher.get(), cancel);
}

std::string bytes_text(std::uint64_t bytes) {
  constexpr std::string_view units = "TGM";
  for (std::size_t i = 0; i < units.size(); ++i) {
    const std::uint64_t unit = std::uint64_t{1} << (40U - 10U * i);
    if (bytes >= unit && bytes % unit == 0) return std::to_string(bytes / unit) + units[i];
  }
  return std::to_string(bytes);
}

data::StoreOptions store_options(std::uint64_t memory_bytes, FetcherPtr fetcher,
                                 data::Storage storage) {
  return options_of(memory_bytes, storage, {}, std::move(fetcher));
}

data::StoreOptions frugal_store_options(std::uint64_t memory_bytes, FetcherPtr fetcher) {
  data::loader::Limits limits;
  limits.reads_take_all = false;
  return options_of(memory_bytes, data::Storage::float32, limits, std::move(fetcher));
}

}  // namespace windsplat::cli
