// A loader that is a script, which may send any messages.
#pragma once

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <fstream>
#include <memory>
#include <numeric>
#include <string>

#include "server/data/loader/channel.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {

inline DatasetInfo sample_info() {
  DatasetInfo info;
  info.id = "sample";
  info.source = "sample.nc";
  info.digest = "0";
  for (std::size_t a = 0; a < 3; ++a) {
    info.grid.axes[a].name = "xyz"[a];
    info.grid.axes[a].coordinates = {0, 1};
  }
  FieldInfo wind;
  wind.name = "wind";
  wind.kind = FieldKind::vector;
  wind.components = {"u", "v"};
  wind.component_units = {"", ""};
  info.fields = {wind};
  info.steps = {{0, "0"}};
  return info;
}

class FaultyLoader : public testing::Test {
 protected:
  void SetUp() override {
    file_ = folder_ / "some.nc";
    std::ofstream(file_) << "never read";
    std::ofstream(folder_ / "info", std::ios::binary) << encode_info(sample_info());
    limits_.open_time = std::chrono::milliseconds(20'000);
    limits_.read_time = std::chrono::milliseconds(20'000);
  }
  void TearDown() override {
    set_program(WINDSPLAT_PROGRAM);
    EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
    EXPECT_EQ(errno, ECHILD);
  }

  void start_program(const std::string& script) {
    const std::string path = folder_ / "loader";
    std::ofstream(path) << script;
    ::chmod(path.c_str(), 0700);
    set_program(path);
  }

  // A script that implements the protocol; K is Kind.
  void respond_with(const std::string& what) {
    std::string script = "#!/usr/bin/env python3\n";
    script += "import array, mmap, os, socket, struct, sys, time\n";
    script += "s = socket.socket(fileno=3)\n";
    script += "names = 'open read descriptor names yes no ask_open ask_list ask_exists ";
    script += "ask_library progress opened filled failed ";
    script += "ask_bytes extent close_parts ask_parts expect part taken whole ";
    script += "unpack entries entry entry_bytes unpacked'.split()\n";
    script += "K = {name: i + 1 for i, name in enumerate(names)}\n";
    script += "def send(kind, payload=b''):\n";
    script += "    s.sendall(struct.pack('<IIQ', K[kind], 0, len(payload)) + payload)\n";
    script += "def receive():\n";
    script += "    head, more, _, _ = s.recvmsg(16, 64)\n";
    script += "    if not head: os._exit(0)\n";
    script += "    kind, _, size = struct.unpack('<IIQ', head)\n";
    script += "    payload = b''\n";
    script += "    while len(payload) < size: payload += s.recv(size - len(payload))\n";
    script += "    fds = array.array('i', b''.join(data for _, _, data in more))\n";
    script += "    return names[kind - 1], payload, fds[0] if fds else -1\n";
    script += "def ask(kind, name):\n";
    script += "    send(kind, name); return receive()[0]\n";
    script += "def fail(text):\n";
    script += "    text = text.encode(); send('failed', struct.pack('<BQ', 3, len(text)) + text)\n";
    script += "info = open('" + (folder_ / "info") + "', 'rb').read()\n";
    script += "def send_info():\n";
    script += "    send('opened', info); return receive()[2]\n";
    script += "def floats(*values): return struct.pack('<16f', *values)\n";
    script += "inf, nan = float('inf'), float('nan')\n";
    script += "first = receive()\n";
    start_program(script + what);
  }

  Result<std::unique_ptr<RemoteSource>> opened() {
    auto location = locate(file_);
    EXPECT_TRUE(location);
    return open(*location, limits_);
  }

  void expect_not_opened(const std::string& message) {
    const auto source = opened();
    ASSERT_FALSE(source);
    EXPECT_EQ(source.error().kind, ErrorKind::bad_data);
    EXPECT_EQ(source.error().message, message);
  }

  // Later messages are larger than the memory kept between reads.
  void describe_much() {
    DatasetInfo large = sample_info();
    large.grid.axes[0].coordinates.resize(5'000'000);
    std::iota(large.grid.axes[0].coordinates.begin(), large.grid.axes[0].coordinates.end(), 0);
    std::ofstream(folder_ / "info", std::ios::binary) << encode_info(large);
  }

  Result<Volume> read() {
    auto source = opened();
    if (!source) {
      ADD_FAILURE() << source.error().message;
      return source.error();
    }
    return (*source)->read(0, 0);
  }

  void expect_not_read(const std::string& message) {
    const auto volume = read();
    ASSERT_FALSE(volume);
    EXPECT_EQ(volume.error().kind, ErrorKind::bad_data);
    EXPECT_EQ(volume.error().message, message);
  }

  test::Folder folder_;
  std::string file_;
  Limits limits_;
};

}  // namespace windsplat::data::loader
