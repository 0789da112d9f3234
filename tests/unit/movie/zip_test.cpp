// Archives, read by Python's zipfile, which knows ZIP64.
#include "server/movie/zip.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <cstdlib>

#include "server/movie/container.hpp"
#include "server/movie/writer.hpp"
#include "tests/unit/movie/movie_files.hpp"

namespace windsplat::movie::testing {
namespace {

using ::testing::HasSubstr;

// What a program of Python prints about the file, which it knows as `path`.
std::string python_on(const MovieFolder& folder, const std::string& file, const std::string& code) {
  folder.write("read.py", "import io, sys, zipfile\npath = sys.argv[1]\n" + code);
  const std::string command = "python3 " + folder.file("read.py") + " " + folder.file(file) +
                              " > " + folder.file("printed") + " 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0) << folder.text("printed");
  return folder.text("printed");
}

class ZipFile {
 public:
  explicit ZipFile(const std::string& path, std::uint64_t start = 0)
      : file_(::open(path.c_str(), O_WRONLY | O_CREAT, 0600)) {
    ::lseek(file_, static_cast<off_t>(start), SEEK_SET);
  }
  ~ZipFile() { ::close(file_); }
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;
  Zip::Sink sink() {
    return [this](std::span<const std::uint8_t> bytes) -> Result<void> {
      const ssize_t wrote = ::write(file_, bytes.data(), bytes.size());
      if (wrote == static_cast<ssize_t>(bytes.size())) return {};
      return make_error(ErrorKind::internal, "write");
    };
  }

 private:
  int file_;
};

std::vector<std::uint8_t> as_bytes(const std::string& text) { return {text.begin(), text.end()}; }

TEST(MovieZip, FilesAreFoundWithTheirBytes) {
  const MovieFolder folder;
  {
    ZipFile file(folder.file("a.zip"));
    Zip zip(file.sink());
    ASSERT_TRUE(zip.add("one.txt", as_bytes("first")));
    ASSERT_TRUE(zip.add("two.txt", {}));
    ASSERT_TRUE(zip.finish());
  }
  EXPECT_EQ(python_on(folder, "a.zip", R"(
z = zipfile.ZipFile(path)
print(z.testzip(), z.namelist(), z.read("one.txt"), z.read("two.txt"))
i = z.infolist()[0]
print(i.date_time, oct(i.external_attr >> 16), i.compress_type, i.extra))"),
            "None ['one.txt', 'two.txt'] b'first' b''\n"
            "(1980, 1, 1, 0, 0, 0) 0o100644 0 b''\n");
}

// APPNOTE 4.4.1.4: a field that is too small holds its greatest value, and the ZIP64 record the
// true one.
TEST(MovieZip, MoreThan65534FilesNeedZip64) {
  const MovieFolder folder;
  for (const int count : {65534, 65535, 70000}) {
    std::filesystem::remove(folder.file("a.zip"));
    std::string bytes;
    Zip zip([&bytes](std::span<const std::uint8_t> more) {
      bytes.append(more.begin(), more.end());
      return Result<void>();
    });
    for (int n = 0; n < count; ++n) ASSERT_TRUE(zip.add(std::to_string(n), as_bytes("x")));
    ASSERT_TRUE(zip.finish());
    folder.write("a.zip", bytes);
    EXPECT_EQ(python_on(folder, "a.zip", R"(
z = zipfile.ZipFile(path)
names = z.namelist()
print(len(names), names[-1], z.read(names[-1]), b"PK\x06\x06" in open(path, "rb").read()[-200:]))"),
              std::to_string(count) + " " + std::to_string(count - 1) + " b'x' " +
                  (count < 65535 ? "False" : "True") + "\n");
  }
}

// The archive begins behind a hole of 4 GiB, which takes no room on disk.
TEST(MovieZip, OffsetsBeyond4GiBNeedZip64) {
  const MovieFolder folder;
  constexpr std::uint64_t start = (std::uint64_t{1} << 32U) - 40;
  {
    ZipFile file(folder.file("a.zip"), start);
    Zip zip(file.sink(), start);
    ASSERT_TRUE(zip.add("near", as_bytes("before the limit")));
    ASSERT_TRUE(zip.add("far", as_bytes("beyond it")));
    ASSERT_TRUE(zip.finish());
  }
  EXPECT_EQ(python_on(folder, "a.zip", R"(
z = zipfile.ZipFile(path)
print(z.read("near"), z.read("far"), [i.header_offset - 2**32 for i in z.infolist()]))"),
            "b'before the limit' b'beyond it' [-40, 10]\n");
}

TEST(MovieZip, AMovieHoldsItsPicturesAsPng) {
  const MovieFolder folder;
  Options options;
  options.container = Container::zip;
  options.width = 5;
  options.height = 3;
  auto writer = Writer::open(folder.file("a.zip"), options, {});
  ASSERT_TRUE(writer) << writer.error().message;
  for (int n = 0; n < 3; ++n) ASSERT_TRUE((*writer)->add(picture_of(5, 3, n)));
  ASSERT_TRUE((*writer)->finish());
  const std::string printed = python_on(folder, "a.zip", R"(
import struct, zlib
z = zipfile.ZipFile(path)
print(z.testzip(), z.namelist())
def pixels(png):
    data, at = b"", 8
    while at < len(png):
        size, kind = struct.unpack(">I4s", png[at:at + 8])
        if kind == b"IHDR": print(struct.unpack(">II", png[at + 8:at + 16]))
        if kind == b"IDAT": data += png[at + 8:at + 8 + size]
        at += size + 12
    raw = zlib.decompress(data)
    rows, last = [], bytes(15)
    for y in range(3):
        kind, row = raw[16 * y], bytearray(raw[16 * y + 1:16 * y + 16])
        for x in range(15):
            a, b, c = (row[x - 3] if x > 2 else 0), last[x], (last[x - 3] if x > 2 else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            row[x] = (row[x] + [0, a, b, (a + b) // 2, paeth][kind]) % 256
        rows.append(bytes(row)); last = rows[-1]
    return b"".join(rows)
for n, name in enumerate(z.namelist()):
    print(pixels(z.read(name)) == bytes((i * 37 + n * 101 + i // 256) % 256 for i in range(45)))
)");
  EXPECT_EQ(printed,
            "None ['frame_000000.png', 'frame_000001.png', 'frame_000002.png']\n"
            "(5, 3)\nTrue\n(5, 3)\nTrue\n(5, 3)\nTrue\n");
}

TEST(MovieContainer, FollowsFromTheEndingOfAName) {
  EXPECT_EQ(container_of("a/b.MP4"), Container::mp4);
  EXPECT_EQ(container_of("x.y.webm"), Container::webm);
  EXPECT_EQ(container_of("x.zip"), Container::zip);
  for (const char* other : {"x", "x.mp4/y", "x/mp4", "x.jpg", "mp4", "", "."}) {
    EXPECT_EQ(container_of(other), std::nullopt) << other;
  }
}

}  // namespace
}  // namespace windsplat::movie::testing
