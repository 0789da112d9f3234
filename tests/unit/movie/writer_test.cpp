// Pictures -> files: the protocol with ffmpeg, by a program in its place, and archives of PNG.
#include "server/movie/writer.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <iterator>
#include <thread>
#include <utility>

#include "server/movie/child.hpp"
#include "server/movie/ffmpeg.hpp"
#include "tests/unit/movie/movie_files.hpp"

namespace windsplat::movie::testing {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Options options_of(const MovieFolder& folder, Container container, int width, int height) {
  Options options;
  options.container = container;
  options.width = width;
  options.height = height;
  options.fps = 12.5;
  options.search = folder.path();
  return options;
}

// No child is left: neither running nor a zombie.
void expect_no_children() {
  errno = 0;
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);
  EXPECT_EQ(errno, ECHILD);
}

std::string bytes_of_pictures(int width, int height, int count) {
  std::string out;
  for (int n = 0; n < count; ++n) {
    const auto rgb = picture_of(width, height, n);
    out.append(rgb.begin(), rgb.end());
  }
  return out;
}

Result<void> write_pictures(Writer& writer, int width, int height, int count) {
  for (int n = 0; n < count; ++n) {
    if (auto done = writer.add(picture_of(width, height, n)); !done) return done;
  }
  return writer.finish();
}

TEST(MovieWriter, FfmpegGetsTheBytesOfThePicturesAndItsFileTheName) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input);
  for (const Container container : {Container::mp4, Container::webm}) {
    const std::string name = "out." + std::string(name_of(container));
    folder.write(name, "an earlier movie");
    // More than a socket holds, so that the writer waits for the program.
    auto writer = Writer::open(folder.file(name), options_of(folder, container, 640, 360), {});
    ASSERT_TRUE(writer) << writer.error().message;
    EXPECT_EQ(folder.text(name), "an earlier movie") << "until the new one is complete";
    const auto done = write_pictures(**writer, 640, 360, 5);
    ASSERT_TRUE(done) << done.error().message;
    EXPECT_TRUE(folder.text(name) == bytes_of_pictures(640, 360, 5));
  }
  EXPECT_THAT(folder.names(), ElementsAre("asked", "ffmpeg", "noted", "out.mp4", "out.webm"));
  EXPECT_EQ(folder.text("asked"), "x") << "its encoders are asked for once";
  expect_no_children();
}

TEST(MovieWriter, FfmpegGetsItsArgumentsAndNothingElse) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input);
  const int null = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  const int secret = ::fcntl(null, F_DUPFD, 9);  // would be inherited
  ::close(null);
  auto writer =
      Writer::open(folder.file("a 'b'; $(c).mp4"), options_of(folder, Container::mp4, 6, 4), {});
  ::close(secret);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(write_pictures(**writer, 6, 4, 1));
  const std::string noted = folder.text("noted");
  EXPECT_THAT(noted,
              HasSubstr(R"("-f", "rawvideo", "-pixel_format", "rgb24", "-video_size", "6x4",)"
                        R"( "-framerate", "12.5", "-i", "pipe:0")"));
  EXPECT_THAT(noted, AllOf(HasSubstr(R"("-c:v", "libx264")"),
                           HasSubstr(R"("-movflags", "+faststart", "-f", "mp4")"),
                           HasSubstr(R"(format=yuv420p)")));
  EXPECT_THAT(noted, HasSubstr(R"("LC_ALL": "C")"));
  EXPECT_THAT(noted, AllOf(Not(HasSubstr("PATH\": \"/")), Not(HasSubstr("HOME"))));
  // 0 to 3, and the one with which Python lists them.
  EXPECT_THAT(noted, HasSubstr(R"("descriptors": ["0", "1", "2", "3", "4"])"));
}

TEST(MovieWriter, OddSizesRepeatTheLastColumnAndRow) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input);
  auto writer = Writer::open(folder.file("out.mp4"), options_of(folder, Container::mp4, 3, 1), {});
  ASSERT_TRUE(writer) << writer.error().message;
  const std::string row("abcdefghi");
  ASSERT_TRUE((*writer)->add({reinterpret_cast<const std::uint8_t*>(row.data()), row.size()}));
  ASSERT_TRUE((*writer)->finish());
  EXPECT_EQ(folder.text("out.mp4"), "abcdefghighiabcdefghighi");
  EXPECT_THAT(folder.text("noted"), HasSubstr("\"4x2\""));
}

