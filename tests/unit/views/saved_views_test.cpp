// Saved views: limits, persistence over a restart, and foreign files in the folder.
#include "server/views/saved_views.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/unit/disk.hpp"

namespace windsplat::views {
namespace {

namespace fs = std::filesystem;
using protocol::SavedView;
using protocol::ViewDocument;
using testing::HasSubstr;

constexpr const char* time_of_all = "2001-01-01T03:00:00Z";

ViewDocument view_of_step(int step) {
  return ViewDocument::parse("{\"step\":" + std::to_string(step) + "}").value();
}

bool always(const SavedView&) { return true; }

Result<std::optional<SavedView>> set_step(SavedViews& views, const std::string& id, int step) {
  return views.replace(id, always, [step](const ViewDocument&) { return view_of_step(step); });
}

std::size_t bytes_of(const SavedView& saved) { return protocol::encode_view_file(saved).size(); }

TEST(SavedViewsFolder, WorldWritableFolderIsReported) {
  const test::Folder folder;
  const auto warnings = [&](fs::perms state, fs::perms views) {
    fs::create_directories(folder / "state/views");
    fs::permissions(folder / "state", state);
    fs::permissions(folder / "state/views", views);
    testing::internal::CaptureStderr();
    EXPECT_TRUE(SavedViews::open({folder / "state"}));
    std::istringstream log(testing::internal::GetCapturedStderr());
    std::string out;
    for (std::string line; std::getline(log, line);) {
      if (line.find("mode=") != std::string::npos) out += line + '\n';
    }
    return out;
  };
  const fs::perms group = fs::perms::owner_all | fs::perms::group_all;
  const fs::perms all = fs::perms::all;
  EXPECT_EQ(warnings(group, group | fs::perms::others_read), "");
  EXPECT_EQ(warnings(all | fs::perms::sticky_bit, group), "");
  const std::string state = warnings(all, group);
  EXPECT_THAT(state, HasSubstr("/state mode=0777"));
  EXPECT_THAT(state, testing::Not(HasSubstr("/views")));
  EXPECT_THAT(warnings(group, all), HasSubstr("/state/views mode=0777"));
}

TEST(SavedViewsInMemory, AreFoundByTheirIds) {
  const auto views = SavedViews::open({}).value();
  EXPECT_FALSE(views->on_disk());
  std::set<std::string> ids;
  for (int step = 0; step < 100; ++step) {
    const auto saved = views->add(view_of_step(step), time_of_all);
    ASSERT_TRUE(saved);
    EXPECT_TRUE(protocol::is_view_id(saved->id)) << saved->id;
    ids.insert(saved->id);
    EXPECT_EQ(views->find(saved->id)->view.view().step, step);
    EXPECT_EQ(views->find(saved->id)->created, time_of_all);
  }
  EXPECT_EQ(ids.size(), 100U);
  // A biased random generator would omit letters: 1000 ids miss one of 32 once in 10^12 runs.
  std::set<char> letters;
  for (const std::string& id : ids) letters.insert(id.begin(), id.end());
  EXPECT_EQ(letters.size(), 32U);
}

TEST(SavedViewsInMemory, MissingViewIsNotFound) {
  const auto views = SavedViews::open({}).value();
  for (const std::string id : {"0123456789", "", "..", "../views", "/etc/passwd"}) {
    EXPECT_EQ(views->find(id).error().kind, ErrorKind::not_found) << id;
    EXPECT_EQ(set_step(*views, id, 1).error().kind, ErrorKind::not_found) << id;
    EXPECT_EQ(views->remove(id, always).error().kind, ErrorKind::not_found) << id;
  }
}

TEST(SavedViewsInMemory, FullStoreRefusesAndKeepsItsViews) {
  const auto views = SavedViews::open({{}, 3}).value();
  std::vector<std::string> ids;
  for (int step = 0; step < 3; ++step) {
    ids.push_back(views->add(view_of_step(step), time_of_all)->id);
  }
  const auto refused = views->add(view_of_step(3), time_of_all);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  EXPECT_THAT(refused.error().message, HasSubstr("3 views"));
  for (int step = 0; step < 3; ++step) {
    EXPECT_EQ(views->find(ids[static_cast<std::size_t>(step)])->view.view().step, step);
  }
  EXPECT_TRUE(set_step(*views, ids[0], 9)) << "needs no space";
  EXPECT_TRUE(views->remove(ids[1], always).value());
  EXPECT_TRUE(views->add(view_of_step(3), time_of_all));
  EXPECT_FALSE(views->add(view_of_step(4), time_of_all));
}

TEST(SavedViewsInMemory, BytesFollowAdditionsChangesAndRemovals) {
  const std::size_t one = bytes_of({"0123456789", time_of_all, view_of_step(1)});
  const auto views = SavedViews::open({{}, 100, 2 * one + 1}).value();
  const std::string first = views->add(view_of_step(1), time_of_all)->id;
  const std::string second = views->add(view_of_step(2), time_of_all)->id;
  const auto refused = views->add(view_of_step(3), time_of_all);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::out_of_memory);
  EXPECT_THAT(refused.error().message, HasSubstr("bytes"));
  EXPECT_TRUE(set_step(*views, first, 10)) << "one byte is left";
  EXPECT_FALSE(set_step(*views, second, 10)) << "and now none";
  EXPECT_EQ(views->find(second)->view.view().step, 2);
  EXPECT_TRUE(set_step(*views, first, 1));
  EXPECT_TRUE(set_step(*views, second, 10)) << "it is available again";
  EXPECT_TRUE(views->remove(first, always).value());
  EXPECT_TRUE(views->add(view_of_step(3), time_of_all));
}

TEST(SavedViewsInMemory, ConditionalChangeIsMadeOnlyWhenItsConditionHolds) {
  const auto views = SavedViews::open({}).value();
  const std::string id = views->add(view_of_step(1), time_of_all)->id;
  const auto never = [](const SavedView&) { return false; };
  const auto kept = views->replace(id, never, [](const ViewDocument&) -> Result<ViewDocument> {
    ADD_FAILURE() << "requested although it may not change";
    return view_of_step(2);
  });
  ASSERT_TRUE(kept);
  EXPECT_FALSE(*kept);
  EXPECT_FALSE(views->remove(id, never).value());
  const auto failed = views->replace(
      id, always, [](const ViewDocument& now) { return now.patched(R"({"step":-1})"); });
  EXPECT_EQ(failed.error().kind, ErrorKind::invalid);
  EXPECT_EQ(views->find(id)->view.view().step, 1);
}

TEST(SavedViewsInMemory, ManyThreadsAddChangeAndReadConcurrently) {
  const auto views = SavedViews::open({}).value();
  const std::string shared = views->add(view_of_step(0), time_of_all)->id;
  std::atomic<int> bad{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 200; ++i) {
        const auto own = views->add(view_of_step(i), time_of_all);
        if (!own || views->find(own->id)->view.view().step != i) ++bad;
        // Each call adds one to the current value: no increment may be lost.
        const auto add = [](const ViewDocument& now) { return view_of_step(now.view().step + 1); };
        if (!views->replace(shared, always, add)) ++bad;
        if (i % 2 == 0 && !views->remove(own->id, always)) ++bad;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(bad, 0);
  EXPECT_EQ(views->find(shared)->view.view().step, 800);
}

// --- in a folder --------------------------------------------------------------------------------

class SavedViewsOnDisk : public testing::Test {
 protected:
  [[nodiscard]] fs::path state() const { return root_ / "deep" / "state"; }
  [[nodiscard]] fs::path file_of(const std::string& id) const {
    return state() / "views" / (id + ".json");
  }
  [[nodiscard]] Result<std::shared_ptr<SavedViews>> open() const {
    return SavedViews::open({state()});
  }
  // Every file below the views folder with its content, or the kind of other entries.
  [[nodiscard]] std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> out;
    for (const auto& entry : fs::directory_iterator(state() / "views")) {
      const bool plain = fs::is_regular_file(entry.symlink_status());
      std::ifstream file(plain ? entry.path() : "/dev/null", std::ios::binary);
      out[entry.path().filename()] =
          plain ? std::string(std::istreambuf_iterator<char>(file), {}) : "no file";
    }
    return out;
  }

  test::Folder root_;
};

TEST_F(SavedViewsOnDisk, SurviveARestart) {
  std::map<std::string, std::string> told;
  std::string gone;
  {
    const auto views = open().value();
    EXPECT_TRUE(views->on_disk());
    for (int step = 0; step < 20; ++step) {
      const auto saved = views->add(view_of_step(step), time_of_all);
      told[saved->id] = protocol::encode_view_file(*saved);
    }
    const std::string changed = told.begin()->first;
    told[changed] = protocol::encode_view_file(**set_step(*views, changed, 77));
    gone = told.rbegin()->first;
    EXPECT_TRUE(views->remove(gone, always).value());
    told.erase(gone);
    EXPECT_EQ(files().size(), told.size()) << "one file per view, and nothing else";
  }
  const auto views = open().value();
  for (const auto& [id, text] : told) {
    const auto found = views->find(id);
    ASSERT_TRUE(found) << id;
    EXPECT_EQ(protocol::encode_view_file(*found), text);
  }
  EXPECT_FALSE(views->find(gone));
  EXPECT_EQ(set_step(*views, told.begin()->first, 5).value()->created, time_of_all);
}

TEST_F(SavedViewsOnDisk, CountAgainstTheLimitsAfterARestart) {
  std::string id;
  {
    const auto views = open().value();
    id = views->add(view_of_step(0), time_of_all)->id;
    EXPECT_TRUE(views->add(view_of_step(1), time_of_all));
  }
  {
    const auto views = SavedViews::open({state(), 2}).value();
    EXPECT_FALSE(views->add(view_of_step(2), time_of_all));
  }
  const std::size_t bytes = 2 * bytes_of({id, time_of_all, view_of_step(0)});
  const auto views = SavedViews::open({state(), 9, bytes}).value();
  EXPECT_FALSE(views->add(view_of_step(2), time_of_all));
  EXPECT_FALSE(set_step(*views, id, 10));
}

// A lower limit than before: views above it remain on disk.
TEST_F(SavedViewsOnDisk, NoneIsRemovedToMeetALimit) {
  {
    const auto views = open().value();
    for (int step = 0; step < 5; ++step) EXPECT_TRUE(views->add(view_of_step(step), time_of_all));
  }
  const auto before = files();
  EXPECT_TRUE(SavedViews::open({state(), 2}));
  EXPECT_EQ(files(), before);
}

TEST_F(SavedViewsOnDisk, TruncatedAndForeignFilesAreIgnoredAndKept) {
  std::string good;
  {
    const auto views = open().value();
    good = views->add(view_of_step(4), time_of_all)->id;
  }
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(state() / "views" / name, std::ios::binary) << text;
  };
  const std::string text = files()[good + ".json"];
  const auto renamed = [&](const std::string& id) {
    std::string out = text;
    return out.replace(out.find(good), good.size(), id);
  };
  write("0000000000.json", renamed("0000000000").substr(0, text.size() / 2));  // truncated
  write("1111111111.json", "");
  write("2222222222.json", renamed("bbbbbbbbbb"));  // id of another view
  write("3333333333.json", renamed("3333333333") + std::string(70000, ' '));
  write("4444444444.json.part", renamed("4444444444"));
  write("notes.json.1234.part", renamed("4444444444"));
  write("UPPERCASE0.json", renamed("5555555555"));
  write("5555555555.txt", renamed("5555555555"));
  write("666666666.json", renamed("6666666666"));
  write("secret", renamed("7777777777"));
  fs::create_symlink("../../../secret", state() / "views" / "8888888888.json");
  std::ofstream(root_ / "secret") << renamed("8888888888");
  fs::create_directory(state() / "views" / "9999999999.json");
  ASSERT_EQ(mkfifo((state() / "views" / "aaaaaaaaaa.json").c_str(), 0600), 0);

