#include "server/cli/data_hosts.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <utility>

#include "server/cli/command.hpp"

namespace windsplat::cli {
namespace {

constexpr int download_time_s_max = 24 * 3600;

Result<std::uint64_t> bytes_of(const char* option, const std::string& text) {
  constexpr std::uint64_t bytes_max = std::uint64_t{1} << 47;
  const auto bytes = parse_bytes(text);
  if (bytes && *bytes <= bytes_max) return *bytes;
  return make_error(ErrorKind::malformed, std::string(option) + " '" + printable(text) +
                                              "' is not a number of bytes such as 512M or 8G");
}

// $XDG_CACHE_HOME or ~/.cache (XDG Base Directory Specification).
std::string user_cache() {
  const char* const set = std::getenv("XDG_CACHE_HOME");
  if (set != nullptr && *set == '/') return std::string(set) + "/windsplat";
  const char* const home = std::getenv("HOME");
  return home != nullptr && *home == '/' ? std::string(home) + "/.cache/windsplat" : "";
}

}  // namespace

void add_data_host_options(CLI::App& command, DataHostArguments& arguments) {
  constexpr const char* group = "Data on other hosts";
  command
      .add_option(
          "--data-host", arguments.hosts,
          "Host from which files may be fetched, by https:// URLs; http://HOST for "
          "unencrypted http; for s3:// the host of the endpoint. May be repeated; default: none")
      ->envname("WINDSPLAT_DATA_HOST")
      ->allow_extra_args(false)
      ->delimiter(',')
      ->type_name("HOST[:PORT]")
      ->group(group);
  command
      .add_flag("--allow-private-data-hosts", arguments.allow_private,
                "Fetch files also from addresses in private networks and of this machine")
      ->envname("WINDSPLAT_ALLOW_PRIVATE_DATA_HOSTS")
      ->group(group);
  command
      .add_option("--data-ca", arguments.authorities,
                  "Certificates to trust when fetching files (PEM); default: those of the system")
      ->envname("WINDSPLAT_DATA_CA")
      ->type_name("FILE")
      ->group(group);
  command
      .add_option("--data-cache", arguments.cache,
                  "Folder of fetched files; default: windsplat in $XDG_CACHE_HOME or ~/.cache")
      ->envname("WINDSPLAT_DATA_CACHE")
      ->type_name("DIR")
      ->group(group);
  command
      .add_option("--data-cache-size", arguments.cache_size,
                  "Bytes on disk beyond which the files used least recently are removed")
      ->envname("WINDSPLAT_DATA_CACHE_SIZE")
      ->type_name("BYTES")
      ->capture_default_str()
      ->group(group);
  command.add_option("--max-download", arguments.download_max, "Bytes of a fetched file")
      ->envname("WINDSPLAT_MAX_DOWNLOAD")
      ->type_name("BYTES")
      ->capture_default_str()
      ->group(group);
  command.add_option("--max-download-time", arguments.download_time_s, "Time to fetch a file")
      ->envname("WINDSPLAT_MAX_DOWNLOAD_TIME")
      ->check(CLI::Range(1, download_time_s_max))
      ->type_name("SECONDS")
      ->capture_default_str()
      ->group(group);
  command
      .add_option("--s3-endpoint", arguments.s3_endpoint,
                  "Service of s3:// URLs; default: that of Amazon in $AWS_REGION")
      ->envname("AWS_ENDPOINT_URL")
      ->type_name("URL")
      ->group(group);
}

Result<data::fetch::FetchOptions> fetch_options(const DataHostArguments& arguments) {
  namespace fetch = data::fetch;
  fetch::FetchOptions out;
  auto rules = fetch::HostRules::parse(arguments.hosts, arguments.allow_private);
  if (!rules) return rules.error();
  out.rules = std::move(*rules);
  const auto download = bytes_of("--max-download", arguments.download_max);
  if (!download) return download.error();
  const auto cache = bytes_of("--data-cache-size", arguments.cache_size);
  if (!cache) return cache.error();
  if (*download > *cache) {
    return make_error(ErrorKind::invalid, "--max-download " + arguments.download_max +
                                              " is above --data-cache-size " +
                                              arguments.cache_size);
  }
  out.limits.bytes_max = *download;
  out.limits.time = std::chrono::seconds(arguments.download_time_s);
  out.cache.bytes_max = *cache;
  out.cache.folder = arguments.cache.empty() ? user_cache() : arguments.cache;
  if (out.cache.folder.empty() && !arguments.hosts.empty()) {
    return make_error(ErrorKind::invalid,
                      "--data-host needs --data-cache: there is no home folder");
  }
  if (!arguments.authorities.empty()) {
    std::error_code fault;
    if (!std::filesystem::is_regular_file(arguments.authorities, fault)) {
      return make_error(ErrorKind::invalid,
                        "--data-ca '" + printable(arguments.authorities) + "' is not a file");
    }
    out.authorities = arguments.authorities;
  }
  auto s3 = fetch::s3_service(arguments.s3_endpoint, fetch::s3_key_of_environment());
  if (!s3) return s3.error();
  out.s3 = std::move(*s3);
  return out;
}

Result<std::shared_ptr<data::fetch::Fetcher>> open_fetcher(const DataHostArguments& arguments) {
  if (arguments.hosts.empty()) return std::shared_ptr<data::fetch::Fetcher>();
  auto options = fetch_options(arguments);
  if (!options) return options.error();
  auto fetcher = data::fetch::Fetcher::open(std::move(*options));
  if (!fetcher) return fetcher.error();
  return std::shared_ptr<data::fetch::Fetcher>(std::move(*fetcher));
}

}  // namespace windsplat::cli
