// What could be opened in a folder below the data root, one page at a time: names, sizes and the
// formats that the first bytes of files tell. Nothing is parsed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/base/error.hpp"

namespace windsplat::data {

struct FolderEntry {
  std::string name;
  bool is_folder = false;
  std::uint64_t bytes = 0;  // of a file
  std::string format;       // empty: none that is known
};

// Files whose names differ in numbers only, and a pattern that matches these and no other.
struct NameGroup {
  std::string pattern;
  std::size_t files = 0;
};

struct FolderList {
  std::vector<FolderEntry> entries;  // in natural order (f2 before f10)
  std::vector<NameGroup> groups;     // of the whole folder, the largest first; on the first page
  std::string next;                  // the last name that was looked at, if others follow
  // Names of this page that are left out: links that lead nowhere or out of the root, special
  // files, names with characters that cannot be shown.
  std::size_t omitted = 0;
  bool cut = false;  // the folder has more names than were read
};

// A folder that has this file is a dataset of the format.
struct FolderMark {
  const char* name;
  const char* format;
};

struct FormatRules {
  // The format of a file by its first bytes (at most 4096) and its name; empty: none.
  std::string_view (*of_file)(std::string_view head, std::string_view name);
  std::span<const FolderMark> of_folders;
};

inline constexpr std::size_t folder_names_max = 10'000;  // that are read of one folder
inline constexpr std::size_t name_groups_max = 64;

// `folder`: relative to the root, empty for the root itself. The entries after the name `after`, of
// at most `count` names. Names that begin with a dot are not listed. Errors: invalid (refused, not
// a folder), not_found, internal; messages contain the folder as given, not the root.
Result<FolderList> list_beneath(const std::string& root, const std::string& folder,
                                const std::string& after, std::size_t count,
                                const FormatRules& rules);

// Groups of at least two of the names. Pure.
std::vector<NameGroup> groups_of(const std::vector<std::string>& names);

}  // namespace windsplat::data
