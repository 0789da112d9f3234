// The options of `windsplat serve`: how they are named and what they set.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "protocol/limits.hpp"
#include "server/access/limits.hpp"
#include "server/cli/data_hosts.hpp"

namespace windsplat::cli {

struct ServeArguments {
  std::vector<std::string> datasets;
  std::string config;
  std::vector<std::string> listen{"127.0.0.1:8080"};
  std::string listen_mode = "0660";
  bool allow_remote = false;
  bool allow_root = false;
  std::string token_file;
  std::string tls_cert;
  std::string tls_key;
  std::string base_path = "/";
  std::string data_root;
  bool fixed_entries = false;
  bool strict = false;  // every dataset must open
  DataHostArguments data_hosts;
  std::string state_dir;
  std::string upload_limit = "0";
  std::string memory_limit = "8G";
  std::string storage = "float32";
  unsigned threads = 0;
  int sessions = protocol::limits::sessions_max_default;
  std::vector<std::string> origins;
  std::vector<std::string> hosts;
  std::vector<std::string> embedders;
  int idle_timeout_s = 300;
  std::string log_format = "text";
  std::string log_level = "info";
  access::Limits limits;
  std::string verbosity_level;  // that of -q or -v, which replaces log_level; empty: neither
};

// `arguments` must outlive the command.
void add_serve_options(CLI::App& command, ServeArguments& arguments);

}  // namespace windsplat::cli
