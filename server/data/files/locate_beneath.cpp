// Converts an untrusted path to a Location below the data root: the kernel resolves every
// component, and the resolved path is read back.
#include <dirent.h>
#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <filesystem>
#include <memory>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/data/files/beneath.hpp"
#include "server/data/files/descriptor.hpp"
#include "server/data/files/files.hpp"
#include "server/data/files/locate_parts.hpp"
#include "server/data/files/pattern.hpp"
#include "server/data/files/url.hpp"

namespace windsplat::data {

namespace {

namespace fs = std::filesystem;

Error refused(const std::string& path, const std::string& why) {
  return make_error(ErrorKind::invalid, in_quotes(path) + ' ' + why);
}

}  // namespace

namespace beneath {

Result<Descriptor> open_root(const std::string& root) {
  Descriptor top(::open(root.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (top) return top;
  return make_error(ErrorKind::internal,
                    "the data root cannot be opened: " + std::generic_category().message(errno));
}

int open(int root, const std::string& path, std::uint64_t flags) {
  open_how how{};
  how.flags = flags | O_CLOEXEC;
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  return static_cast<int>(::syscall(SYS_openat2, root, path.c_str(), &how, sizeof how));
}

bool leads_nowhere(int reason) { return reason == EXDEV || reason == ELOOP || reason == ENOENT; }

Error not_reached(const std::string& path, int reason) {
  if (reason == ENOENT || reason == ENOTDIR) {
    return make_error(ErrorKind::not_found, in_quotes(path) + ": no such file below the data root");
  }
  if (reason == EXDEV || reason == ELOOP) return refused(path, "is outside the data root");
  return refused(path, "cannot be reached: " + std::generic_category().message(reason));
}

Result<void> check_letters(const std::string& path) {
  if (path.empty() || path.find('\0') != std::string::npos) {
    return make_error(ErrorKind::invalid, "no path given");
  }
  if (looks_like_url(path)) {
    return refused(without_secrets(path),
                   "is a URL; URLs are opened only of the hosts of --data-host, and none is given");
  }
  if (path.front() == '/') return refused(path, "is absolute; paths are below the data root");
  bool names_something = false;
  for (const fs::path& part : fs::path(path)) {
    if (part == "..") return refused(path, "is outside the data root");
    names_something = names_something || (!part.empty() && part != ".");
  }
  if (!names_something) return refused(path, "is the data root itself");
  return {};
}

}  // namespace beneath

namespace {

using beneath::not_reached;

// The path of an open descriptor, all links resolved.
Result<std::string> path_of(const Descriptor& descriptor, const std::string& path) {
  std::array<char, PATH_MAX> target{};
  const std::string link = "/proc/self/fd/" + std::to_string(descriptor.number());
  const ssize_t length = ::readlink(link.c_str(), target.data(), target.size());
  if (length <= 0 || static_cast<std::size_t>(length) == target.size() || target[0] != '/') {
    return refused(path, "has an unprintable name");
  }
  return std::string(target.data(), static_cast<std::size_t>(length));
}

Result<Location> located(const Descriptor& found, const std::string& path) {
  struct stat status {};
  if (::fstat(found.number(), &status) != 0) return not_reached(path, errno);
  const auto plain = path_of(found, path);
  if (!plain) return plain.error();
  Location out;
  const fs::path named =
      fs::path(path).has_filename() ? fs::path(path) : fs::path(path).parent_path();
  out.stem = named.stem().native();
  if (S_ISDIR(status.st_mode)) {
    out.kind = Location::Kind::folder;
    out.folder = *plain;
    return out;
  }
  if (!S_ISREG(status.st_mode)) return refused(path, "is neither a file nor a folder");
  const fs::path file(*plain);
  out.folder = file.parent_path().native();
  out.members.push_back({file.filename().native(), *plain});
  out.companions = may_have_companions(file.filename().native());
  return out;
}

// Names in a folder that match a pattern, unsorted.
Result<std::vector<std::string>> matches_in(int root, const std::string& folder,
                                            const std::string& pattern) {
  const int descriptor = beneath::open(root, folder.empty() ? "." : folder, O_RDONLY | O_DIRECTORY);
  if (descriptor < 0) return not_reached(folder, errno);
  const std::unique_ptr<DIR, int (*)(DIR*)> directory(::fdopendir(descriptor), ::closedir);
  if (!directory) {
    const int reason = errno;
    ::close(descriptor);
    return not_reached(folder, reason);
  }
  const std::vector<std::string> alternatives = alternatives_of(pattern);
  std::vector<std::string> names;
  while (const dirent* entry = ::readdir(directory.get())) {
    const std::string name = entry->d_name;
    if (name == "." || name == "..") continue;
    if (alternative_matching(alternatives, name) < 0) continue;
    names.push_back(name);
    if (names.size() > series_members_max) {
      return refused(pattern, "matches more than " + std::to_string(series_members_max) + " files");
    }
  }
  return names;
}

Result<Location> series(int root, const std::string& root_path, const std::string& path) {
  const std::string pattern = fs::path(path).filename().native();
  const std::string folder = fs::path(path).parent_path().native();
  const auto names = matches_in(root, folder, pattern);
  if (!names) return names.error();
  const Descriptor at(beneath::open(root, folder.empty() ? "." : folder, O_PATH | O_DIRECTORY));
  if (!at) return not_reached(folder, errno);
  auto plain_folder = path_of(at, path);
  if (!plain_folder) return plain_folder.error();
  Location out;
  out.kind = Location::Kind::series;
  out.folder = std::move(*plain_folder);
  out.stem = stem_of_pattern(pattern);
  out.pattern = path;
  out.root = root_path;
  out.companions = steps_may_have_companions(pattern);
  std::size_t left_out = 0;
  for (const std::string& name : *names) {
    const std::string below = (fs::path(folder) / name).native();
    const Descriptor found(beneath::open(root, below, O_PATH));
    // A link that is dangling or leads out of the root is not part of the series.
    const bool no_member = !found && beneath::leads_nowhere(errno);
    left_out += no_member ? 1U : 0U;
    if (no_member) continue;
    if (!found) return not_reached(below, errno);
    struct stat status {};
    if (::fstat(found.number(), &status) != 0) return not_reached(below, errno);
    if (!S_ISREG(status.st_mode)) continue;
    auto plain = path_of(found, below);
    if (!plain) return plain.error();
    out.members.push_back({name, std::move(*plain)});
  }
  if (out.members.empty() && left_out > 0) {
    return refused(path, "matches only links that are dangling or lead out of the data root");
  }
  if (out.members.empty()) {
    return make_error(ErrorKind::not_found, in_quotes(path) + ": no file matches");
  }
  std::sort(out.members.begin(), out.members.end(),
            [](const auto& a, const auto& b) { return comes_before(a.name, b.name); });
  return out;
}

Result<Location> find_plain(int top, const std::string& root, const std::string& path) {
  const Descriptor found(beneath::open(top, path, O_PATH));
  if (found) return located(found, path);
  const int reason = errno;
  if (reason == ENOENT && has_wildcard(fs::path(path).filename().native())) {
    return series(top, root, path);
  }
  return not_reached(path, reason);
}

// "path#/group" denotes a group unless a file has this name.
Result<Location> find_inside(int top, const std::string& root, const std::string& path) {
  const auto mark = path.rfind("#/");
  if (mark == std::string::npos || mark == 0 || Descriptor(beneath::open(top, path, O_PATH))) {
    return find_plain(top, root, path);
  }
  auto out = find_plain(top, root, path.substr(0, mark));
  if (!out) return out;
  if (out->kind == Location::Kind::folder) {
    return refused(path, "names a group, which a folder does not have");
  }
  out->inside = path.substr(mark + 2);
  return out;
}

// "path?name=value" has a selection unless a file has this name.
Result<Location> find(int top, const std::string& root, const std::string& path) {
  const std::size_t mark = selection_mark(path);
  if (mark == std::string::npos || Descriptor(beneath::open(top, path, O_PATH))) {
    return find_inside(top, root, path);
  }
  auto selection = parse_selection(std::string_view(path).substr(mark + 1));
  if (!selection) return selection.error();
  auto out = find(top, root, path.substr(0, mark));
  if (!out) return out;
  if (!out->selection.empty()) return refused(path, "has two selections");
  out->selection = std::move(*selection);
  return out;
}

}  // namespace

Result<Location> locate_beneath(const std::string& root, const std::string& path_or_pattern) {
  const std::string& path = path_or_pattern;
  if (const auto ok = beneath::check_letters(path); !ok) return ok.error();
  const auto top = beneath::open_root(root);
  if (!top) return top.error();
  return find(top->number(), root, path);
}

}  // namespace windsplat::data
