// Faulty or compromised loaders: scripts that implement the protocol on descriptor 3. For any
// messages the daemon gets an error or values that satisfy the invariants.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "server/data/loader/channel.hpp"
#include "server/data/loader/loader.hpp"
#include "server/data/loader/messages.hpp"
#include "tests/unit/data/netcdf_maker.hpp"

namespace windsplat::data::loader {
namespace {

using std::chrono::milliseconds;

DatasetInfo sample_info() {
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
    limits_.open_time = milliseconds(20'000);
    limits_.read_time = milliseconds(20'000);
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
    script += "ask_library progress opened filled failed'.split()\n";
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
    script += "receive()\n";
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

TEST_F(FaultyLoader, ValidAnswerIsAccepted) {
  respond_with(
      "fd = send_info()\nos.pwrite(fd, floats(*range(16)), "
      "0)\nos.close(fd)\nsend('filled')\nreceive()\n");
  const auto volume = read();
  ASSERT_TRUE(volume) << volume.error().message;
  ASSERT_EQ(volume->values.size(), 16U);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(volume->values[i], static_cast<float>(i));
  }
  EXPECT_EQ(volume->masked, 0);
  EXPECT_FLOAT_EQ(volume->range[0], 8.0F);
  EXPECT_FLOAT_EQ(volume->range[1], std::hypot(7.0F, 15.0F));
}

TEST_F(FaultyLoader, ExitIsAnError) {
  start_program("#!/bin/sh\nexit 7\n");
  expect_not_opened("the loader of 'some.nc' ended with code 7 while opening it");
}

TEST_F(FaultyLoader, EndlessLoopIsTerminated) {
  limits_.open_time = milliseconds(300);
  start_program("#!/bin/sh\nwhile :; do :; done\n");
  expect_not_opened("the loader of 'some.nc' was terminated after 0.3 s while opening it");
}

TEST_F(FaultyLoader, SingleByteMessagesAreRead) {
  limits_.open_time = milliseconds(700);
  respond_with("while True: s.send(b'\\x01\\0\\0\\0'[:1]); time.sleep(0.06)\n");
  expect_not_opened("the loader of 'some.nc' was terminated after 0.7 s while opening it");
}

TEST_F(FaultyLoader, MalformedMessagesAreRefused) {
  const std::string message =
      "the loader of 'some.nc' violated the protocol and was terminated while opening it";
  respond_with("s.sendall(b'x' * 1000)\nreceive()\n");
  expect_not_opened(message);
  respond_with("s.sendall(struct.pack('<IIQ', K['opened'], 0, 1 << 60))\nreceive()\n");
  expect_not_opened(message);
  respond_with("send('ask_open', b'x' * 70000)\nreceive()\n");
  expect_not_opened(message);
  respond_with("send('filled')\nreceive()\n");
  expect_not_opened(message);
  respond_with("send('progress', struct.pack('<d', nan))\nreceive()\n");
  expect_not_opened(message);
}

// A small expected amount limits the memory that is allocated.
TEST_F(FaultyLoader, TooManyMessagesAreRefused) {
  respond_with("send_info()\nsend('progress', b'x' * 100000)\nreceive()\n");
  expect_not_read(
      "the loader of 'some.nc' violated the protocol and was terminated while reading 'wind'");
}

// Memory written by a loader and not reused is freed when the loader exits.
TEST_F(FaultyLoader, FailingToFillMuchMemoryIsTerminated) {
  describe_much();
  respond_with("fd = send_info()\nos.pwrite(fd, b'x' * 1000, 0)\nfail('no')\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  const auto volume = (*source)->read(0, 0);
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().message, "no");
  EXPECT_EQ((*source)->process(), -1);
}

TEST_F(FaultyLoader, KeepingMuchMemoryMappedIsTerminated) {
  describe_much();
  respond_with("fd = send_info()\nm = mmap.mmap(fd, 4096)\nsend('filled')\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE((*source)->read(0, 0));
  EXPECT_EQ((*source)->process(), -1);
  respond_with("fd = send_info()\nos.close(fd)\nsend('filled')\nreceive()\n");
  source = opened();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE((*source)->read(0, 0));
  EXPECT_GT((*source)->process(), 0);
}

TEST_F(FaultyLoader, EndlessRequestsAreRefused) {
  limits_.opens_max = 100;
  respond_with("while True: ask('ask_exists', b'some.nc')\n");
  expect_not_opened(
      "the loader of 'some.nc' violated the protocol and was terminated while opening it");
}

TEST_F(FaultyLoader, RequestsForOtherFilesAreRefused) {
  std::ofstream(folder_ / "beside") << "private";
  limits_.library_folders = {folder_ / "tables"};
  std::filesystem::create_directories(folder_ / "tables");
  std::ofstream(folder_ / "tables/table") << "a table";
  std::filesystem::create_symlink(folder_ / "beside", folder_ / "tables/link");
  const std::string folder = folder_ / "";
  respond_with(
      "out = [ask('ask_open', n) for n in (b'some.nc', b'beside', b'../beside', b'/etc/passwd',"
      " b'', b'some.nc\\0x', b'/proc/self/mem')]\n"
      "out += [ask('ask_list', n) for n in (b'', b'/', b'..')]\n"
      "out += [ask('ask_exists', n) for n in (b'some.nc', b'/etc/passwd', b'beside')]\n"
      "f = '" +
      folder +
      "'.encode()\n"
      "out += [ask('ask_library', n) for n in (f + b'tables/table', f + b'tables/../beside',"
      " f + b'tables/link', f + b'tables', f + b'tables/', f + b'beside', b'/etc/passwd',"
      " f + b'tables//etc/passwd', f + b'tables/table\\0')]\n"
      "fail(' '.join(out))\nreceive()\n");
  const auto source = opened();
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().message,
            "descriptor no no no no no no "
            "no no no "
            "yes no no "
            "descriptor no no no no no no no no");
}

TEST_F(FaultyLoader, InvalidDatasetsAreRefused) {
  respond_with("send('opened', info[:-1])\nreceive()\n");
  expect_not_opened("the loader sent a malformed description");
}

TEST_F(FaultyLoader, KeptMemoryCannotChangeTheVolume) {
  respond_with(
      "fd = send_info()\nm = mmap.mmap(fd, 64)\nm[:] = floats(*[1] * 16)\nsend('filled')\n"
      "time.sleep(0.2)\nm[:] = floats(*[2] * 16)\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  const auto volume = (*source)->read(0, 0);
  ASSERT_TRUE(volume) << volume.error().message;
  ::usleep(400'000);
  EXPECT_EQ(volume->values[0], 1.0F);
  EXPECT_GT((*source)->process(), 0);
}

TEST_F(FaultyLoader, UnfilledMemoryReadsAsZero) {
  respond_with(
      "send_info()\nsend('filled')\n"
      "kind, _, fd = receive()\n"
      "if fd >= 0: fail('memory was sent twice')\n"
      "send('filled')\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  for (int round = 0; round < 2; ++round) {
    const auto volume = (*source)->read(0, 0);
    ASSERT_TRUE(volume) << volume.error().message;
    EXPECT_EQ(*std::max_element(volume->values.begin(), volume->values.end()), 0.0F);
  }
}

TEST_F(FaultyLoader, FailureAtFirstSendsTheMemoryAgain) {
  respond_with(
      "send_info()\nfail('not yet')\n"
      "kind, _, fd = receive()\n"
      "if fd < 0: fail('memory was not sent')\n"
      "os.pwrite(fd, floats(*[3] * 16), 0)\nsend('filled')\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_EQ((*source)->read(0, 0).error().message, "not yet");
  const auto volume = (*source)->read(0, 0);
  ASSERT_TRUE(volume) << volume.error().message;
  EXPECT_EQ(volume->values[15], 3.0F);
}

// 64 bytes at 16 a second.
TEST_F(FaultyLoader, TimeLimitGrowsWithTheBytesRead) {
  limits_.read_time = milliseconds(100);
  limits_.read_bytes_per_second = 16;
  respond_with("send_info()\ntime.sleep(0.5)\nsend('filled')\nreceive()\n");
  const auto volume = read();
  EXPECT_TRUE(volume) << volume.error().message;
}

TEST_F(FaultyLoader, ProgressIsReported) {
  respond_with(
      "send_info()\nfor done in (0, 0.5, 1): send('progress', struct.pack('<d', done))\n"
      "send('filled')\nreceive()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  std::vector<double> reported;
  (*source)->on_progress([&](double done) { reported.push_back(done); });
  ASSERT_TRUE((*source)->read(0, 0));
  EXPECT_EQ(reported, (std::vector<double>{0, 0.5, 1}));
}

TEST_F(FaultyLoader, ResizedMemoryIsRefused) {
  respond_with(
      "fd = send_info()\n"
      "for size in (0, 32, 128):\n"
      "    try: os.ftruncate(fd, size); fail('it could')\n"
      "    except OSError: pass\n"
      "os.close(fd)\nsend('filled')\nreceive()\n");
  const auto volume = read();
  EXPECT_TRUE(volume) << volume.error().message;
}

TEST_F(FaultyLoader, InfinitiesAndIncompleteVectorsAreRefused) {
  const std::string message =
      "the loader of 'sample.nc' did not mask all invalid numbers while reading 'wind'";
  for (const char* values : {"[inf] + [0] * 15", "[0] * 15 + [-inf]", "[nan] + [0] * 15",
                             "[0] * 12 + [nan] + [0] * 3"}) {
    std::string script = "fd = send_info()\nos.pwrite(fd, floats(*(";
    script += values;
    script += ")), 0)\nos.close(fd)\nsend('filled')\nreceive()\n";
    respond_with(script);
    expect_not_read(message);
  }
}

}  // namespace
}  // namespace windsplat::data::loader
