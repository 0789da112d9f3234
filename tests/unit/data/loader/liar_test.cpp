// Faulty or compromised loaders: scripts that implement the protocol on descriptor 3. For any
// messages the daemon gets an error or values that satisfy the invariants.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

#include "tests/unit/data/loader/faulty_loader.hpp"

namespace windsplat::data::loader {
namespace {

using std::chrono::milliseconds;

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

// A box of 1 x 2 x 1 samples of the vector.
class FaultyBoxes : public FaultyLoader {
 protected:
  void SetUp() override {
    FaultyLoader::SetUp();
    DatasetInfo info = sample_info();
    info.fields[0].box_chunk = {1, 1, 1};
    std::ofstream(folder_ / "info", std::ios::binary) << encode_info(info);
  }
  Result<Volume> read_box() {
    auto source = opened();
    if (!source) return source.error();
    auto part = (*source)->read_part(0, 0, {{{1, 0, 1}, {1, 2, 1}}});
    is_running_ = (*source)->process() > 0;
    return part;
  }
  bool is_running_ = false;
};

TEST_F(FaultyBoxes, ValidAnswerIsAccepted) {
  respond_with(
      "fd = send_info()\nif os.fstat(fd).st_size != 16: fail('wrong size')\n"
      "os.pwrite(fd, struct.pack('<4f', 1, 2, 3, 4), 0)\nos.close(fd)\nsend('filled')\n"
      "receive()\n");
  const auto part = read_box();
  ASSERT_TRUE(part) << part.error().message;
  EXPECT_EQ(part->dims, (std::array<int, 3>{1, 2, 1}));
  ASSERT_EQ(part->values.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(part->values[i], static_cast<float>(i + 1));
  EXPECT_TRUE(is_running_);
}

TEST_F(FaultyBoxes, AnswersOfAnotherSizeAreRefused) {
  for (const char* answer : {"send('whole')", "send('part', struct.pack('<4Q', 0, 0, 1, 0))"}) {
    respond_with(std::string("send_info()\n") + answer + "\nreceive()\n");
    const auto part = read_box();
    ASSERT_FALSE(part) << answer;
    EXPECT_EQ(part.error().message,
              "the loader of 'some.nc' violated the protocol and was terminated while reading "
              "'wind'");
    EXPECT_FALSE(is_running_);
  }
}

TEST_F(FaultyBoxes, InvalidNumbersAreRefused) {
  respond_with(
      "fd = send_info()\nos.pwrite(fd, struct.pack('<4f', 0, nan, 0, 0), 0)\nos.close(fd)\n"
      "send('filled')\nreceive()\n");
  const auto part = read_box();
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().message,
            "the loader of 'sample.nc' did not mask all invalid numbers while reading 'wind'");
  EXPECT_FALSE(is_running_);
}

// 200 ms, and 100 for its 16 bytes; the step has 64.
TEST_F(FaultyBoxes, AreGivenTheTimeOfTheirChunks) {
  limits_.read_time = milliseconds(200);
  limits_.read_bytes_per_second = 160;
  respond_with("send_info()\nwhile True: pass\n");
  const auto part = read_box();
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().message,
            "the loader of 'some.nc' was terminated after 0.3 s while reading 'wind'");
}

TEST_F(FaultyBoxes, BeyondTheGridAreNotAskedFor) {
  respond_with("send_info()\n");
  auto source = opened();
  ASSERT_TRUE(source) << source.error().message;
  const auto part = (*source)->read_part(0, 0, {{{1, 0, 1}, {1, 2, 2}}});
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().kind, ErrorKind::invalid);
  EXPECT_EQ(part.error().message, "the box 1,0,1,1,2,2 is beyond the grid");
}

}  // namespace
}  // namespace windsplat::data::loader
