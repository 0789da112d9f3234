// A folder below the data root -> JSON.
#include <utility>

#include "protocol/codec_json.hpp"
#include "protocol/folder.hpp"

namespace windsplat::protocol {
namespace {

Json null_if_empty(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

}  // namespace

std::string encode_folder(const FolderDescription& folder) {
  Json entries = Json::array();
  for (const FolderDescription::Entry& entry : folder.entries) {
    entries.push_back({{"name", entry.name},
                       {"kind", entry.is_folder ? "folder" : "file"},
                       {"bytes", entry.is_folder ? Json(nullptr) : Json(entry.bytes)},
                       {"format", null_if_empty(entry.format)}});
  }
  Json groups = Json::array();
  for (const FolderDescription::Group& group : folder.groups) {
    groups.push_back({{"pattern", group.pattern}, {"files", group.files}});
  }
  return dump(Json{{"folder", folder.folder},
                   {"entries", std::move(entries)},
                   {"groups", std::move(groups)},
                   {"next", null_if_empty(folder.next)},
                   {"omitted", folder.omitted},
                   {"cut", folder.cut}});
}

}  // namespace windsplat::protocol
