// Files of which a loader has only the bytes that it reads: all others are zeros.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/data/loader/loader.hpp"
#include "tests/unit/data/loader/loader_fixture.hpp"
#include "tests/unit/data/loader_files.hpp"

namespace windsplat::data::loader {
namespace {

struct Fetched {
  std::uint64_t bytes = 0;
  int opened = 0;
  int closed = 0;
  bool fails = false;
};

// A local file that is provided in parts.
class PartFiles final : public Files {
 public:
  PartFiles(Location location, std::string empty, std::shared_ptr<Fetched> fetched)
      : location_(std::move(location)), empty_(std::move(empty)), fetched_(std::move(fetched)) {
    source_ = ::open(location_.members[0].path.c_str(), O_RDONLY | O_CLOEXEC);
    parts_ = ::open(empty_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    bytes_ = static_cast<std::uint64_t>(::lseek(source_, 0, SEEK_END));
    EXPECT_EQ(::ftruncate(parts_, static_cast<off_t>(bytes_)), 0);
  }
  ~PartFiles() override {
    ::close(source_);
    ::close(parts_);
  }
  PartFiles(const PartFiles&) = delete;
  PartFiles& operator=(const PartFiles&) = delete;
  [[nodiscard]] const Location& location() const override { return location_; }
  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    ++fetched_->opened;
    count_opened(name, bytes_);
    return InputFile::adopt(::open(empty_.c_str(), O_RDONLY | O_CLOEXEC), name, {7, "state"});
  }
  Result<std::vector<std::string>> list(const std::string&) override {
    return std::vector<std::string>();
  }
  bool exists(const std::string&) override { return true; }
  Result<Extent> fetch_part(std::uint64_t number, std::uint64_t offset,
                            std::uint64_t count) override {
    EXPECT_EQ(number, 7U);
    if (fetched_->fails) {
      fault_ = make_error(ErrorKind::bad_data, "the host failed");
      return *fault_;
    }
    std::string bytes(std::min(count, bytes_ - offset), '\0');
    EXPECT_EQ(::pread(source_, bytes.data(), bytes.size(), static_cast<off_t>(offset)),
              static_cast<ssize_t>(bytes.size()));
    EXPECT_EQ(::pwrite(parts_, bytes.data(), bytes.size(), static_cast<off_t>(offset)),
              static_cast<ssize_t>(bytes.size()));
    fetched_->bytes += bytes.size();
    return Extent{offset, offset + bytes.size()};
  }
  void close_parts(std::uint64_t number) override {
    EXPECT_EQ(number, 7U);
    ++fetched_->closed;
  }
  std::optional<Error> take_fault() override { return std::exchange(fault_, {}); }

 private:
  Location location_;
  std::string empty_;
  std::shared_ptr<Fetched> fetched_;
  std::optional<Error> fault_;
  int source_ = -1;
  int parts_ = -1;
  std::uint64_t bytes_ = 0;
};

class LoaderOfParts : public Loader {
 protected:
  std::unique_ptr<RemoteSource> opened_in_parts(const std::string& path) {
    Location location = locate(path).value();
    Limits limits;
    limits.files = [location, empty = folder_ / "parts", fetched = fetched_](
                       const Location&, const std::function<bool()>&) {
      return std::make_shared<PartFiles>(location, empty, fetched);
    };
    location.fetched = true;
    auto source = open(std::move(location), std::move(limits));
    EXPECT_TRUE(source) << source.error().message;
    return source ? std::move(*source) : nullptr;
  }

  std::shared_ptr<Fetched> fetched_ = std::make_shared<Fetched>();
};

TEST_F(LoaderOfParts, ReadsTheSameValuesThroughEveryLibrary) {
  for (const int mode : {0, NC_64BIT_OFFSET, NC_64BIT_DATA, NC_NETCDF4}) {
    SCOPED_TRACE(mode);
    const std::string path = folder_ / "wind.nc";
    test::write_wind(path, mode);
    const auto whole = opened(path);
    const auto parts = opened_in_parts(path);
    ASSERT_TRUE(whole && parts);
    ASSERT_EQ(parts->info().fields.size(), whole->info().fields.size());
    for (std::size_t field = 0; field < whole->info().fields.size(); ++field) {
      for (const std::size_t step : {1, 0}) {
        const auto expected = whole->read(field, step);
        const auto got = parts->read(field, step);
        ASSERT_TRUE(expected && got) << (got ? "" : got.error().message);
        expect_same(*got, *expected);
      }
    }
    EXPECT_GT(fetched_->bytes, 0U);
  }
}

TEST_F(LoaderOfParts, BytesThatCannotBeFetchedAreTheErrorOfTheRead) {
  const std::string path = folder_ / "large.nc";
  test::write_large(path);
  const auto source = opened_in_parts(path);
  ASSERT_TRUE(source);
  fetched_->fails = true;
  const auto failed = source->read(0, 0);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "the host failed");
  fetched_->fails = false;
  EXPECT_TRUE(source->read(0, 0));
}

TEST_F(LoaderOfParts, FilesThatTheLoaderClosesAreClosed) {
  const std::string path = folder_ / "wind.nc";
  test::write_wind(path, NC_NETCDF4);
  const auto source = opened_in_parts(path);
  ASSERT_TRUE(source);
  EXPECT_GT(fetched_->opened, 0);
  EXPECT_EQ(fetched_->closed, fetched_->opened - 1) << "one is read later";
}

// 2 layers of 3 rows of a file of 5 MiB.
TEST_F(LoaderOfParts, BoxFetchesTheBytesOfItsRowsAlone) {
  const std::string path = folder_ / "large.nc";
  test::write_large(path);
  const auto whole = opened(path);
  const auto parts = opened_in_parts(path);
  ASSERT_TRUE(whole && parts);
  const Box box{{10, 20, 5}, {4, 3, 2}};
  const auto expected = whole->read(0, 0);
  fetched_->bytes = 0;
  const auto got = parts->read_part(0, 0, {box});
  ASSERT_TRUE(expected && got) << (got ? "" : got.error().message);
  expect_same(*got, cut(*expected, box));
  EXPECT_GT(fetched_->bytes, 0U);
  EXPECT_LT(fetched_->bytes, 256U << 10);
}

}  // namespace
}  // namespace windsplat::data::loader
