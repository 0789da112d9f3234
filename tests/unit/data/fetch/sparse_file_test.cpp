// Files of which only the blocks that were read are fetched.
#include "server/data/fetch/sparse_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/data/fetch/content_range.hpp"

namespace windsplat::data::fetch {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

constexpr std::uint64_t block = SparseFile::block_bytes;
constexpr std::uint64_t file_bytes = 40 * block + 77;

class SparseFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "windsplat-sparse-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    cache_ = ObjectCache::open({name, std::uint64_t{1} << 30}).value();
    make(file_bytes);
  }
  void TearDown() override {
    file_.reset();
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  void make(std::uint64_t bytes_max, std::uint64_t claimed_bytes = file_bytes) {
    auto part = cache_->begin();
    ASSERT_TRUE(part);
    ASSERT_TRUE(part->append(bytes_of({0, block})));
    Response response;
    response.validators.etag = "\"1\"";
    response.file_bytes = claimed_bytes;
    auto made = SparseFile::make("https://h/a.nc", std::move(*part), response, bytes_max);
    ASSERT_TRUE(made) << made.error().message;
    file_ = *made;
  }
  static char byte_at(std::uint64_t offset) {
    return static_cast<char>((offset * 2654435761U) >> 13U);
  }
  static std::string bytes_of(ByteRange range) {
    std::string out(range.count, '\0');
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = byte_at(range.first + i);
    return out;
  }
  Result<Extent> fetch(std::uint64_t offset, std::uint64_t count) {
    const auto get = [this](ByteRange range, const HttpClient::Sink& sink) -> Result<void> {
      asked_.emplace_back(range.first, range.count);
      if (fault_) return *fault_;
      const std::string bytes = bytes_of(range);
      const std::size_t half = bytes.size() / 2;
      EXPECT_TRUE(sink(std::string_view(bytes).substr(0, half)));
      EXPECT_TRUE(sink(std::string_view(bytes).substr(half)));
      return {};
    };
    return file_->fetch(offset, count, get, {});
  }
  // Whether the bytes of an extent are those of the host.
  [[nodiscard]] bool is_there(const Extent& extent) const {
    const auto open = file_->open();
    std::string got(extent.end - extent.begin, '\0');
    return open &&
           ::pread(open->number(), got.data(), got.size(), static_cast<off_t>(extent.begin)) ==
               static_cast<ssize_t>(got.size()) &&
           got == bytes_of({extent.begin, got.size()});
  }

  fs::path folder_;
  std::unique_ptr<ObjectCache> cache_;
  std::shared_ptr<SparseFile> file_;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> asked_;
  std::optional<Error> fault_;
};

TEST_F(SparseFiles, WhatIsPresentIsNotAskedForAgain) {
  ASSERT_TRUE(fetch(0, 100));
  EXPECT_TRUE(asked_.empty()) << "the first block came with the first answer";
  const auto extent = fetch(20 * block + 5, 10).value();
  EXPECT_THAT(asked_, ElementsAre(Pair(20 * block, block)));
  EXPECT_EQ(extent.begin, 20 * block);
  EXPECT_EQ(extent.end, 21 * block);
  EXPECT_TRUE(is_there(extent));
  ASSERT_TRUE(fetch(20 * block, block));
  EXPECT_EQ(asked_.size(), 1U);
  EXPECT_EQ(file_->fetched_bytes(), 2 * block);
}

TEST_F(SparseFiles, MissingBlocksSideBySideAreOneRequest) {
  ASSERT_TRUE(fetch(12 * block, 1));
  asked_.clear();
  const auto extent = fetch(10 * block - 1, 5 * block + 2).value();
  EXPECT_THAT(asked_, ElementsAre(Pair(9 * block, 3 * block), Pair(13 * block, 3 * block)));
  EXPECT_EQ(extent.begin, 9 * block);
  EXPECT_EQ(extent.end, 16 * block);
  EXPECT_TRUE(is_there(extent));
}

TEST_F(SparseFiles, ReadingInSequenceAsksForMoreAndMore) {
  for (std::uint64_t at = 0; at < file_bytes; at += 1000) ASSERT_TRUE(fetch(at, 1000));
  EXPECT_THAT(asked_, ElementsAre(Pair(block, 2 * block), Pair(3 * block, 4 * block),
                                  Pair(7 * block, 8 * block), Pair(15 * block, 16 * block),
                                  Pair(31 * block, 9 * block + 77)));
  EXPECT_TRUE(is_there({0, file_bytes}));
}

