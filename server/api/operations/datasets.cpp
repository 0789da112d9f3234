// Files, datasets, and the jobs that open them.
#include "server/api/operations/operations.hpp"
#include "server/api/operations/parameters.hpp"

namespace windsplat::api::operations {
namespace {

constexpr std::string_view datasets_group = "Datasets";
constexpr std::string_view jobs_group = "Jobs";

}  // namespace

Operation list_files() {
  return {.id = "listFiles",
          .group = datasets_group,
          .summary = "What can be opened in a folder below the data root",
          .query = {parameters::folder, parameters::after, parameters::limit},
          .answers = {json_answer("One page of names.", "folder"),
                      nothing("The server has no data root.")},
          .problems = {404, 422}};
}

Operation list_datasets() {
  return {.id = "listDatasets",
          .group = datasets_group,
          .summary = "The datasets, without steps and axes",
          .answers = {json_answer("The list.", "datasets")}};
}

Operation open_dataset() {
  return {.id = "openDataset",
          .group = datasets_group,
          .summary = "Open files, a URL, or other entries of a listed dataset, in a job",
          .description = "The result of the job is the id of the dataset.",
          .body = RequestBody{"datasetRequest", {json_media}, "What is opened."},
          .answers = {job_answer()},
          .problems = {404, 422, 507}};
}

Operation describe_dataset() {
  return {.id = "describeDataset",
          .group = datasets_group,
          .summary = "Fields, axes, steps and default view of a dataset",
          .answers = {json_answer("The description.", "dataset")},
          .problems = {404, 422, 507}};
}

Operation release_dataset() {
  return {.id = "releaseDataset",
          .group = datasets_group,
          .summary = "Release the memory of a dataset, or forget it",
          .query = {parameters::forget},
          .answers = {nothing("Done.")},
          .problems = {404}};
}

Operation list_jobs() {
  return {.id = "listJobs",
          .group = jobs_group,
          .summary = "The jobs, oldest first",
          .answers = {json_answer("The list.", "jobs")}};
}

Operation read_job() {
  return {.id = "readJob",
          .group = jobs_group,
          .summary = "State and result of a job",
          .answers = {json_answer("The job.", "job")},
          .problems = {404}};
}

Operation cancel_job() {
  return {.id = "cancelJob",
          .group = jobs_group,
          .summary = "Cancel a job",
          .answers = {nothing("It is cancelled, or was finished.")},
          .problems = {404}};
}

}  // namespace windsplat::api::operations
