// GET /v1/files: what can be opened below the data root.
#include <string>
#include <utility>

#include "protocol/folder.hpp"
#include "server/api/operations/parameters.hpp"
#include "server/api/resources.hpp"
#include "server/data/files/folder_list.hpp"
#include "server/data/open/content.hpp"
#include "server/http/problem.hpp"
#include "server/http/request_target.hpp"

namespace windsplat::api {
namespace {

constexpr int entries_default = 200;

struct Page {
  std::string folder;
  std::string after;
  int limit = entries_default;
};

Result<Page> page_of(const http::Request& request) {
  http::QueryReader query(request.query);
  Page page;
  page.folder = read_text(query, parameters::folder).value_or("");
  page.after = read_text(query, parameters::after).value_or("");
  page.limit = read_integer(query, parameters::limit).value_or(entries_default);
  if (const auto ok = query.finish(); !ok) return ok.error();
  while (page.folder.ends_with('/') && page.folder.size() > 1) page.folder.pop_back();
  return page;
}

http::Response listed(const std::string& root, const Page& page) {
  const data::FormatRules rules{data::format_of_file, data::folder_marks};
  auto list = data::list_beneath(root, page.folder, page.after,
                                 static_cast<std::size_t>(page.limit), rules);
  if (!list) return http::problem_response(list.error());
  protocol::FolderDescription told;
  told.folder = page.folder;
  told.next = std::move(list->next);
  told.omitted = list->omitted;
  told.cut = list->cut;
  for (data::FolderEntry& entry : list->entries) {
    told.entries.push_back(
        {std::move(entry.name), entry.is_folder, entry.bytes, std::move(entry.format)});
  }
  for (data::NameGroup& group : list->groups) {
    told.groups.push_back({std::move(group.pattern), group.files});
  }
  return json_response(protocol::encode_folder(told));
}

}  // namespace

void get_files(const ServerOptions& options, tasks::TaskExecutor& look_ups,
               const http::Request& request, http::Reply reply) {
  auto page = page_of(request);
  if (!page) {
    reply(http::problem_response(page.error()));
    return;
  }
  // No error: the page asks in order to know, and browsers report errors to their users.
  if (options.data_root.empty()) {
    reply({204, "", {{"Cache-Control", "no-store"}}, {}});
    return;
  }
  run_later(look_ups, request, std::move(reply), "a list of files", nullptr,
            [root = options.data_root, page = std::move(*page)] { return listed(root, page); });
}

}  // namespace windsplat::api
