// A folder below the data root as clients see it. Mirrors messages.schema.json.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace windsplat::protocol {

struct FolderDescription {
  struct Entry {
    std::string name;
    bool is_folder = false;
    std::uint64_t bytes = 0;  // of a file
    std::string format;       // empty: none that is known
  };
  struct Group {
    std::string pattern;
    std::size_t files = 0;
  };
  std::string folder;
  std::vector<Entry> entries;
  std::vector<Group> groups;
  std::string next;  // `after` of the next page; empty: there is none
  std::size_t omitted = 0;
  bool cut = false;
};

std::string encode_folder(const FolderDescription& folder);

}  // namespace windsplat::protocol
