// A whole study with a substitute for the integral: caching, skipping and reports.
#include "server/study/study.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "server/study/points_file.hpp"
#include "server/study/report/report.hpp"

namespace windsplat::study {
namespace {

using Json = nlohmann::json;

class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "windsplat-study-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) ADD_FAILURE() << "cannot make a folder";
    path = name;
  }
  ~Folder() { std::filesystem::remove_all(path); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::filesystem::path path;
};

std::string read(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// A uniform grey picture that counts its evaluations.
Truth grey(int& asked) {
  return [&asked](const scene::Scene& scene) -> Result<Picture> {
    ++asked;
    Picture picture{scene.camera.width, scene.camera.height, {}, 7, 70};
    picture.rgba.assign(4 * static_cast<std::size_t>(picture.width) * picture.height, 0.25);
    return picture;
  };
}

std::vector<Subject> vectors_only() { return {standard_subject("vectors", true).value()}; }

Result<Report> study(const Folder& folder, Truth truth, const CancelToken& cancel = {},
                     const Listener& listen = {}) {
  ThreadPool pool(1);
  return run_study(vectors_only(), {folder.path, true, std::move(truth)}, pool, cancel, listen);
}

TEST(Study, SecondRunSkipsEveryPointAndReportsTheSameNumbers) {
  const Folder folder;
  int asked = 0;
  const Report first = study(folder, grey(asked)).value();
  EXPECT_GT(first.measured, 4U);
  EXPECT_EQ(first.skipped, 0U);
  const Report second = study(folder, grey(asked)).value();
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(second.measured, 0U);
  EXPECT_EQ(second.skipped, first.measured);
  EXPECT_EQ(report_csv(second), report_csv(first));
  EXPECT_EQ(second.scenes[0].pieces, 7);
  EXPECT_EQ(second.scenes[0].truth_seconds, first.scenes[0].truth_seconds);
}

TEST(Study, InterruptedStudyContinues) {
  const Folder folder;
  int asked = 0;
  const CancelToken cancel;
  int points = 0;
  const auto stopped = study(folder, grey(asked), cancel, [&](const Progress& progress) {
    if (progress.doing != "reference" && ++points == 3) cancel.cancel();
  });
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().kind, ErrorKind::cancelled);
  const Report resumed = study(folder, grey(asked)).value();
  EXPECT_EQ(resumed.skipped, 2U);
  EXPECT_EQ(asked, 1);
}

TEST(Study, ProgressIsMonotonicAndEndsAtOne) {
  const Folder folder;
  int asked = 0;
  double last = 0;
  ASSERT_TRUE(study(folder, grey(asked), {}, [&](const Progress& progress) {
    EXPECT_GE(progress.done, last);
    EXPECT_LE(progress.done, 1);
    last = progress.done;
  }));
  EXPECT_DOUBLE_EQ(last, 1);
}

TEST(Study, AnotherReferenceGivesAnotherPoint) {
  const Folder folder;
  int asked = 0;
  ASSERT_TRUE(study(folder, grey(asked)));
  const Report extrapolated = study(folder, {}).value();
  EXPECT_EQ(extrapolated.skipped, 0U);
  EXPECT_FALSE(extrapolated.scenes[0].integral);
  EXPECT_TRUE(std::isfinite(extrapolated.scenes[0].truth_estimate));
}

TEST(Study, AnotherToleranceGivesAnotherReferenceAndOtherPoints) {
  const Folder folder;
  int asked = 0;
  ASSERT_TRUE(study(folder, grey(asked)));
  ThreadPool pool(1);
  const Report finer =
      run_study(vectors_only(), {folder.path, true, grey(asked), 1e-9}, pool, {}, {}).value();
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(finer.skipped, 0U);
  EXPECT_EQ(finer.scenes[0].tolerance, 1e-9);
}

TEST(Study, NonFiniteReferenceIsAnErrorAndNotKept) {
  const Folder folder;
  int asked = 0;
  const Truth broken = [&](const scene::Scene& scene) {
    auto picture = grey(asked)(scene);
    picture->rgba[5] = NAN;
    return picture;
  };
  const auto failed = study(folder, broken);
  ASSERT_FALSE(failed);
  EXPECT_NE(failed.error().message.find("vectors"), std::string::npos);
  EXPECT_EQ(study(folder, grey(asked)).value().skipped, 0U);
  EXPECT_EQ(asked, 2);
}

// Unknown times are null, as is the tolerance of a reference that is not an integral.
TEST(Study, UnknownValuesAreNull) {
  Report report;
  report.scenes.emplace_back();
  report.scenes[0].view = vectors_only()[0].view;
  report.scenes[0].integral = false;
  report.scenes[0].truth_seconds = NAN;
  const Json reference = Json::parse(report_json(report)).at("scenes").at(0).at("reference");
  EXPECT_TRUE(reference.at("seconds").is_null());
  EXPECT_TRUE(reference.at("tolerance").is_null());
}

// The slab thickness of the view is not the default; the kernel method has none.
TEST(Report, MarksPointsWithTheViewsOwnSettings) {
  Report report;
  SceneReport scene;
  Subject subject = vectors_only()[0];
  subject.view.method.slab_thickness = 0.5;
  scene.view = subject.view;
  const auto point = [&](scene::Method method, double thickness, int strides) {
    Point one;
    one.setting = {method, scene::Compositing::analytic, own_knobs(subject)};
    one.setting.knobs.slab_thickness = thickness;
    one.setting.knobs.stride *= strides;
    scene.points.push_back(one);
  };
  point(scene::Method::kernel, 1, 2);
  point(scene::Method::kernel, 1, 1);
  point(scene::Method::slab, 1, 1);
  point(scene::Method::slab, 0.5, 1);
  report.scenes.push_back(scene);
  std::vector<bool> own;
  const Json json = Json::parse(report_json(report));
  for (const Json& one : json.at("scenes").at(0).at("points")) own.push_back(one.at("own"));
  EXPECT_EQ(own, (std::vector{false, true, false, true}));
}

// The JSON within a page of a report.
Json data_of(const std::string& page) {
  const std::string opening = "<script type=\"application/json\" id=\"study\">";
  const std::size_t at = page.find(opening);
  if (at == std::string::npos) {
    ADD_FAILURE() << "the page has no data";
    return {};
  }
  const std::size_t start = at + opening.size();
  return Json::parse(page.substr(start, page.find("</script", start) - start));
}

TEST(Report, NamesCannotEndTheScriptElementOfThePage) {
  Report report;
  SceneReport scene;
  scene.name = "a</script><!--<script>\"\\ \xc3\xa9";
  scene.view = vectors_only()[0].view;
  report.scenes.push_back(scene);
  const std::string page = report_page(report).value();
  EXPECT_EQ(data_of(page).at("scenes").at(0).at("name"), scene.name);
  EXPECT_EQ(page.find("<!--"), std::string::npos);
}

TEST(Study, WritesJsonOfTheDocumentedShape) {
  const Folder folder;
  int asked = 0;
  const Report report = study(folder, grey(asked)).value();
  ASSERT_TRUE(write_report(report, folder.path));
  const Json json = Json::parse(read(folder.path / "study.json"));
  for (const char* key : {"processor", "system", "compiler", "windsplat", "threads"}) {
    EXPECT_TRUE(json.at("machine").contains(key)) << key;
  }
  const Json& scene = json.at("scenes").at(0);
  EXPECT_EQ(scene.at("name"), "vectors");
  EXPECT_EQ(scene.at("view").at("dataset"), "blobs");
  EXPECT_EQ(scene.at("reference").at("kind"), "integral");
  EXPECT_EQ(scene.at("reference").at("pieces"), 7);
  ASSERT_EQ(scene.at("points").size(), report.scenes[0].points.size());
  for (const Json& point : scene.at("points")) {
    for (const char* key : {"rmse", "max", "psnr", "flip", "ms", "msMin", "msMax"}) {
      EXPECT_TRUE(point.at(key).is_number()) << key;
    }
    EXPECT_TRUE(point.at("pareto").is_boolean());
    EXPECT_TRUE(point.at("stable").is_boolean());
    EXPECT_TRUE(point.at("method").is_string());
    EXPECT_TRUE(point.at("compositing").is_string());
    EXPECT_TRUE(point.at("knobs").contains("stride"));
    EXPECT_EQ(point.at("knobs").contains("slabThickness"), point.at("method") == "slab");
  }
  EXPECT_EQ(json.at("stability").size(), compositings.size() * stiffness().size());
  EXPECT_EQ(json.at("stability").at(0).at("tau"), 1e-30);
}

TEST(Study, WritesOneLineAPointAndASelfContainedPage) {
  const Folder folder;
  int asked = 0;
  const Report report = study(folder, grey(asked)).value();
  ASSERT_TRUE(write_report(report, folder.path));
  const std::string csv = read(folder.path / "study.csv");
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
            1 + report.scenes[0].points.size());
  const std::string page = read(folder.path / "index.html");
  EXPECT_EQ(page.find("<link"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("%STUDY%"), std::string::npos);
  // Its data is study.json and the pictures.
  Json data = data_of(page);
  const Json pictures = data.at("scenes").at(0).at("pictures");
  data.at("scenes").at(0).erase("pictures");
  EXPECT_EQ(data, Json::parse(read(folder.path / "study.json")));
  ASSERT_EQ(pictures.size(), report.scenes[0].pictures.size());
  EXPECT_FALSE(pictures.at(0).contains("differencePng"));
  for (const Json& picture : pictures) {
    // The signature of PNG in base64; whole groups of four.
    const std::string png = picture.at("png");
    EXPECT_TRUE(png.starts_with("iVBORw0KGgo")) << png.substr(0, 16);
    EXPECT_EQ(png.size() % 4, 0U);
  }
}

TEST(PointsFile, KeepsEveryDigitAndNonFiniteValues) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "points.csv";
  const Measurement m{1.0 / 3, NAN, INFINITY, 1e-300, 0.1, 0.05, 2.0 / 7, false};
  ASSERT_TRUE(PointsFile::open(path).value().append(key_of("a"), m));
  const auto found = PointsFile::open(path).value().find(key_of("a"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->rmse, 1.0 / 3);
  EXPECT_TRUE(std::isnan(found->max));
  EXPECT_EQ(found->psnr, INFINITY);
  EXPECT_EQ(found->flip, 1e-300);
  EXPECT_EQ(found->ms_max, 2.0 / 7);
  EXPECT_FALSE(found->stable);
  EXPECT_FALSE(PointsFile::open(path).value().find(key_of("b")));
}

// A line truncated by a crash is measured again, and later lines are unaffected.
TEST(PointsFile, OmitsATruncatedLine) {
  const Folder folder;
  const std::filesystem::path path = folder.path / "points.csv";
  {
    PointsFile file = PointsFile::open(path).value();
    ASSERT_TRUE(file.append(key_of("a"), {0.5, 0.5, 6, 0.1, 1, 1, 1, true}));
    ASSERT_TRUE(file.append(key_of("b"), {0.25, 0.5, 6, 0.1, 1, 1, 1, true}));
  }
  const std::string whole = read(path);
  const std::size_t last = whole.rfind('\n', whole.size() - 2) + 1;
  for (std::size_t cut = last; cut < whole.size(); ++cut) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << whole.substr(0, cut);
    PointsFile file = PointsFile::open(path).value();
    EXPECT_TRUE(file.find(key_of("a"))) << cut;
    EXPECT_FALSE(file.find(key_of("b"))) << cut;
    ASSERT_TRUE(file.append(key_of("c"), {0.125, 0.5, 6, 0.1, 1, 1, 1, true}));
    const PointsFile again = PointsFile::open(path).value();
    EXPECT_EQ(again.size(), 2U) << cut;
    EXPECT_EQ(again.find(key_of("c"))->rmse, 0.125) << cut;
  }
}

TEST(Key, IsFnv1a) {
  EXPECT_EQ(key_of(""), "cbf29ce484222325");
  EXPECT_EQ(key_of("a"), "af63dc4c8601ec8c");
}

}  // namespace
}  // namespace windsplat::study