TEST_F(SparseFiles, ExtentsAreClippedToTheFile) {
  const auto end = fetch(file_bytes - 10, std::uint64_t{1} << 60).value();
  EXPECT_THAT(asked_, ElementsAre(Pair(40 * block, 77)));
  EXPECT_EQ(end.end, file_bytes);
  EXPECT_TRUE(is_there(end));
  const auto beyond = fetch(~std::uint64_t{0}, ~std::uint64_t{0}).value();
  EXPECT_EQ(beyond.begin, file_bytes);
  EXPECT_EQ(beyond.end, file_bytes);
}

// Fetched in an order that joins extents on both sides, and compared with one bit for each block.
TEST_F(SparseFiles, KnowsWhichBlocksArePresentInAnyOrder) {
  std::vector<bool> present(41);
  present[0] = true;
  for (std::size_t i = 0; i < present.size(); ++i) {
    const std::size_t one = (i * 17 + 5) % present.size();
    const bool was_present = present[one];
    asked_.clear();
    const auto extent = fetch(one * block, 1).value();
    EXPECT_EQ(asked_.empty(), was_present) << one;
    for (const auto& [first, count] : asked_) {
      for (std::uint64_t at = first; at < first + count; at += block) present[at / block] = true;
    }
    std::size_t first = one;
    std::size_t end = one + 1;
    while (first > 0 && present[first - 1]) --first;
    while (end < present.size() && present[end]) ++end;
    EXPECT_EQ(extent.begin, first * block);
    EXPECT_EQ(extent.end, std::min(file_bytes, end * block));
    EXPECT_TRUE(is_there(extent));
  }
}

TEST_F(SparseFiles, AFileOfTheLargestSizeTakesNoMemoryForWhatIsMissing) {
  constexpr std::uint64_t largest = std::uint64_t{1} << 42;
  std::vector<std::shared_ptr<SparseFile>> files;
  const auto before = mallinfo2();
  for (int i = 0; i < 16; ++i) {
    make(file_bytes, largest);
    files.push_back(file_);
  }
  const auto after = mallinfo2();
  EXPECT_LT(after.uordblks + after.hblkhd - before.uordblks - before.hblkhd, 1U << 20U);
  ASSERT_TRUE(fetch(largest - 10, 10));
  EXPECT_THAT(asked_, ElementsAre(Pair(largest - block, block)));
}

TEST_F(SparseFiles, BlocksThatFailAreStillMissing) {
  fault_ = make_error(ErrorKind::bad_data, "the host failed");
  const auto failed = fetch(5 * block, 1);
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().message, "the host failed");
  fault_.reset();
  ASSERT_TRUE(fetch(5 * block, 1));
  EXPECT_EQ(asked_.size(), 2U);
}

TEST_F(SparseFiles, PartsOfAFileAreLimited) {
  make(3 * block);
  ASSERT_TRUE(fetch(10 * block, 2 * block));
  const auto refused = fetch(20 * block, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::too_large);
  EXPECT_THAT(refused.error().message, HasSubstr("--max-download"));
  EXPECT_TRUE(fetch(11 * block, 1)) << "what is here can be read";
}

TEST_F(SparseFiles, BlocksCountInTheCacheWhichHasNoNameForThem) {
  EXPECT_EQ(cache_->bytes(), block);
  ASSERT_TRUE(fetch(10 * block, 2 * block));
  EXPECT_EQ(cache_->bytes(), 3 * block);
  EXPECT_TRUE(fs::is_empty(folder_)) << "nothing is left if the process is killed";
  file_.reset();
  EXPECT_EQ(cache_->bytes(), 0U);
}

TEST_F(SparseFiles, OtherFilesGiveWayToBlocks) {
  file_.reset();
  cache_ = ObjectCache::open({folder_.native(), 8 * block}).value();
  auto other = cache_->begin();
  ASSERT_TRUE(other->append(std::string(3 * block, 'x')));
  ASSERT_TRUE(cache_->keep("https://h/other", std::move(*other), {}));
  make(file_bytes);
  ASSERT_TRUE(fetch(10 * block, 3 * block));
  EXPECT_TRUE(cache_->find("https://h/other"));
  ASSERT_TRUE(fetch(20 * block, 3 * block));
  EXPECT_FALSE(cache_->find("https://h/other"));
  EXPECT_EQ(cache_->bytes(), 7 * block);
}

