// Files of clients.
#include "server/api/operations/operations.hpp"
#include "server/api/operations/parameters.hpp"

namespace windsplat::api::operations {
namespace {

constexpr std::string_view uploads_group = "Uploads";

}  // namespace

Operation read_upload() {
  return {.id = "readUpload",
          .group = uploads_group,
          .summary = "Size, digest and end of an upload",
          .answers = {json_answer("The upload.", "upload")},
          .problems = {404}};
}

Operation upload_file() {
  Answer answer = json_answer("The upload is complete.", "upload");
  answer.status = 201;
  answer.headers.emplace_back("Location");
  return {.id = "uploadFile",
          .group = uploads_group,
          .summary = "Send a file",
          .description =
              "Content-Digest or Repr-Digest (RFC 9530, sha-256) is checked; Content-Encoding is "
              "refused.",
          .query = {parameters::keep},
          .body = RequestBody{{}, {"application/octet-stream"}, "The bytes of the file."},
          .answers = {answer},
          .problems = {404, 409, 422, 507}};
}

Operation remove_upload() {
  return {.id = "removeUpload",
          .group = uploads_group,
          .summary = "Remove an upload and the datasets opened from it",
          .answers = {nothing("It is removed.")},
          .problems = {404, 507}};
}

}  // namespace windsplat::api::operations
