// Files of a host in this process that are fetched ahead of their reader.
#include "server/data/fetch/ahead.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace windsplat::data::fetch {
namespace {

using std::chrono::steady_clock;

// Sends parts of files of zeros; the tests hold its answers back, or have them fail.
class PartsHost {
 public:
  static constexpr std::uint64_t file_bytes = std::uint64_t{24} << 20;

  PartsHost() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof at;
    auto* const address = reinterpret_cast<sockaddr*>(&at);
    EXPECT_EQ(::bind(socket_.number(), address, length), 0);
    EXPECT_EQ(::listen(socket_.number(), 64), 0);
    EXPECT_EQ(::getsockname(socket_.number(), address, &length), 0);
    origin_ = "http://127.0.0.1:" + std::to_string(ntohs(at.sin_port));
    threads_.emplace_back([this] { accept_all(); });
  }
  ~PartsHost() {
    ends_ = true;
    for (std::size_t i = 0; i < threads_.size(); ++i) threads_[i].join();
  }
  PartsHost(const PartsHost&) = delete;
  PartsHost& operator=(const PartsHost&) = delete;

  [[nodiscard]] const std::string& origin() const { return origin_; }
  std::atomic<bool> holds = false;  // the answers
  std::atomic<bool> fails = false;  // with 500
  std::atomic<int> requests = 0;
  std::atomic<int> under_way = 0;
  std::atomic<int> most_under_way = 0;

 private:
  [[nodiscard]] bool is_readable(int file) const {
    while (!ends_) {
      pollfd wanted{file, POLLIN, 0};
      if (::poll(&wanted, 1, 20) > 0) return true;
    }
    return false;
  }
  void accept_all() {
    std::vector<std::thread> clients;
    while (is_readable(socket_.number())) {
      const int client = ::accept4(socket_.number(), nullptr, nullptr, SOCK_CLOEXEC);
      clients.emplace_back([this, client] { serve(Descriptor(client)); });
    }
    for (std::thread& one : clients) one.join();
  }
  void serve(const Descriptor& client) {
    std::string heard;
    std::array<char, 4096> bytes{};
    while (is_readable(client.number())) {
      const ssize_t got = ::read(client.number(), bytes.data(), bytes.size());
      if (got <= 0) return;
      heard.append(bytes.data(), static_cast<std::size_t>(got));
      if (!heard.ends_with("\r\n\r\n")) continue;
      ++requests;
      const int now = ++under_way;
      for (int most = most_under_way; now > most;) {
        if (most_under_way.compare_exchange_weak(most, now)) break;
      }
      while (holds && !ends_) std::this_thread::sleep_for(std::chrono::milliseconds(2));
      --under_way;
      const std::string answer = answer_to(heard);
      if (::send(client.number(), answer.data(), answer.size(), MSG_NOSIGNAL) < 0) return;
      heard.clear();
    }
  }
  [[nodiscard]] std::string answer_to(const std::string& request) const {
    if (fails) return "HTTP/1.1 500 No\r\nContent-Length: 0\r\n\r\n";
    unsigned long long first = 0;
    unsigned long long last = file_bytes - 1;
    const std::size_t range = request.find("bytes=");
    const bool is_part =
        range != std::string::npos &&
        std::sscanf(request.c_str() + range, "bytes=%llu-%llu", &first, &last) == 2;
    last = std::min<unsigned long long>(last, file_bytes - 1);
    const std::string count = std::to_string(last - first + 1);
    std::string out = is_part ? "HTTP/1.1 206 Part\r\nContent-Range: bytes " +
                                    std::to_string(first) + '-' + std::to_string(last) + '/' +
                                    std::to_string(file_bytes) + "\r\n"
                              : "HTTP/1.1 200 OK\r\n";
    out += "ETag: \"1\"\r\nContent-Length: " + count + "\r\n\r\n";
    return out.append(last - first + 1, '\0');
  }

  Descriptor socket_;
  std::string origin_;
  std::atomic<bool> ends_ = false;
  std::vector<std::thread> threads_;
};

