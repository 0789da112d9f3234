// Folder -> names -> a page of them with size and format.
#include "server/data/files/folder_list.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "server/data/files/beneath.hpp"
#include "server/data/files/locate_parts.hpp"
#include "server/data/files/pattern.hpp"

namespace windsplat::data {

namespace {

struct Names {
  std::vector<std::string> all;  // sorted
  bool cut = false;
};

Result<Names> names_in(int root, const std::string& folder) {
  const int descriptor =
      beneath::open(root, folder.empty() ? "." : folder, O_RDONLY | O_DIRECTORY | O_NONBLOCK);
  if (descriptor < 0) return beneath::not_reached(folder, errno);
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(::fdopendir(descriptor), ::closedir);
  if (!directory) {
    const int reason = errno;
    ::close(descriptor);
    return beneath::not_reached(folder, reason);
  }
  Names names;
  while (const dirent* entry = ::readdir(directory.get())) {
    const std::string_view name = entry->d_name;
    if (name.starts_with('.')) continue;
    if (names.all.size() == folder_names_max) {
      names.cut = true;
      break;
    }
    names.all.emplace_back(name);
  }
  std::sort(names.all.begin(), names.all.end(), comes_before);
  return names;
}

// The first bytes of a file; empty if it cannot be read.
std::string head_of(int root, const std::string& path) {
  constexpr std::size_t head_bytes = 4096;
  const Descriptor file(beneath::open(root, path, O_RDONLY | O_NONBLOCK | O_NOCTTY));
  if (!file) return {};
  std::string head(head_bytes, '\0');
  const ssize_t read = ::pread(file.number(), head.data(), head.size(), 0);
  head.resize(read > 0 ? static_cast<std::size_t>(read) : 0);
  return head;
}

std::string format_of_folder(int root, const std::string& path, const FormatRules& rules) {
  for (const FolderMark& mark : rules.of_folders) {
    if (Descriptor(beneath::open(root, path + '/' + mark.name, O_PATH))) return mark.format;
  }
  return {};
}

// None for names that are left out.
std::optional<FolderEntry> entry_of(int root, const std::string& folder, const std::string& name,
                                    const FormatRules& rules) {
  if (printable(name) != name) return std::nullopt;
  const std::string path = folder.empty() ? name : folder + '/' + name;
  const Descriptor found(beneath::open(root, path, O_PATH));
  struct stat status {};
  if (!found || ::fstat(found.number(), &status) != 0) return std::nullopt;
  FolderEntry entry;
  entry.name = name;
  if (S_ISDIR(status.st_mode)) {
    entry.is_folder = true;
    entry.format = format_of_folder(root, path, rules);
    return entry;
  }
  if (!S_ISREG(status.st_mode)) return std::nullopt;
  entry.bytes = static_cast<std::uint64_t>(status.st_size);
  entry.format = rules.of_file(head_of(root, path), name);
  return entry;
}

bool is_in_number(char c) { return c >= '0' && c <= '9'; }

// A name as texts and runs of digits in turn, beginning with a text: "f10.nc" is "f", "10", ".nc".
std::vector<std::string> parts_of(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name) {
    const bool in_digits = parts.size() % 2 == 0;
    if (is_in_number(c) != in_digits) parts.emplace_back();
    parts.back() += c;
  }
  return parts;
}

using Members = std::vector<std::vector<std::string>>;

// The numbers that differ become wildcards.
std::string pattern_of(const Members& members) {
  std::string pattern;
  for (std::size_t n = 0; n < members.front().size(); ++n) {
    const std::string& first = members.front()[n];
    const bool differs = std::any_of(members.begin(), members.end(),
                                     [&](const auto& parts) { return parts[n] != first; });
    pattern += differs ? "*" : first;
  }
  return pattern;
}

}  // namespace

std::vector<NameGroup> groups_of(const std::vector<std::string>& names) {
  std::map<std::string, Members> by_text;
  for (const std::string& name : names) {
    if (has_wildcard(name) || printable(name) != name) continue;
    auto parts = parts_of(name);
    std::string text;
    for (std::size_t n = 0; n < parts.size(); n += 2) text += parts[n] + '/';
    by_text[text].push_back(std::move(parts));
  }
  std::vector<NameGroup> groups;
  for (const auto& [text, members] : by_text) {
    if (members.size() > 1) groups.push_back({pattern_of(members), members.size()});
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const auto& a, const auto& b) { return a.files > b.files; });
  if (groups.size() > name_groups_max) groups.resize(name_groups_max);
  std::erase_if(groups, [&](const NameGroup& group) {
    const std::vector<std::string> alternatives = alternatives_of(group.pattern);
    const auto matched = std::count_if(names.begin(), names.end(), [&](const std::string& name) {
      return alternative_matching(alternatives, name) >= 0;
    });
    return static_cast<std::size_t>(matched) != group.files;
  });
  return groups;
}

Result<FolderList> list_beneath(const std::string& root, const std::string& folder,
                                const std::string& after, std::size_t count,
                                const FormatRules& rules) {
  if (!folder.empty()) {
    if (const auto ok = beneath::check_letters(folder); !ok) return ok.error();
  }
  const auto top = beneath::open_root(root);
  if (!top) return top.error();
  auto names = names_in(top->number(), folder);
  if (!names) return names.error();
  FolderList out;
  out.cut = names->cut;
  // Names that are no text cannot be asked for, and none could follow them.
  const auto untold =
      std::erase_if(names->all, [](const std::string& name) { return printable(name) != name; });
  if (after.empty()) out.omitted += untold;
  if (after.empty()) out.groups = groups_of(names->all);
  const auto begin = std::find_if(
      names->all.begin(), names->all.end(),
      [&](const std::string& name) { return after.empty() || comes_before(after, name); });
  const auto rest = static_cast<std::size_t>(names->all.end() - begin);
  const auto end = begin + static_cast<std::ptrdiff_t>(std::min(count, rest));
  for (auto name = begin; name != end; ++name) {
    auto entry = entry_of(top->number(), folder, *name, rules);
    if (entry) out.entries.push_back(std::move(*entry));
    out.omitted += entry ? 0U : 1U;
  }
  if (end != names->all.end() && begin != end) out.next = *(end - 1);
  return out;
}

}  // namespace windsplat::data
