#include "server/data/resident/watched_files.hpp"

#include <algorithm>
#include <utility>

#include "server/data/files/locate_parts.hpp"

namespace windsplat::data {

namespace {

// Number of files whose modification times are read in one scan; for a longer series, the newest.
constexpr std::size_t files_watched_max = 64;

}  // namespace

FileStamp stamp_of_all(const Location& location, const std::vector<Companion>& companions) {
  if (location.fetched) return {"fetched", 0};
  std::vector<std::string> paths;
  if (location.kind == Location::Kind::folder) {
    for (const char* part : {"", "/.zmetadata", "/.zattrs", "/.zgroup"}) {
      paths.push_back(location.folder + part);
    }
  }
  const std::size_t count = location.members.size();
  for (std::size_t i = count - std::min(count, files_watched_max); i < count; ++i) {
    paths.push_back(location.members[i].path);
  }
  for (const Companion& companion : companions) paths.push_back(companion.path);
  FileStamp out;
  out.text = std::to_string(count);
  for (const std::string& path : paths) {
    const FileStamp one = stamp_of(path);
    out.text += ';' + one.text;
    out.changed_s = std::max(out.changed_s, one.changed_s);
  }
  return out;
}

std::string stamp_as_opened(FileStamp before, const std::vector<Companion>& companions) {
  for (const Companion& companion : companions) before.text += ';' + companion.stamp.text;
  return std::move(before.text);
}

bool match_again(std::optional<Location>& location, std::string& listed) {
  if (location->kind != Location::Kind::series) return false;
  std::string now = stamp_of(location->folder).text;
  if (now == listed) return false;
  if (auto again = locate_again(*location)) location = std::move(*again);
  listed = std::move(now);
  return true;
}

std::string key_of(const Location& location) {
  std::string key = std::to_string(static_cast<int>(location.kind)) + location.folder + '#' +
                    location.inside + '?' + selection_text(location.selection) + location.list;
  for (const Location::Member& member : location.members) {
    key += location.service ? "\nservice " : "\n";
    key += member.path;
  }
  return key;
}

}  // namespace windsplat::data
