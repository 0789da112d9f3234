// Uploads whose parts pass between the threads of network and disk: many at once, cut short, and at
// the end of the server. tests/integration/uploads.py has the rest.
#include "server/uploads/uploads.hpp"

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/integration/server/test_server.hpp"

namespace server_test {
namespace {

namespace fs = std::filesystem;
using windsplat::uploads::Uploads;

constexpr std::uint64_t quota_bytes = std::uint64_t{64} << 20;

class UploadThreads : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-uploads-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    root_ = name;
    auto uploads = Uploads::open({root_ / "uploads", quota_bytes});
    ASSERT_TRUE(uploads) << uploads.error().message;
    windsplat::api::ServerOptions options;
    options.uploads = std::move(*uploads);
    server_ = std::make_unique<TestServer>(std::move(options));
  }
  void TearDown() override {
    server_.reset();
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }

  [[nodiscard]] std::size_t files() const {
    std::size_t count = 0;
    for (const auto& entry : fs::recursive_directory_iterator(root_ / "uploads")) {
      count += entry.is_regular_file() ? 1 : 0;
    }
    return count;
  }
  [[nodiscard]] std::string content(const std::string& id) const {
    std::ifstream file(root_ / "uploads" / Uploads::path_of(id), std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::string head(const std::string& id, std::size_t bytes) {
    return "PUT /v1/uploads/" + id +
           " HTTP/1.1\r\nHost: localhost\r\nContent-Length: " + std::to_string(bytes) + "\r\n\r\n";
  }

  fs::path root_;
  std::unique_ptr<TestServer> server_;
};

TEST_F(UploadThreads, OneWhoseClientHasLeftIsDiscardedAtTheEnd) {
  const auto uploads = Uploads::open({root_ / "others", quota_bytes}).value();
  const auto into = uploads->begin({.id = "a.nc", .bytes = 1, .digest = {}, .address = "a"});
  ASSERT_TRUE(into) << into.error().message;
  ASSERT_TRUE((*into)->write(std::vector<std::byte>(1)));
  const windsplat::CancelToken cancel;
  cancel.cancel();
  const auto done = (*into)->finish(cancel);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, windsplat::ErrorKind::cancelled);
  EXPECT_FALSE(uploads->find("a.nc"));
  EXPECT_TRUE(uploads->begin({.id = "a.nc", .bytes = 1, .digest = {}, .address = "a"}));
}

std::string body_of(int seed, std::size_t bytes) {
  std::string out(bytes, '\0');
  auto state = static_cast<std::uint32_t>(seed * 2654435761U + 1U);
  for (char& c : out) {
    state = state * 1664525U + 1013904223U;
    c = static_cast<char>(state >> 24U);
  }
  return out;
}

TEST_F(UploadThreads, ThoseReceivedAtOnceAreWholeAndSeparate) {
  constexpr int count = 4;                  // of one address
  constexpr std::size_t bytes = 1'300'001;  // several parts, and a rest
  std::vector<std::thread> clients;
  std::vector<int> statuses(count);
  for (int n = 0; n < count; ++n) {
    clients.emplace_back([&, n] {
      statuses.at(static_cast<std::size_t>(n)) =
          request(server_->port(), "PUT", "/v1/uploads/" + std::to_string(n) + ".nc", {},
                  body_of(n, bytes))
              .status;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_THAT(statuses, testing::Each(201));
  for (int n = 0; n < count; ++n) {
    EXPECT_TRUE(content(std::to_string(n) + ".nc") == body_of(n, bytes)) << n;
  }
}

TEST_F(UploadThreads, ThoseCutShortLeaveNothing) {
  constexpr std::size_t bytes = 2'000'000;
  {
    std::vector<std::unique_ptr<Socket>> sockets;
    for (int n = 0; n < 3; ++n) {
      sockets.push_back(std::make_unique<Socket>(server_->port()));
      ASSERT_TRUE(sockets.back()->send(head("cut" + std::to_string(n) + ".nc", bytes)));
      ASSERT_TRUE(sockets.back()->send(body_of(n, bytes / 2)));
    }
    EXPECT_TRUE(comes_true([&] { return files() == 3; }));
  }
  EXPECT_TRUE(comes_true([&] { return files() == 0; }));
  EXPECT_EQ(get(server_->port(), "/v1/uploads/cut0.nc").status, 404);
  EXPECT_EQ(request(server_->port(), "PUT", "/v1/uploads/cut0.nc", {}, "x").status, 201)
      << "its id and its part of the quota are free again";
}

TEST_F(UploadThreads, TheServerEndsWhileOneIsReceived) {
  Socket socket(server_->port());
  ASSERT_TRUE(socket.send(head("late.nc", 1'000'000)));
  ASSERT_TRUE(socket.send(body_of(1, 600'000)));
  EXPECT_TRUE(comes_true([&] { return files() == 1; }));
  socket.half_close();
  server_->stop();
  server_.reset();
  EXPECT_FALSE(fs::exists(root_ / "uploads") && files() > 0);
}

}  // namespace
}  // namespace server_test