  const auto before = files();
  const auto views = open().value();
  EXPECT_EQ(views->find(good)->view.view().step, 4);
  for (const char letter : std::string("0123456789ab")) {
    EXPECT_FALSE(views->find(std::string(10, letter))) << letter;
  }
  const auto added = views->add(view_of_step(5), time_of_all);
  EXPECT_TRUE(set_step(*views, good, 6));
  EXPECT_TRUE(set_step(*views, good, 4));
  EXPECT_TRUE(views->remove(added->id, always).value());
  EXPECT_EQ(files(), before);
}

TEST_F(SavedViewsOnDisk, UnfinishedWriteIsRemoved) {
  std::string good;
  {
    const auto views = open().value();
    good = views->add(view_of_step(4), time_of_all)->id;
  }
  const auto before = files();
  std::ofstream(state() / "views" / (good + ".json.1234.part")) << "{";
  std::ofstream(state() / "views" / "4444444444.json.77.part") << "{}";
  ASSERT_NE(files(), before);
  EXPECT_EQ(open().value()->find(good)->view.view().step, 4);
  EXPECT_EQ(files(), before);
}

TEST_F(SavedViewsOnDisk, FailedWriteChangesNothing) {
  const auto views = SavedViews::open({state(), 2}).value();
  const std::string id = views->add(view_of_step(1), time_of_all)->id;
  const auto before = files();
  Result<SavedView> added = make_error(ErrorKind::internal, "");
  Result<std::optional<SavedView>> changed = std::optional<SavedView>();
  {
    const test::FullDisk disk(10);
    added = views->add(view_of_step(2), time_of_all);
    changed = set_step(*views, id, 2);
  }
  ASSERT_FALSE(added);
  ASSERT_FALSE(changed);
  for (const Error& error : {added.error(), changed.error()}) {
    EXPECT_EQ(error.message.find(root_.path().native()), std::string::npos)
        << "paths are not shown to clients";
  }
  EXPECT_EQ(files(), before);
  EXPECT_EQ(views->find(id)->view.view().step, 1);
  EXPECT_TRUE(views->add(view_of_step(2), time_of_all)) << "a failed view takes no space";
  EXPECT_FALSE(views->add(view_of_step(3), time_of_all));
}

