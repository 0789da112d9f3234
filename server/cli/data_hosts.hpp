// The options of commands that open datasets on other hosts.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/fetch/fetcher.hpp"

namespace CLI {
class App;
}

namespace windsplat::cli {

struct DataHostArguments {
  std::vector<std::string> hosts;
  bool allow_private = false;
  std::string authorities;
  std::string cache;  // empty: `windsplat` in the user's folder of caches
  std::string cache_size = "8G";
  std::string download_max = "2G";
  int download_time_s = 600;
  std::string s3_endpoint;
};

// `arguments` must outlive the command.
void add_data_host_options(CLI::App& command, DataHostArguments& arguments);

// Validates the arguments without opening anything. Errors: malformed, invalid.
Result<data::fetch::FetchOptions> fetch_options(const DataHostArguments& arguments);

// Null without --data-host. Errors: those of fetch_options() and of the cache.
Result<std::shared_ptr<data::fetch::Fetcher>> open_fetcher(const DataHostArguments& arguments);

}  // namespace windsplat::cli