TEST_F(SparseFiles, BlocksInUseAreLimitedByTheSizeOfTheCache) {
  file_.reset();
  cache_ = ObjectCache::open({folder_.native(), 8 * block}).value();
  make(file_bytes);
  ASSERT_TRUE(fetch(10 * block, 4 * block));
  asked_.clear();
  const auto refused = fetch(20 * block, 4 * block);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  EXPECT_THAT(refused.error().message, HasSubstr("--data-cache-size"));
  EXPECT_TRUE(asked_.empty());
  EXPECT_EQ(cache_->bytes(), 5 * block);
  fault_ = make_error(ErrorKind::bad_data, "the host failed");
  EXPECT_FALSE(fetch(20 * block, 3 * block));
  EXPECT_EQ(cache_->bytes(), 5 * block) << "what did not come takes no room";
  fault_.reset();
  EXPECT_TRUE(fetch(20 * block, 3 * block));
}

TEST_F(SparseFiles, FilesBeingReceivedCountInTheCache) {
  file_.reset();
  auto part = cache_->begin();
  ASSERT_TRUE(part->append(std::string(3 * block, 'x')));
  EXPECT_EQ(cache_->bytes(), 3 * block);
  ASSERT_TRUE(cache_->keep("https://h/other", std::move(*part), {}));
  EXPECT_GE(cache_->bytes(), 3 * block);
  EXPECT_LT(cache_->bytes(), 4 * block) << "once";
}

TEST_F(SparseFiles, StateFollowsTheValidatorAndSize) {
  const std::string first = file_->state();
  make(file_bytes);
  EXPECT_EQ(file_->state(), first);
  auto part = cache_->begin();
  ASSERT_TRUE(part->append(bytes_of({0, block})));
  Response response;
  response.validators.etag = "\"2\"";
  response.file_bytes = file_bytes;
  EXPECT_NE(SparseFile::make("https://h/a.nc", std::move(*part), response, 1).value()->state(),
            first);
}

// Requests that end when the test says so.
class SparseFlights : public SparseFiles {
 protected:
  using Outcome = std::future<Result<Extent>>;

  void TearDown() override {
    answer();
    SparseFiles::TearDown();
  }
  void answer() {
    if (!std::exchange(is_answered_, true)) answer_.set_value();
  }
  // Each request answers with this error, if any.
  Outcome fetch_later(std::uint64_t offset, std::uint64_t count, std::optional<Error> fault = {},
                      Purpose purpose = Purpose::read) {
    const auto get = [this, fault](ByteRange range, const HttpClient::Sink& sink) -> Result<void> {
      ++requests_;
      answered_.wait();
      if (fault) return *fault;
      EXPECT_TRUE(sink(bytes_of(range)));
      return {};
    };
    // Who waits for the request of another asks whether to give up.
    const auto cancelled = [this] {
      ++waiting_;
      return is_cancelled_.load();
    };
    return std::async(std::launch::async, [this, offset, count, get, cancelled, purpose] {
      return file_->fetch(offset, count, get, cancelled, purpose);
    });
  }
  static void await(const std::atomic<int>& count, int at_least) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (count < at_least && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    ASSERT_GE(count, at_least);
  }

  std::promise<void> answer_;
  std::shared_future<void> answered_ = answer_.get_future().share();
  bool is_answered_ = false;
  std::atomic<int> requests_ = 0;
  std::atomic<int> waiting_ = 0;
  std::atomic<bool> is_cancelled_ = false;
};

TEST_F(SparseFlights, DifferentBlocksAreFetchedAtTheSameTime) {
  std::vector<Outcome> readers;
  for (std::uint64_t i = 0; i < 8; ++i) readers.push_back(fetch_later((5 + 3 * i) * block, 1));
  await(requests_, 8);
  answer();
  for (Outcome& one : readers) EXPECT_TRUE(is_there(one.get().value()));
  EXPECT_EQ(file_->fetched_bytes(), 9 * block);
}

TEST_F(SparseFlights, ReadersOfABlockShareItsRequest) {
  Outcome first = fetch_later(10 * block, 4 * block);
  await(requests_, 1);
  Outcome within = fetch_later(12 * block, 1);
  await(waiting_, 1);
  Outcome beyond = fetch_later(13 * block, 2 * block);
  Outcome before = fetch_later(8 * block, 3 * block);
  await(requests_, 2);
  answer();
  for (Outcome* one : {&first, &within, &beyond, &before})
    EXPECT_TRUE(is_there(one->get().value()));
  EXPECT_EQ(requests_, 3) << "blocks 10-13, 8-9 and 14";
  EXPECT_EQ(file_->fetched_bytes(), 8 * block);
}

TEST_F(SparseFlights, AnErrorReachesAllWhoWaitAndNobodyLater) {
  Outcome first = fetch_later(10 * block, 1, make_error(ErrorKind::bad_data, "the host failed"));
  await(requests_, 1);
  Outcome second = fetch_later(10 * block, 1);
  await(waiting_, 1);
  answer();
  for (Outcome* one : {&first, &second}) {
    const auto failed = one->get();
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().message, "the host failed");
  }
  EXPECT_EQ(requests_, 1);
  EXPECT_TRUE(fetch(10 * block, 1));
}