class FetchedAhead : public testing::Test {
 protected:
  static constexpr std::uint64_t mib = std::uint64_t{1} << 20;

  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-ahead-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    make(256 * mib);
  }
  void TearDown() override {
    host_.holds = false;
    ahead_.reset();
    file_.reset();
    fetcher_.reset();
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  void make(std::uint64_t cache_bytes) {
    ahead_.reset();
    file_.reset();
    FetchOptions options;
    options.rules = HostRules::parse({host_.origin()}, true).value();
    options.limits.bytes_max = 1024 * mib;
    options.cache = {folder_, cache_bytes};
    fetcher_ = Fetcher::open(std::move(options)).value();
    auto opened = fetcher_->fetch(url(), Fetch::parts, {});
    ASSERT_TRUE(opened) << opened.error().message;
    file_ = opened->parts;
    ASSERT_TRUE(file_);
    ahead_ = std::make_unique<Ahead>(*fetcher_);
    host_.requests = 0;
  }
  [[nodiscard]] std::string url() const { return host_.origin() + "/a"; }
  void expect(const std::vector<Extent>& extents) {
    ahead_->expect(url(), file_, {.name = "a", .in_parts = true, .extents = extents});
  }
  [[nodiscard]] auto read(std::uint64_t offset, std::uint64_t count) {
    return fetcher_->fetch_part(url(), *file_, offset, count, {});
  }
  static bool await(const std::function<bool()>& is_so) {
    const auto end = steady_clock::now() + std::chrono::seconds(20);
    while (!is_so() && steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    return is_so();
  }
  // Until at least `count` requests are made and no others follow.
  void settle(int count = 0) {
    EXPECT_TRUE(await([&] { return host_.requests >= count; }));
    for (int before = -1; before != host_.requests;) {
      before = host_.requests;
      std::this_thread::sleep_for(std::chrono::milliseconds(150));
    }
  }

  PartsHost host_;
  std::string folder_;
  std::unique_ptr<Fetcher> fetcher_;
  std::shared_ptr<SparseFile> file_;
  std::unique_ptr<Ahead> ahead_;
};

TEST_F(FetchedAhead, ExtentsAreFetchedByEightRequestsAtATime) {
  host_.holds = true;
  expect({{mib, 20 * mib}});
  EXPECT_TRUE(await([&] { return host_.under_way == 8; }));
  settle();
  EXPECT_EQ(host_.requests, 8);
  host_.holds = false;
  EXPECT_TRUE(await([&] { return file_->is_present({mib, 20 * mib}); }));
  EXPECT_EQ(host_.most_under_way, 8);
  EXPECT_EQ(fetcher_->ahead_limits().unread_bytes, 19 * mib);
  ahead_->note_read(*file_, {0, 24 * mib});
  EXPECT_EQ(fetcher_->ahead_limits().unread_bytes, 0);
}

TEST_F(FetchedAhead, ExtentsOutsideOfTheFileAreIgnored) {
  constexpr std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
  constexpr std::uint64_t end = PartsHost::file_bytes;
  expect({{most - 1, most}, {0, most}, {end - 1, end + 1}, {mib + 1, mib + 1}, {9 * mib, mib}});
  ahead_->expect(url(), file_, {.name = "a", .in_parts = true, .tail_bytes = most});
  settle();
  EXPECT_EQ(host_.requests, 0);
}

TEST_F(FetchedAhead, AFloodIsFetchedAsFarAsTheWindowOnly) {
  fetcher_->ahead_limits().bytes_max = 8 * mib;
  for (int i = 0; i < 20'000; ++i) expect({{mib, 20 * mib}});
  settle(8);
  EXPECT_EQ(host_.requests, 8);
  for (int i = 0; i < 20'000; ++i) {
    ahead_->expect(host_.origin() + '/' + std::to_string(i), nullptr, {.name = "b"});
  }
  settle();
  EXPECT_EQ(host_.requests, 8);
}

TEST_F(FetchedAhead, TheWindowIsOfAllDatasets) {
  make(32 * mib);
  Ahead other(*fetcher_);
  expect({{mib, 12 * mib}});
  settle(8);
  other.expect(url(), file_, {.name = "a", .in_parts = true, .extents = {{12 * mib, 20 * mib}}});
  settle();
  EXPECT_EQ(host_.requests, 8);
  ahead_->forget();
  EXPECT_EQ(fetcher_->ahead_limits().unread_bytes, 0);
}

TEST_F(FetchedAhead, WholeFilesAreFetchedAsFarAsTheWindowOnly) {
  host_.holds = true;
  fetcher_->ahead_limits().bytes_max = 3 * PartsHost::file_bytes;
  fetcher_->ahead_limits().file_bytes_max = PartsHost::file_bytes;
  const auto url_of = [&](int n) { return host_.origin() + '/' + std::to_string(n); };
  for (int n = 0; n < 10; ++n) ahead_->expect(url_of(n), nullptr, {.name = "b"});
  settle(3);
  EXPECT_EQ(host_.requests, 3);
  host_.holds = false;
  EXPECT_TRUE(ahead_->take(url_of(0), {}));
  settle(4);
  EXPECT_EQ(host_.requests, 4) << "what is not read is not left out";
}

TEST_F(FetchedAhead, LargeFilesAreLeftToTheReaderOnceOneWasSeen) {
  fetcher_->ahead_limits().file_bytes_max = mib;
  ahead_->expect(host_.origin() + "/large", nullptr, {.name = "b"});
  ASSERT_TRUE(await([&] { return host_.requests == 1; }));
  EXPECT_FALSE(ahead_->take(host_.origin() + "/large", {}));
  for (int call = 0; call < 2; ++call) {
    for (int n = 0; n < 20; ++n) {
      ahead_->expect(host_.origin() + '/' + std::to_string(n), nullptr, {.name = "b"});
    }
    settle();
    EXPECT_EQ(host_.requests, 1);
    ahead_->forget();
  }
}

TEST_F(FetchedAhead, AFileOfMoreThanTheWindowIsLeftToItsReader) {
  make(32 * mib);
  const std::string whole = host_.origin() + "/whole";
  ahead_->expect(whole, nullptr, {.name = "whole"});
  ASSERT_TRUE(await([&] { return host_.requests == 1; }));
  const auto taken = ahead_->take(whole, {});
  EXPECT_FALSE(taken);
  EXPECT_TRUE(fetcher_->fetch(whole, Fetch::whole, {}));
}

TEST_F(FetchedAhead, ClosingEndsTheRequestsThatAreHeld) {
  host_.holds = true;
  expect({{mib, 20 * mib}});
  ahead_->expect(host_.origin() + "/b", nullptr, {.name = "b", .in_parts = true});
  ASSERT_TRUE(await([&] { return host_.under_way == 8; }));
  const auto begin = steady_clock::now();
  ahead_.reset();
  EXPECT_LT(steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_EQ(fetcher_->ahead_limits().threads, 0);
  EXPECT_EQ(fetcher_->ahead_limits().unread_bytes, 0);
}

TEST_F(FetchedAhead, AReaderIsNotHeldUpByRequestsForOtherBlocks) {
  host_.holds = true;
  expect({{mib, 20 * mib}});
  ASSERT_TRUE(await([&] { return host_.under_way == 8; }));
  std::thread reader([&] { EXPECT_TRUE(read(22 * mib, 10)); });
  EXPECT_TRUE(await([&] { return host_.under_way == 9; }));
  host_.holds = false;
  reader.join();
}

TEST_F(FetchedAhead, AFailureIsNotThatOfTheReader) {
  host_.fails = true;
  expect({{mib, 2 * mib}});
  EXPECT_TRUE(await([&] { return host_.requests > 0 && fetcher_->ahead_limits().threads == 0; }));
  EXPECT_EQ(fetcher_->ahead_limits().unread_bytes, 0);
  host_.fails = false;
  EXPECT_TRUE(read(mib, mib));
}

TEST_F(FetchedAhead, AReaderWhoseRequestWasForgottenAsksAgain) {
  host_.holds = true;
  expect({{mib, 2 * mib}});
  ASSERT_TRUE(await([&] { return host_.under_way == 1; }));
  std::thread reader([&] { EXPECT_TRUE(read(mib, mib)); });
  ahead_->forget();
  EXPECT_TRUE(await([&] { return host_.requests == 2; }));
  host_.holds = false;
  reader.join();
}

TEST_F(FetchedAhead, AFullCacheGivesWayToTheReader) {
  expect({{mib, 20 * mib}});
  ASSERT_TRUE(await([&] { return host_.requests > 0; }));
  EXPECT_TRUE(ahead_->give_way());
  EXPECT_EQ(fetcher_->ahead_limits().unread_bytes, 0);
  settle();
  const int before = host_.requests;
  expect({{20 * mib, 24 * mib}});
  settle();
  EXPECT_EQ(host_.requests, before) << "nothing more is fetched ahead";
  EXPECT_FALSE(ahead_->give_way());
  ahead_->forget();
  expect({{20 * mib, 24 * mib}});
  EXPECT_TRUE(await([&] { return file_->is_present({20 * mib, 24 * mib}); }));
}

}  // namespace
}  // namespace windsplat::data::fetch
