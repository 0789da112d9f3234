// A folder below the data root -> JSON.
#include <utility>

#include "protocol/codec_json.hpp"
#include "protocol/folder.hpp"

namespace windsplat::protocol {
namespace {

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

}  // namespace

std::string encode_folder(const FolderDescription& folder) {
  Json entries = Json::array();
  for (const FolderDescription::Entry& entry : folder.entries) {
    entries.push_back({{"name", entry.name},
                       {"kind", entry.is_folder ? "folder" : "file"},
                       {"bytes", entry.is_folder ? Json(nullptr) : Json(entry.bytes)},
                       {"format", text_or_null(entry.format)}});
  }
  Json groups = Json::array();
  for (const FolderDescription::Group& group : folder.groups) {
    groups.push_back({{"pattern", group.pattern}, {"files", group.files}});
  }
  return dump(Json{{"folder", folder.folder},
                   {"entries", std::move(entries)},
                   {"groups", std::move(groups)},
                   {"next", text_or_null(folder.next)},
                   {"omitted", folder.omitted},
                   {"cut", folder.cut}});
}

}  // namespace windsplat::protocol
