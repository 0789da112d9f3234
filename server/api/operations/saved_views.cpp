// Views that the server keeps.
#include "server/api/operations/operations.hpp"

namespace windsplat::api::operations {
namespace {

constexpr std::string_view saved_views_group = "Saved views";
constexpr std::string_view preconditions =
    "If-Match and If-None-Match are honoured (RFC 9110): 412 if they do not hold.";

Answer saved(int status, std::string_view summary) {
  return {status, summary, "savedView", {json_media}, {"ETag"}};
}

}  // namespace

Operation save_view() {
  Answer answer = saved(201, "The saved view.");
  answer.headers.emplace_back("Location");
  return {.id = "saveView",
          .group = saved_views_group,
          .summary = "Save a view",
          .body = view_body("The view."),
          .answers = {answer},
          .problems = {422, 507}};
}

Operation read_view() {
  return {.id = "readView",
          .group = saved_views_group,
          .summary = "A saved view",
          .answers = {saved(200, "The saved view."), not_modified()},
          .problems = {404}};
}

Operation replace_view() {
  return {.id = "replaceView",
          .group = saved_views_group,
          .summary = "Replace a saved view",
          .description = preconditions,
          .body = view_body("The view."),
          .answers = {saved(200, "The view that is saved now.")},
          .problems = {404, 412, 422, 507}};
}

Operation patch_view() {
  return {.id = "patchView",
          .group = saved_views_group,
          .summary = "Change a saved view by a merge patch (RFC 7396)",
          .description = preconditions,
          .body = RequestBody{"object",
                              {"application/merge-patch+json", json_media},
                              "The changes; null restores a default."},
          .answers = {saved(200, "The view that is saved now.")},
          .problems = {404, 412, 422, 507}};
}

Operation remove_view() {
  return {.id = "removeView",
          .group = saved_views_group,
          .summary = "Remove a saved view",
          .description = preconditions,
          .answers = {nothing("It is removed.")},
          .problems = {404, 412, 507}};
}

}  // namespace windsplat::api::operations
