// Saved views: create, read, change and delete. Changes run on a separate thread, because they may
// wait for a disk.
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "protocol/saved_view.hpp"
#include "protocol/utc_time.hpp"
#include "server/api/resources.hpp"
#include "server/http/gzip.hpp"
#include "server/http/negotiate.hpp"
#include "server/http/problem.hpp"

namespace windsplat::api {
namespace {

using protocol::SavedView;
using protocol::ViewDocument;
using views::SavedViews;

std::string text_of(const SavedViews& views, const SavedView& saved) {
  return protocol::encode_saved_view(saved, views.on_disk() ? "disk" : "memory");
}

http::Response saved_response(const SavedViews& views, const SavedView& saved) {
  std::string text = text_of(views, saved);
  const std::string etag = etag_of(text);
  http::Response response = json_response(std::move(text));
  response.headers = {{"Cache-Control", "no-cache"}, {"ETag", etag}};
  return response;
}

// Whether the saved view satisfies If-Match and If-None-Match (RFC 9110, 13.1).
struct Unchanged {
  Unchanged(const SavedViews& of, const http::Request& request)
      : views(of),
        if_match(request.header("If-Match")),
        if_none_match(request.header("If-None-Match")) {}
  bool operator()(const SavedView& now) const {
    const std::string etag = etag_of(text_of(views, now));
    const std::string zipped = http::gzip_etag(etag);  // the client may have either form
    return (http::allows_change(if_match, etag) || http::allows_change(if_match, zipped)) &&
           (if_none_match.empty() || !(http::matches_etag(if_none_match, etag) ||
                                       http::matches_etag(if_none_match, zipped)));
  }

  const SavedViews& views;
  std::string if_match;
  std::string if_none_match;
};

http::Response changed_meanwhile() {
  return http::problem_response(
      412, "Precondition Failed",
      "the saved view does not satisfy If-Match or If-None-Match; read it again");
}

void replace_later(SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
                   const http::Request& request, http::Reply reply, SavedViews::Change change) {
  run_later(view_io, request, std::move(reply), "a change of a saved view", nullptr,
            [&views, id, may = Unchanged(views, request), change = std::move(change)] {
              const auto saved = views.replace(id, may, change);
              if (!saved) return http::problem_response(saved.error());
              return *saved ? saved_response(views, **saved) : changed_meanwhile();
            });
}

}  // namespace

void post_saved_view(SavedViews& views, tasks::TaskExecutor& view_io, const std::string& base_path,
                     const http::Request& request, http::Reply reply) {
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  auto view = ViewDocument::parse(request.body);
  if (!view) {
    reply(http::problem_response(view.error()));
    return;
  }
  run_later(view_io, request, std::move(reply), "saving a view", nullptr,
            [&views, &base_path, view = std::move(*view)] {
              const auto saved = views.add(view, protocol::utc_text(std::time(nullptr)));
              if (!saved) return http::problem_response(saved.error());
              http::Response response = saved_response(views, *saved);
              response.status = 201;
              response.headers.emplace_back("Location", base_path + "v1/views/" + saved->id);
              return response;
            });
}

http::Response get_view(const SavedViews& views, const std::string& id,
                        const http::Request& request) {
  const auto saved = views.find(id);
  if (!saved) return http::problem_response(saved.error());
  return tagged_response(request, "application/json", text_of(views, *saved));
}

void put_view(SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
              const http::Request& request, http::Reply reply) {
  if (!is_json(request.header("Content-Type"))) {
    reply(http::problem_response(415, "Unsupported Media Type",
                                 "Content-Type must be application/json"));
    return;
  }
  auto view = ViewDocument::parse(request.body);
  if (!view) {
    reply(http::problem_response(view.error()));
    return;
  }
  replace_later(views, view_io, id, request, std::move(reply),
                [view = std::move(*view)](const ViewDocument&) { return view; });
}

void patch_view(SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
                const http::Request& request, http::Reply reply) {
  const std::string type = request.header("Content-Type");
  if (!is_json(type) && !is_merge_patch(type)) {
    http::Response response = http::problem_response(
        415, "Unsupported Media Type", "Content-Type must be application/merge-patch+json");
    response.headers.emplace_back("Accept-Patch", "application/merge-patch+json, application/json");
    reply(std::move(response));
    return;
  }
  replace_later(views, view_io, id, request, std::move(reply),
                [patch = request.body](const ViewDocument& now) { return now.patched(patch); });
}

void delete_view(SavedViews& views, tasks::TaskExecutor& view_io, const std::string& id,
                 const http::Request& request, http::Reply reply) {
  run_later(view_io, request, std::move(reply), "removing a saved view", nullptr,
            [&views, id, may = Unchanged(views, request)]() -> http::Response {
              const auto removed = views.remove(id, may);
              if (!removed) return http::problem_response(removed.error());
              if (!*removed) return changed_meanwhile();
              return {204, "", {{"Cache-Control", "no-store"}}, {}};
            });
}

}  // namespace windsplat::api
