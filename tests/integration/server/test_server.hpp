// A server in this process on a free port, with one small dataset of a few steps: "small".
#pragma once

#include <gtest/gtest.h>
#include <turbojpeg.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "server/data/formats/netcdf/writer.hpp"
#include "server/data/resident/store.hpp"
#include "server/data/samples/samples.hpp"
#include "server/transport/server.hpp"
#include "tests/integration/client.hpp"

namespace server_test {

using Json = nlohmann::json;

inline Json json_of(const Answer& answer) { return Json::parse(answer.body, nullptr, false); }

// Waits until a condition holds, for up to a minute.
inline bool comes_true(const std::function<bool()>& holds) {
  for (int turn = 0; turn < 6000; ++turn) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

inline constexpr int small_steps = 3;

// A file that exists during the tests.
inline const std::string& small_file() {
  struct Made {
    std::filesystem::path folder;
    std::string file;
    Made() {
      std::string name = (std::filesystem::temp_directory_path() / "windsplat-net-XXXXXX").string();
      if (mkdtemp(name.data()) == nullptr) return;
      folder = name;
      file = name + "/small.nc";
      auto source = windsplat::data::open_sample("climate", {32, 16, 6}, small_steps);
      if (!source || !windsplat::data::write_netcdf(**source, file)) file.clear();
    }
    ~Made() {
      std::error_code ignored;
      if (!folder.empty()) std::filesystem::remove_all(folder, ignored);
    }
    Made(const Made&) = delete;
    Made& operator=(const Made&) = delete;
  };
  static const Made made;
  return made.file;
}

class TestServer {
 public:
  // `open`: opens files; by default in this process.
  explicit TestServer(windsplat::api::ServerOptions options = {},
                      decltype(windsplat::data::StoreOptions::open) open = {},
                      std::uint64_t bytes_max = std::uint64_t{1} << 30) {
    options.listen.front().port = 0;
    store_ = std::make_shared<windsplat::data::Store>(windsplat::data::StoreOptions{
        bytes_max, windsplat::data::Storage::float32, std::move(open)});
    const auto added = store_->add(small_file());
    EXPECT_TRUE(added) << (added ? "" : added.error().message);
    server_ = std::make_unique<windsplat::transport::Server>(
        std::move(options), store_, std::make_shared<windsplat::ThreadPool>(2));
    const auto bound = server_->listen();
    EXPECT_TRUE(bound) << (bound ? "" : bound.error().message);
    thread_ = std::thread([this] { server_->run(); });
  }
  ~TestServer() { stop(); }
  TestServer(const TestServer&) = delete;
  TestServer& operator=(const TestServer&) = delete;

  // Drains and waits until run() has returned.
  void stop() {
    if (!thread_.joinable()) return;
    server_->drain();
    thread_.join();
  }

  [[nodiscard]] std::uint16_t port() const { return server_->port(); }
  windsplat::transport::Server& server() { return *server_; }
  [[nodiscard]] windsplat::data::Store& store() const { return *store_; }
  [[nodiscard]] std::uint64_t loads() const { return store_->find("small").value()->loads(); }

 private:
  std::shared_ptr<windsplat::data::Store> store_;
  std::unique_ptr<windsplat::transport::Server> server_;
  std::thread thread_;
};

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<unsigned char> rgb;

  // Number of pixels that differ from the first one by more than JPEG noise.
  [[nodiscard]] std::size_t distinct() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i + 2 < rgb.size(); i += 3) {
      int far = 0;
      for (std::size_t c = 0; c < 3; ++c) far = std::max(far, std::abs(rgb[i + c] - rgb[c]));
      count += far > 24 ? 1U : 0U;
    }
    return count;
  }
};

inline Picture decode_jpeg(const std::string& bytes) {
  Picture picture;
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  const tjhandle handle = tjInitDecompress();
  int subsampling = 0;
  int colorspace = 0;
  if (tjDecompressHeader3(handle, data, bytes.size(), &picture.width, &picture.height, &subsampling,
                          &colorspace) == 0) {
    picture.rgb.resize(std::size_t{3} * static_cast<std::size_t>(picture.width) *
                       static_cast<std::size_t>(picture.height));
    if (tjDecompress2(handle, data, bytes.size(), picture.rgb.data(), picture.width, 0,
                      picture.height, TJPF_RGB, 0) != 0) {
      picture.rgb.clear();
    }
  }
  tjDestroy(handle);
  return picture;
}

}  // namespace server_test
