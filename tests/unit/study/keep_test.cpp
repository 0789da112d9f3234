// The cache of a study and its reuse: keys, references and foreign files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include "server/study/keys.hpp"
#include "server/study/points_file.hpp"
#include "server/study/truth_file.hpp"

namespace windsplat::study {
namespace {

class Keep : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-keep-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder = name;
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  static std::string read(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  std::filesystem::path folder;
};

TEST(Keys, ChangeWithEveryInputOfAPoint) {
  const Subject subject = standard_subject("vectors", true).value();
  const Machine machine = this_machine(2).value();
  EXPECT_EQ(machine.program.size(), 16U);
  const Setting setting{scene::Method::kernel, scene::Compositing::analytic, own_knobs(subject)};
  std::set<std::string> keys;
  const auto key = [&](const Subject& s, const Setting& at, const Machine& m,
                       const Measuring& how) {
    EXPECT_EQ(point_key(s, at, m, how), point_key(s, at, m, how));
    keys.insert(point_key(s, at, m, how));
  };
  key(subject, setting, machine, {true, 1e-7, 3});
  key(subject, setting, machine, {true, 1e-6, 3});
  key(subject, setting, machine, {false, 1e-7, 3});
  key(subject, setting, machine, {true, 1e-7, 9});
  for (std::string Machine::*member : {&Machine::processor, &Machine::program, &Machine::kernels}) {
    Machine other = machine;
    other.*member += '-';
    key(subject, setting, other, {true, 1e-7, 3});
  }
  Machine wider = machine;
  ++wider.threads;
  key(subject, setting, wider, {true, 1e-7, 3});
  Subject seen = subject;
  seen.view.camera.up = {0, 1, 0};
  key(seen, setting, machine, {true, 1e-7, 3});
  Setting half = setting;
  half.knobs.width /= 2;
  key(subject, half, machine, {true, 1e-7, 3});
  EXPECT_EQ(keys.size(), 10U);
}

// Independent of inputs that affect the time only.
TEST(Keys, OfAReferenceChangeWithToleranceAndProgramOnly) {
  const Subject subject = standard_subject("vectors", true).value();
  const Machine machine = this_machine(2).value();
  const std::string key = truth_key(subject, machine, 1e-7);
  EXPECT_NE(truth_key(subject, machine, 1e-6), key);
  Machine other = machine;
  other.program += '-';
  EXPECT_NE(truth_key(subject, other, 1e-7), key);
  other = machine;
  ++other.threads;
  other.processor += '-';
  EXPECT_EQ(truth_key(subject, other, 1e-7), key);
}

TEST_F(Keep, ReferenceIsRestoredWithItsTimeAndTolerance) {
  const auto path = folder / "truth";
  ASSERT_TRUE(write_truth(path, {{1, 2, {1, 2, 3, 4, 5, 6, 7, 1.0 / 3}, 11, 12}, 2.5, 1e-7}));
  const auto kept = read_truth(path, 1, 2, 1e-7);
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->picture.rgba, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 1.0 / 3}));
  EXPECT_EQ(kept->picture.pieces, 11);
  EXPECT_EQ(kept->picture.evaluations, 12);
  EXPECT_EQ(kept->seconds, 2.5);
  EXPECT_EQ(kept->tolerance, 1e-7);
  EXPECT_FALSE(read_truth(path, 1, 2, 1e-6));
  EXPECT_FALSE(read_truth(path, 2, 1, 1e-7));
}

TEST_F(Keep, DamagedOrNonFiniteReferenceIsNotReused) {
  const auto path = folder / "truth";
  ASSERT_TRUE(write_truth(path, {{1, 1, {1, 2, 3, 4}, 11, 12}, 2.5, 1e-7}));
  const std::string whole = read(path);
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    std::ofstream(path, std::ios::binary | std::ios::trunc) << damaged;
    EXPECT_FALSE(read_truth(path, 1, 1, 1e-7)) << at;
  }
  ASSERT_TRUE(write_truth(path, {{1, 1, {1, NAN, 3, 4}, 11, 12}, 2.5, 1e-7}));
  EXPECT_FALSE(read_truth(path, 1, 1, 1e-7));
}

TEST_F(Keep, ForeignPointsFileIsAnErrorAndIsKept) {
  const auto path = folder / "points.csv";
  for (const std::string text : {"x,y\n1,2\n", "x", "key,rmse\n", "\n"}) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << text;
    const auto opened = PointsFile::open(path);
    ASSERT_FALSE(opened) << text;
    EXPECT_EQ(opened.error().kind, ErrorKind::bad_data);
    EXPECT_NE(opened.error().message.find("points.csv"), std::string::npos);
    EXPECT_EQ(read(path), text);
  }
}

TEST_F(Keep, UnreadablePointsFileIsAnError) {
  const auto path = folder / "points.csv";
  std::filesystem::create_directory(path);
  const auto opened = PointsFile::open(path);
  ASSERT_FALSE(opened);
  EXPECT_NE(opened.error().message.find("cannot read"), std::string::npos);
  EXPECT_NE(opened.error().message.find("points.csv"), std::string::npos);
  EXPECT_TRUE(std::filesystem::is_directory(path));
}

}  // namespace
}  // namespace windsplat::study
