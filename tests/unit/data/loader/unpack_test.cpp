// Loaders that unpack archives: what a compromised one sends reaches nothing but the folder, and no
// more of it than was reserved. tests/integration/archives.py has real archives.
#include "server/data/loader/unpack.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include "tests/unit/data/loader/faulty_loader.hpp"

namespace windsplat::data::loader {
namespace {

using testing::HasSubstr;

class HostileUnpacker : public FaultyLoader {
 protected:
  void SetUp() override {
    FaultyLoader::SetUp();
    what_.archive = file_;
    what_.folder = folder_ / "into";
    what_.reserve = [this](std::uint64_t bytes) {
      reserved_ = bytes;
      return Result<void>();
    };
    std::filesystem::create_directory(what_.folder);
  }

  Result<void> unpack_from(const std::string& script) {
    respond_with("def reserve(n): send('entries', struct.pack('<Q', n))\n" + script +
                 "\nreceive()\n");
    return unpack(what_);
  }
  std::string refusal_of(const std::string& script) {
    const auto done = unpack_from(script);
    return done ? "" : done.error().message;
  }
  [[nodiscard]] std::string content(const std::string& name) const {
    std::ifstream file(what_.folder / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  Unpacking what_;
  std::uint64_t reserved_ = 0;
};

TEST_F(HostileUnpacker, WhatIsWithinTheReservationIsWritten) {
  const auto done = unpack_from(
      "reserve(3 * 4096)\nsend('entry', b'a/b')\nsend('entry_bytes', b'x' * 4000)\n"
      "send('entry_bytes', b'y' * 4000)\nsend('unpacked')");
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(content("a/b"), std::string(4000, 'x') + std::string(4000, 'y'));
  EXPECT_EQ(reserved_, 3U * 4096);
}

TEST_F(HostileUnpacker, MoreThanTheReservationIsRefused) {
  const std::string more = "has sent more than it announced";
  EXPECT_THAT(refusal_of("reserve(4096)\nsend('entry', b'a')\nsend('entry_bytes', b'x' * 4097)"),
              HasSubstr(more));
  EXPECT_EQ(content("a"), "");
  EXPECT_THAT(refusal_of("reserve(4096)\nsend('entry', b'b')\nsend('entry', b'c')"),
              HasSubstr(more));
  EXPECT_THAT(refusal_of("reserve(4096)\nsend('entry', b'f/')\nsend('entry', b'g/')"),
              HasSubstr(more));
}

TEST_F(HostileUnpacker, NamesThatLeadElsewhereAreRefused) {
  for (const char* name :
       {"../x", "/tmp/x", "f/../../x", "", ".", "f/./x", "f//x", "f\\\\x", "x\\0y", "\\n"}) {
    EXPECT_THAT(refusal_of("reserve(1 << 20)\nsend('entry', b'" + std::string(name) + "')"),
                HasSubstr("a name that is no path"))
        << name;
  }
  EXPECT_FALSE(std::filesystem::exists(folder_ / "x"));
}

TEST_F(HostileUnpacker, AFileIsNeitherReplacedNorAFolder) {
  const std::string begin = "reserve(1 << 20)\nsend('entry', b'a')\nsend('entry', b'";
  for (const char* second : {"a", "a/", "a/b"}) {
    EXPECT_THAT(refusal_of(begin + second + "')"), HasSubstr("twice")) << second;
    std::filesystem::remove(what_.folder / "a");
  }
  EXPECT_THAT(refusal_of("reserve(1 << 20)\nsend('entry', b'd/b')\nsend('entry', b'd')"),
              HasSubstr("twice"));
  std::filesystem::create_symlink(folder_ / "elsewhere", what_.folder / "link");
  EXPECT_THAT(refusal_of("reserve(1 << 20)\nsend('entry', b'link')"), HasSubstr("twice"));
  EXPECT_THAT(refusal_of("reserve(1 << 20)\nsend('entry', b'link/b')"), HasSubstr("twice"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "elsewhere"));
}

TEST_F(HostileUnpacker, MessagesOutOfOrderAreRefused) {
  for (const char* script :
       {"send('entry', b'a')", "send('entry_bytes', b'a')", "send('unpacked')",
        "reserve(8192)\nreserve(8192)", "send('entries', b'1')", "reserve(8192)\nsend('opened')",
        "reserve(8192)\nsend('entry_bytes', b'a')",
        "reserve(8192)\nsend('entry', b'f/')\nsend('entry_bytes', b'a')",
        "reserve(8192)\nsend('entry', b'x' * 70000)"}) {
    const auto done = unpack_from(script);
    ASSERT_FALSE(done) << script;
    EXPECT_EQ(done.error().kind, ErrorKind::bad_data) << done.error().message;
  }
}

TEST_F(HostileUnpacker, OneThatEndsOrStallsIsAnError) {
  EXPECT_THAT(refusal_of("reserve(8192)\nos._exit(7)"), HasSubstr("ended with code 7"));
  what_.stall_time = std::chrono::milliseconds(300);
  EXPECT_THAT(refusal_of("time.sleep(60)"), HasSubstr("took too long"));
}

TEST_F(HostileUnpacker, CancellingEndsItWithinAMoment) {
  std::thread later([cancel = what_.cancel] {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    cancel.cancel();
  });
  const auto begun = Clock::now();
  const auto silent = unpack_from("reserve(8192)\ntime.sleep(60)");
  later.join();
  ASSERT_FALSE(silent);
  EXPECT_EQ(silent.error().kind, ErrorKind::cancelled);
  EXPECT_LT(Clock::now() - begun, std::chrono::seconds(8));
}

TEST_F(HostileUnpacker, CancellingEndsOneThatNeverPauses) {
  what_.reserve = [cancel = what_.cancel](std::uint64_t) {
    cancel.cancel();
    return Result<void>();
  };
  const auto done = unpack_from(
      "reserve(4096)\nsend('entry', b'a')\nsend('entry_bytes', b'x')\nsend('unpacked')");
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::cancelled);
  EXPECT_TRUE(std::filesystem::is_empty(what_.folder));
}

TEST_F(HostileUnpacker, ARefusedReservationWritesNothing) {
  what_.reserve = [](std::uint64_t bytes) {
    return Result<void>(make_error(ErrorKind::out_of_memory, std::to_string(bytes)));
  };
  const auto done = unpack_from("reserve((1 << 64) - 1)\nsend('entry', b'a')");
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().message, "18446744073709551615");
  EXPECT_TRUE(std::filesystem::is_empty(what_.folder));
}

TEST_F(HostileUnpacker, TheArchiveIsReadOnly) {
  const std::string script =
      "fd = first[2]\ntry: os.pwrite(fd, b'x', 0); fail('written')\n"
      "except OSError as fault: fail(os.strerror(fault.errno) + os.pread(fd, 5, 0).decode())";
  EXPECT_THAT(refusal_of(script), HasSubstr("Bad file descriptornever"));
}

}  // namespace
}  // namespace windsplat::data::loader