TEST(MovieWriter, FailuresOfFfmpegAreReportedWithItsMessageAndLeaveNoFile) {
  const MovieFolder folder;
  // It ends before it has read anything: writing to it must neither block nor raise SIGPIPE.
  put_ffmpeg(folder,
             "print('x' * 9000 + 'Unknown encoder libx264', file=sys.stderr)\nsys.exit(69)");
  struct sigaction before {};
  struct sigaction by_default {};
  by_default.sa_handler = SIG_DFL;
  ::sigaction(SIGPIPE, &by_default, &before);
  // While it runs the rest of a picture meets its end, and afterwards the first write.
  for (const bool has_ended : {false, true}) {
    auto writer =
        Writer::open(folder.file("out.mp4"), options_of(folder, Container::mp4, 640, 360), {});
    ASSERT_TRUE(writer) << writer.error().message;
    siginfo_t about{};
    if (has_ended) {
      ASSERT_EQ(::waitid(P_ALL, 0, &about, WEXITED | WNOWAIT), 0);
    }
    const auto done = write_pictures(**writer, 640, 360, 5);
    ASSERT_FALSE(done);
    EXPECT_THAT(done.error().message, AllOf(HasSubstr("ffmpeg ended with code 69"),
                                            HasSubstr("Unknown encoder libx264")));
    EXPECT_EQ(done.error().kind, ErrorKind::internal);
  }
  ::sigaction(SIGPIPE, &before, nullptr);
  EXPECT_THAT(folder.names(), ElementsAre("asked", "ffmpeg", "noted"));
  expect_no_children();
}

TEST(MovieWriter, AFullDiskOfFfmpegIsThatOfAnArchive) {
  const MovieFolder folder;
  put_ffmpeg(folder,
             "sys.stdin.buffer.read()\n"
             "sys.exit('av_interleaved_write_frame(): No space left on device')");
  auto writer = Writer::open(folder.file("out.mp4"), options_of(folder, Container::mp4, 4, 4), {});
  ASSERT_TRUE(writer) << writer.error().message;
  const auto done = write_pictures(**writer, 4, 4, 1);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::out_of_memory);
}

TEST(MovieWriter, EncodersLookAheadByTenPictures) {
  for (const auto& [encoder, option] :
       {std::pair("libx264", "-rc-lookahead"), std::pair("libvpx-vp9", "-lag-in-frames")}) {
    const auto words = arguments_of({}, encoder, 4, 4);
    const auto at = std::find(words.begin(), words.end(), option);
    ASSERT_LT(at - words.begin(), std::ssize(words) - 1) << encoder;
    EXPECT_EQ(*std::next(at), "10");
  }
}

TEST(MovieWriter, TheEndOfAMessageIsKept) {
  const MovieFolder folder;
  put_ffmpeg(folder,
             "sys.stdin.buffer.read()\nprint('x' * 9000 + 'No space left', file=sys.stderr)\n"
             "os.kill(os.getpid(), 9)");
  auto child = Child::start(folder.file("ffmpeg"), {}, -1);
  ASSERT_TRUE(child) << child.error().message;
  const auto done = child->finish({});
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("ffmpeg was terminated by signal 9: x"));
  EXPECT_EQ(child->messages().size(), 4096U);
  EXPECT_THAT(child->messages(), HasSubstr("No space left"));
}

// The whole of a small WebM is written at its end.
TEST(MovieWriter, AVideoWhoseEndCannotBeWrittenFails) {
  const auto ffmpeg = find_ffmpeg();
  if (!ffmpeg) GTEST_SKIP() << ffmpeg.error().message;
  const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
  ASSERT_GE(full, 0);
  Options options;
  options.container = Container::webm;
  auto child = Child::start(ffmpeg->program, arguments_of(options, "libvpx-vp9", 64, 64), full);
  ::close(full);
  ASSERT_TRUE(child) << child.error().message;
  ASSERT_TRUE(child->write(picture_of(64, 64, 0), {}));
  const auto done = child->finish({});
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::out_of_memory) << done.error().message;
}

TEST(MovieWriter, OneThatReadsNothingOrDoesNotEndIsTerminated) {
  const MovieFolder folder;
  put_ffmpeg(folder, "time.sleep(1000)");
  constexpr std::chrono::milliseconds patience{300};
  {
    auto child = Child::start(folder.file("ffmpeg"), {}, -1, Child::Keeps::errors, patience);
    ASSERT_TRUE(child) << child.error().message;
    const std::vector<std::uint8_t> bytes(std::size_t{1} << 23U);  // more than a socket holds
    const auto written = child->write(bytes, {});
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().message, "ffmpeg read nothing for 300 ms and was terminated");
  }
  {
    auto child = Child::start(folder.file("ffmpeg"), {}, -1, Child::Keeps::errors, patience);
    ASSERT_TRUE(child) << child.error().message;
    const auto ended = child->finish({});
    ASSERT_FALSE(ended);
    EXPECT_EQ(ended.error().message, "ffmpeg did not end for 300 ms and was terminated");
  }
  expect_no_children();
}

TEST(MovieWriter, CancellationEndsAnFfmpegThatDoesNotRead) {
  const MovieFolder folder;
  put_ffmpeg(folder, "time.sleep(1000)");
  const CancelToken cancel;
  auto writer =
      Writer::open(folder.file("out.webm"), options_of(folder, Container::webm, 640, 360), cancel);
  ASSERT_TRUE(writer) << writer.error().message;
  std::thread other([&cancel] {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    cancel.cancel();
  });
  const auto done = write_pictures(**writer, 640, 360, 5);
  other.join();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::cancelled);
  writer->reset();
  EXPECT_THAT(folder.names(), Not(::testing::Contains(HasSubstr("out."))));
  expect_no_children();
}