// Both folders can be read but not written, even by root.
class ReadOnly {
 public:
  explicit ReadOnly(const fs::path& root) : root_(root), user_(::geteuid()) {
    set(fs::perms(0555));
    constexpr uid_t nobody = 65534;
    EXPECT_EQ(user_ == 0 ? ::seteuid(nobody) : 0, 0);
  }
  ~ReadOnly() {
    EXPECT_EQ(::seteuid(user_), 0);
    set(fs::perms::owner_all);
  }
  ReadOnly(const ReadOnly&) = delete;
  ReadOnly& operator=(const ReadOnly&) = delete;

 private:
  void set(fs::perms permissions) const {
    fs::permissions(root_, permissions);
    for (const auto& inside : fs::recursive_directory_iterator(root_)) {
      fs::permissions(inside, permissions);
    }
  }

  fs::path root_;
  uid_t user_;
};

TEST_F(SavedViewsOnDisk, ReadOnlyFolderServesItsViewsAndRefusesChangesWithTheReason) {
  const auto views = open().value();
  const std::string id = views->add(view_of_step(1), time_of_all)->id;
  {
    const ReadOnly disk(root_.path());
    EXPECT_TRUE(views->find(id));
    const std::vector<Error> refused{views->add(view_of_step(2), time_of_all).error(),
                                     set_step(*views, id, 2).error(),
                                     views->remove(id, always).error()};
    for (const Error& error : refused) {
      EXPECT_EQ(error.kind, ErrorKind::out_of_memory) << error.message;
      EXPECT_THAT(error.message, HasSubstr("Permission denied"));
      EXPECT_EQ(error.message.find(root_.path().native()), std::string::npos);
    }
  }
  EXPECT_TRUE(set_step(*views, id, 3)) << "it is writable again";
}

