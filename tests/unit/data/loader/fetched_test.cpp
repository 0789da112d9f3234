// Files that take the daemon long to provide, or of which it cannot tell whether they exist.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "server/data/loader/loader.hpp"
#include "tests/unit/data/loader/loader_fixture.hpp"
#include "tests/unit/data/loader_files.hpp"

namespace windsplat::data::loader {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

// Local files that are provided as if they were fetched.
class SlowFiles final : public Files {
 public:
  SlowFiles(Location location, milliseconds time, bool faulty)
      : direct_(direct_files(location)),
        location_(std::move(location)),
        time_(time),
        faulty_(faulty) {
    location_.fetched = true;
  }
  [[nodiscard]] const Location& location() const override { return location_; }
  Result<std::shared_ptr<const InputFile>> open(const std::string& name) override {
    std::this_thread::sleep_for(time_);
    return direct_->open(name);
  }
  Result<std::vector<std::string>> list(const std::string& folder) override {
    return direct_->list(folder);
  }
  bool exists(const std::string& name) override { return direct_->exists(name); }
  std::optional<Error> take_fault() override {
    if (!std::exchange(faulty_, false)) return {};
    return make_error(ErrorKind::bad_data, "the host failed");
  }

 private:
  std::shared_ptr<Files> direct_;
  Location location_;
  milliseconds time_;
  bool faulty_;
};

class FetchedLoader : public Loader {
 protected:
  Result<std::unique_ptr<RemoteSource>> open_slowly(milliseconds time, Limits limits,
                                                    bool faulty = false) {
    const std::string path = folder_ / "wind.nc";
    test::write_wind(path, 0);
    const Location local = locate(path).value();
    limits.files = [local, time, faulty](const Location&, const std::function<bool()>&) {
      return std::make_shared<SlowFiles>(local, time, faulty);
    };
    Location location = local;
    location.fetched = true;
    return open(std::move(location), std::move(limits));
  }
};

TEST_F(FetchedLoader, TimeOfFetchingIsNotThatOfTheLoader) {
  Limits limits;
  // Two fetches take longer than the loader may; it has time enough on a busy machine.
  limits.open_time = milliseconds(3000);
  limits.fetch_time = milliseconds(30'000);
  const auto source = open_slowly(milliseconds(2000), limits);
  ASSERT_TRUE(source) << source.error().message;
  EXPECT_TRUE((*source)->read(0, 0));
}

TEST_F(FetchedLoader, TimeOfFetchingIsLimited) {
  Limits limits;
  limits.open_time = milliseconds(1500);
  limits.fetch_time = milliseconds(100);
  const auto source = open_slowly(milliseconds(2000), limits);
  ASSERT_FALSE(source);
  EXPECT_THAT(source.error().message, HasSubstr("was terminated after 1.6 s"));
}

TEST_F(FetchedLoader, AFileOfUnknownExistenceIsAnErrorEvenIfTheLoaderSucceeds) {
  const auto source = open_slowly(milliseconds(0), {}, true);
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().message, "the host failed");
}

}  // namespace
}  // namespace windsplat::data::loader