TEST_F(SparseFlights, ErrorsThatAreNotOfAReaderHaveHimAskAgain) {
  Outcome gone = fetch_later(10 * block, 1, make_error(ErrorKind::cancelled, "it left"));
  Outcome ahead = fetch_later(20 * block, 1, make_error(ErrorKind::bad_data, "the host failed"),
                              Purpose::ahead);
  await(requests_, 2);
  Outcome first = fetch_later(10 * block, 1);
  Outcome second = fetch_later(20 * block, 1);
  await(waiting_, 2);
  answer();
  EXPECT_FALSE(gone.get());
  EXPECT_FALSE(ahead.get());
  EXPECT_TRUE(is_there(first.get().value()));
  EXPECT_TRUE(is_there(second.get().value()));
  EXPECT_EQ(requests_, 4);
}

TEST_F(SparseFlights, WhoWaitsCanBeCancelled) {
  Outcome first = fetch_later(10 * block, 1);
  await(requests_, 1);
  Outcome second = fetch_later(10 * block, 1);
  await(waiting_, 1);
  is_cancelled_ = true;
  const auto left = second.get();
  ASSERT_FALSE(left);
  EXPECT_EQ(left.error().kind, ErrorKind::cancelled);
  answer();
  EXPECT_TRUE(first.get());
}

TEST_F(SparseFlights, AheadOnlyWhatNobodyFetchesIsAskedFor) {
  Outcome reader = fetch_later(10 * block, 2 * block);
  await(requests_, 1);
  Outcome ahead = fetch_later(9 * block, 5 * block, {}, Purpose::ahead);
  await(requests_, 2);
  EXPECT_EQ(waiting_, 0);
  answer();
  EXPECT_TRUE(ahead.get());
  EXPECT_TRUE(reader.get());
  EXPECT_EQ(requests_, 3) << "blocks 9 and 12-13 beside those of the reader";
  EXPECT_EQ(file_->fetched_bytes(), 6 * block);
}

TEST_F(SparseFlights, WhatIsUnderWayCountsInTheLimit) {
  make(3 * block);
  Outcome first = fetch_later(10 * block, 2 * block);
  await(requests_, 1);
  const auto refused = fetch(20 * block, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::too_large);
  answer();
  EXPECT_TRUE(first.get());
}

TEST(ContentRange, IsReadOnlyIfItIsWhole) {
  const auto range = parse_content_range("bytes 5-99/1000");
  ASSERT_TRUE(range);
  EXPECT_EQ(range->first, 5U);
  EXPECT_EQ(range->last, 99U);
  EXPECT_EQ(range->total, 1000U);
  for (const char* text : {"", "bytes", "bytes ", "bytes 5-99/*", "bytes */1000", "bytes 5-99",
                           "bytes 5-99/1000,", "bytes -5-99/1000", "bytes 5-/1000",
                           "octets 5-99/1000", "bytes 5-99/99999999999999999999"}) {
    EXPECT_FALSE(parse_content_range(text)) << text;
  }
}

TEST(ContentRange, IsTheWantedPartOfTheFileOrNone) {
  EXPECT_EQ(bytes_of_part("bytes 5-99/1000", 5, 95, 1000), 95U);
  EXPECT_EQ(bytes_of_part("bytes 5-99/1000", 5, 95, 0), 95U) << "the size is not known yet";
  EXPECT_EQ(bytes_of_part("bytes 900-999/1000", 900, 200, 1000), 100U) << "as far as it has them";
  EXPECT_EQ(bytes_of_part("bytes 900-999/1000", 900, ~std::uint64_t{0}, 1000), 100U);
  EXPECT_FALSE(bytes_of_part("bytes 5-99/1000", 5, 95, 999)) << "another file";
  EXPECT_FALSE(bytes_of_part("bytes 5-98/1000", 5, 95, 1000)) << "fewer";
  EXPECT_FALSE(bytes_of_part("bytes 5-100/1000", 5, 95, 1000)) << "more";
  EXPECT_FALSE(bytes_of_part("bytes 6-100/1000", 5, 95, 1000)) << "others";
  EXPECT_FALSE(bytes_of_part("bytes 1000-1000/1000", 1000, 1, 1000)) << "none";
  EXPECT_FALSE(bytes_of_part("bytes 0-0/0", 0, 1, 0)) << "none";
  EXPECT_FALSE(bytes_of_part("", 0, 1, 0));
}

}  // namespace
}  // namespace windsplat::data::fetch