TEST_F(SavedViewsOnDisk, MissingFolderIsCreatedByTheFirstChange) {
  const auto views = open().value();
  fs::remove_all(state() / "views");
  const auto saved = views->add(view_of_step(4), time_of_all);
  ASSERT_TRUE(saved) << saved.error().message;
  EXPECT_EQ(files().count(saved->id + ".json"), 1U);
}

TEST_F(SavedViewsOnDisk, ReadOnlyFolderIsOpenedAndRead) {
  const std::string id = open().value()->add(view_of_step(1), time_of_all)->id;
  fs::create_directory(root_ / "empty");
  const ReadOnly disk(root_.path());
  const auto views = open();
  ASSERT_TRUE(views) << views.error().message;
  EXPECT_EQ((*views)->find(id)->view.view().step, 1);
  const auto without = SavedViews::open({root_ / "empty"});
  ASSERT_TRUE(without) << without.error().message;
  EXPECT_EQ((*without)->add(view_of_step(1), time_of_all).error().kind, ErrorKind::out_of_memory);
}

TEST_F(SavedViewsOnDisk, IdOfAnExistingFileIsNotReused) {
  const auto views = open().value();
  const std::string id = views->add(view_of_step(1), time_of_all)->id;
  fs::remove(file_of(id));
  EXPECT_TRUE(views->remove(id, always).value()) << "its file was removed externally";
  EXPECT_FALSE(views->find(id));
}

TEST_F(SavedViewsOnDisk, OneProcessAtATimeLocksTheFolder) {
  auto views = open().value();
  const auto second = open();
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().kind, ErrorKind::invalid);
  EXPECT_THAT(second.error().message, HasSubstr("in use"));
  views.reset();
  EXPECT_TRUE(open());
}

TEST_F(SavedViewsOnDisk, PathThatIsNoFolderIsRefused) {
  std::ofstream(root_ / "deep") << "a file";
  const auto refused = open();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::invalid);
  EXPECT_THAT(refused.error().message, HasSubstr("deep/state"));
  fs::remove(root_ / "deep");
  fs::create_directories(state());
  std::ofstream(state() / "views") << "a file";
  EXPECT_FALSE(open());
}

TEST_F(SavedViewsOnDisk, AreAccessibleToTheOwnerOnly) {
  const auto views = open().value();
  EXPECT_EQ(fs::status(state() / "views").permissions(), fs::perms::owner_all);
}

}  // namespace
}  // namespace windsplat::views
