// Other entries of the dimensions of an open dataset: members of an ensemble chosen over REST.
#include <gtest/gtest.h>
#include <netcdf.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "tests/integration/server/opening.hpp"

namespace server_test {
namespace {

using namespace windsplat;  // NOLINT(google-build-using-namespace)
namespace fs = std::filesystem;

Answer post_entries(std::uint16_t port, const std::string& from, const Json& selection) {
  return request(port, "POST", "/v1/datasets", {{"Content-Type", "application/json"}},
                 Json{{"from", from}, {"selection", selection}}.dump());
}

constexpr std::size_t members = 20;

// Members 0, 1, 2, 5, 6 and so on, whose values are their numbers.
void write_members(const fs::path& path) {
  int file = 0;
  ASSERT_EQ(nc_create(path.c_str(), NC_NETCDF4, &file), NC_NOERR);
  const std::array<std::size_t, 4> lengths{members, 2, 2, 2};
  const std::array<const char*, 4> names{"number", "z", "y", "x"};
  std::array<int, 4> dims{};
  for (std::size_t d = 0; d < 4; ++d) {
    ASSERT_EQ(nc_def_dim(file, names.at(d), lengths.at(d), &dims.at(d)), NC_NOERR);
  }
  int number = 0;
  int value = 0;
  ASSERT_EQ(nc_def_var(file, "number", NC_INT, 1, dims.data(), &number), NC_NOERR);
  ASSERT_EQ(nc_def_var(file, "t", NC_FLOAT, 4, dims.data(), &value), NC_NOERR);
  std::array<int, members> numbers{};
  for (std::size_t n = 0; n < members; ++n) numbers.at(n) = static_cast<int>(n < 3 ? n : n + 2);
  ASSERT_EQ(nc_put_var_int(file, number, numbers.data()), NC_NOERR);
  std::array<float, 8 * members> values{};
  for (std::size_t n = 0; n < values.size(); ++n)
    values.at(n) = static_cast<float>(numbers.at(n / 8));
  ASSERT_EQ(nc_put_var_float(file, value, values.data()), NC_NOERR);
  ASSERT_EQ(nc_close(file), NC_NOERR);
}

class ChosenEntries : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-entries-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    write_members(root_ / "e.nc");
  }
  void TearDown() override { fs::remove_all(root_); }

  static Json value_in(std::uint16_t port, const std::string& id) {
    const Answer answer = get(port, "/v1/datasets/" + id + "/probe?x=0&y=0&z=0");
    EXPECT_EQ(answer.status, 200) << answer.body;
    return answer.status == 200 ? json_of(answer)["values"]["t"]["value"] : Json();
  }
  static Json chosen(std::uint16_t port, const std::string& from, const Json& selection) {
    const Answer answer = post_entries(port, from, selection);
    EXPECT_EQ(answer.status, 202) << answer.body;
    return finished_job(port, json_of(answer)["id"].get<std::string>());
  }

  fs::path root_;
};

TEST_F(ChosenEntries, AnOpenDatasetLeadsToItsOtherEntriesWithoutADataRoot) {
  TestServer server(api::ServerOptions{});
  const std::uint16_t port = server.port();
  ASSERT_TRUE(server.store().add((root_ / "e.nc").native()));
  EXPECT_EQ(value_in(port, "e"), 0);
  EXPECT_EQ(chosen(port, "e", {{"number", 5}})["result"], "e,number=5");
  EXPECT_EQ(value_in(port, "e,number=5"), 5);
  EXPECT_EQ(json_of(get(port, "/v1/datasets/e,number=5"))["choices"][0]["chosen"], "5");
  EXPECT_EQ(chosen(port, "e,number=5", {{"number", "1"}})["result"], "e,number=1");
  EXPECT_EQ(value_in(port, "e,number=1"), 1);
  EXPECT_EQ(chosen(port, "e,number=1", {{"number", 0}})["result"], "e")
      << "the entry that is shown already";
  EXPECT_EQ(request(port, "DELETE", "/v1/datasets/e,number=1?forget=true").status, 204);
  EXPECT_EQ(get(port, "/v1/datasets").body.find(root_.native()), std::string::npos)
      << "no path leaves the server";
}

TEST_F(ChosenEntries, WhatDoesNotExistIsRefused) {
  TestServer server(api::ServerOptions{});
  const std::uint16_t port = server.port();
  ASSERT_TRUE(server.store().add((root_ / "e.nc").native()));
  EXPECT_EQ(post_entries(port, "f", {{"number", 5}}).status, 404);
  const Answer other = post_entries(port, "e", {{"member", 5}});
  EXPECT_EQ(other.status, 422);
  EXPECT_NE(other.body.find("these are 'number'"), std::string::npos) << other.body;
  const Answer plain = post_entries(port, "small", {{"number", 5}});
  EXPECT_EQ(plain.status, 422) << plain.body;
  const Json absent = chosen(port, "e", {{"number", 3}});
  EXPECT_EQ(absent["state"], "failed");
  EXPECT_NE(absent.dump().find("has no entry '3': it has 20 entries (0 .. 21)"), std::string::npos)
      << absent;
  EXPECT_EQ(get(port, "/v1/datasets/e,number=3").status, 404);
}