TEST(MovieWriter, AWriterThatIsDroppedLeavesNeitherFileNorProcess) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input);
  for (const Container container : containers) {
    const std::string name = "out." + std::string(name_of(container));
    auto writer = Writer::open(folder.file(name), options_of(folder, container, 4, 4), {});
    ASSERT_TRUE(writer) << writer.error().message;
    ASSERT_TRUE((*writer)->add(picture_of(4, 4, 0)));
  }
  EXPECT_THAT(folder.names(), Not(::testing::Contains(HasSubstr("out."))));
  expect_no_children();
}

TEST(MovieWriter, AMissingFfmpegNamesThePackageAndTheAlternative) {
  const MovieFolder folder;
  const auto writer =
      Writer::open(folder.file("out.mp4"), options_of(folder, Container::mp4, 4, 4), {});
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().kind, ErrorKind::invalid);
  EXPECT_THAT(writer.error().message,
              AllOf(HasSubstr("install the package ffmpeg"), HasSubstr("choose a .zip")));
  EXPECT_THAT(folder.names(), ElementsAre());
  const auto zip =
      Writer::open(folder.file("out.zip"), options_of(folder, Container::zip, 4, 4), {});
  EXPECT_TRUE(zip) << "it needs none";
}

// A folder that is relative would name other programs in other current folders.
TEST(MovieWriter, FfmpegIsSearchedInAbsoluteFoldersOnly) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input);
  const std::string relative =
      std::filesystem::relative(folder.path(), std::filesystem::current_path()).string();
  EXPECT_FALSE(find_ffmpeg(relative));
  EXPECT_FALSE(find_ffmpeg(":"));
  const auto found = find_ffmpeg(":/nowhere:" + relative + ":" + folder.path());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->program, folder.file("ffmpeg"));
}

TEST(MovieWriter, AnotherEncoderOfH264IsUsedAndNoneIsRefused) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input, "mpeg4 libopenh264");
  auto writer = Writer::open(folder.file("out.mp4"), options_of(folder, Container::mp4, 4, 4), {});
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(write_pictures(**writer, 4, 4, 1));
  EXPECT_THAT(folder.text("noted"), HasSubstr(R"("-c:v", "libopenh264", "-b:v", "200000")"));
  const auto none =
      Writer::open(folder.file("out.webm"), options_of(folder, Container::webm, 4, 4), {});
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("lacks the encoder libvpx-vp9 for .webm"));
}

TEST(MovieWriter, VideosReachADescriptorThatCannotSeek) {
  const MovieFolder folder;
  put_ffmpeg(folder, copies_input);
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  auto writer = Writer::open(ends[1], options_of(folder, Container::mp4, 4, 4), {});
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(write_pictures(**writer, 4, 4, 2));
  ::close(ends[1]);
  std::string got(1000, '\0');
  got.resize(static_cast<std::size_t>(::read(ends[0], got.data(), got.size())));
  ::close(ends[0]);
  EXPECT_EQ(got, bytes_of_pictures(4, 4, 2));
}

TEST(MovieWriter, ImpossibleOptionsAndPicturesAreRefused) {
  const MovieFolder folder;
  Options options = options_of(folder, Container::zip, 0, 4);
  EXPECT_FALSE(Writer::open(folder.file("out.zip"), options, {}));
  options.width = 4;
  for (const double fps : {0.0, 241.0, std::nan("")}) {
    options.fps = fps;
    EXPECT_FALSE(Writer::open(folder.file("out.zip"), options, {})) << fps;
  }
  options.fps = 25;
  auto writer = Writer::open(folder.file("out.zip"), options, {});
  ASSERT_TRUE(writer);
  EXPECT_FALSE((*writer)->add(picture_of(4, 3, 0))) << "of another size";
  EXPECT_FALSE((*writer)->finish()) << "without a picture";
  EXPECT_FALSE(Writer::open(folder.path(), options, {})) << "a folder";
}

// What the real program makes, if it is there.
TEST(MovieWriter, FfmpegItselfMakesVideosOfTheirSizeAndLength) {
  const auto ffmpeg = find_ffmpeg();
  if (!ffmpeg) GTEST_SKIP() << ffmpeg.error().message;
  const MovieFolder folder;
  for (const Container container : {Container::mp4, Container::webm}) {
    if (!choose_encoder(*ffmpeg, container)) continue;
    const std::string name = "out." + std::string(name_of(container));
    Options options = options_of(folder, container, 63, 48);
    options.search.clear();
    auto writer = Writer::open(folder.file(name), options, {});
    ASSERT_TRUE(writer) << writer.error().message;
    const auto done = write_pictures(**writer, 63, 48, 5);
    ASSERT_TRUE(done) << done.error().message;
    const std::string decode = ffmpeg->program + " -loglevel error -i " + folder.file(name) +
                               " -f rawvideo -pix_fmt rgb24 -y " + folder.file("raw");
    ASSERT_EQ(std::system(decode.c_str()), 0);
    EXPECT_EQ(folder.text("raw").size(), 5U * 64 * 48 * 3) << name;
  }
}

}  // namespace
}  // namespace windsplat::movie::testing
