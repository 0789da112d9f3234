// Opening datasets by POST: requests, and their jobs until they end.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "tests/integration/server/test_server.hpp"

namespace server_test {

inline windsplat::api::ServerOptions with_root(const std::filesystem::path& root) {
  windsplat::api::ServerOptions options;
  options.data_root = root.native();
  return options;
}

// Returns the id of the job.
inline std::string post_file(std::uint16_t port, const std::string& path) {
  const Answer answer =
      request(port, "POST", "/v1/datasets", {{"Content-Type", "application/json"}},
              Json{{"path", path}}.dump());
  EXPECT_EQ(answer.status, 202) << answer.body;
  return answer.status == 202 ? json_of(answer)["id"].get<std::string>() : "";
}

inline Json finished_job(std::uint16_t port, const std::string& id) {
  for (int i = 0; i < 6000; ++i) {
    Json job = json_of(get(port, "/v1/jobs/" + id));
    const auto state = job.value("state", "");
    if (state != "queued" && state != "running") return job;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  ADD_FAILURE() << "job " << id << " does not end";
  return {};
}

inline bool is_running(std::uint16_t port, const std::string& id) {
  for (int i = 0; i < 6000; ++i) {
    if (json_of(get(port, "/v1/jobs/" + id)).value("state", "") == "running") return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

}  // namespace server_test