TEST_F(ChosenEntries, APostedListOfFilesIsADatasetBelowTheDataRoot) {
  TestServer server(with_root(root_));
  const std::uint16_t port = server.port();
  const auto post = [&](const Json& list) {
    return request(port, "POST", "/v1/datasets", {{"Content-Type", "application/json"}},
                   list.dump());
  };
  const auto job = [&](const Json& list) {
    return finished_job(port, json_of(post(list))["id"].get<std::string>());
  };
  const Json list{{"title", "Ens"}, {"files", {"e.nc"}}, {"selection", {{"number", 2}}}};
  EXPECT_EQ(job(list)["result"], "e");
  EXPECT_EQ(value_in(port, "e"), 2);
  EXPECT_EQ(json_of(get(port, "/v1/datasets/e"))["title"], "Ens (number=2)");
  EXPECT_EQ(job(list)["result"], "e") << "the same list is the same dataset";
  EXPECT_EQ(chosen(port, "e", {{"number", 5}})["result"], "e,number=5");
  EXPECT_EQ(value_in(port, "e,number=5"), 5);
  const Answer outside = post({{"files", {"../e.nc"}}});
  EXPECT_EQ(outside.status, 422) << "at once, not by a job that fails";
  EXPECT_EQ(json_of(outside)["errors"][0]["pointer"], "/files/0") << outside.body;
  EXPECT_EQ(post({{"files", 3}}).status, 422);
  std::ofstream(root_ / "l.json") << R"({"windsplat": "files", "files": ["e.nc"]})";
  EXPECT_EQ(finished_job(port, post_file(port, "l.json?number=1"))["result"], "l,number=1");
  EXPECT_EQ(value_in(port, "l,number=1"), 1);
  TestServer closed(api::ServerOptions{});
  EXPECT_EQ(request(closed.port(), "POST", "/v1/datasets", {{"Content-Type", "application/json"}},
                    list.dump())
                .status,
            403);
}

TEST_F(ChosenEntries, BeyondSixteenTheOneUnusedLongestIsClosedButNoneThatASessionShows) {
  TestServer server(api::ServerOptions{});
  const std::uint16_t port = server.port();
  ASSERT_TRUE(server.store().add((root_ / "e.nc").native()));
  const auto status_of = [&](int number) {
    return get(port, "/v1/datasets/e,number=" + std::to_string(number)).status;
  };
  ASSERT_EQ(chosen(port, "e", {{"number", 1}})["result"], "e,number=1");
  StreamClient viewer(port, {{"Sec-WebSocket-Protocol", "windsplat.v1"}});
  viewer.say(R"({"type":"patch","rev":1,"t":1,"patch":{"dataset":"e,number=1",
      "image":{"width":32,"height":24}}})");
  ASSERT_TRUE(viewer.next_frame());
  ASSERT_EQ(chosen(port, "e", {{"number", 2}})["result"], "e,number=2");
  for (int number = 5; number < 19; ++number) {
    ASSERT_EQ(chosen(port, "e", {{"number", number}})["state"], "done") << number;
  }
  ASSERT_EQ(chosen(port, "e", {{"number", 3}})["state"], "failed");
  EXPECT_EQ(status_of(2), 200) << "an entry that does not exist closes no other";
  // The request named it last, so that it would be kept.
  for (int number = 5; number < 19; ++number) ASSERT_EQ(status_of(number), 200);
  ASSERT_EQ(chosen(port, "e", {{"number", 19}})["state"], "done");
  EXPECT_EQ(status_of(2), 404) << "closed for the seventeenth";
  EXPECT_NE(get(port, "/v1/datasets/e,number=2").body.find("was closed"), std::string::npos);
  EXPECT_EQ(status_of(1), 200) << "the session shows it";
  EXPECT_EQ(status_of(5), 200);
  EXPECT_EQ(get(port, "/v1/datasets/e").status, 200) << "it was not chosen";
}

TEST_F(ChosenEntries, FixedEntriesAreNotLeft) {
  api::ServerOptions options = with_root(root_);
  options.fixed_entries = true;
  TestServer server(options);
  const std::uint16_t port = server.port();
  ASSERT_EQ(finished_job(port, post_file(port, "e.nc?number=5"))["state"], "done");
  const Answer refused = post_entries(port, "e,number=5", {{"number", 1}});
  EXPECT_EQ(refused.status, 403);
  EXPECT_NE(refused.body.find("--fixed-entries"), std::string::npos) << refused.body;
}

}  // namespace
}  // namespace server_test
