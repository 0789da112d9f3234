// Strided lines at full detail, drawn from the middles of their kernels alone.
#include "server/data/model/middles.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/annotate/annotate.hpp"
#include "server/annotate/legend.hpp"
#include "server/data/model/stored.hpp"
#include "server/frame/content.hpp"
#include "server/frame/empty_picture.hpp"
#include "server/frame/pick/pick.hpp"
#include "server/frame/pixel_trials.hpp"
#include "server/scene/build.hpp"
#include "server/scene/level/choice.hpp"
#include "server/scene/level/stand_in.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/unit/frame/part_store.hpp"

namespace windsplat::frame {
namespace {

using namespace of_store;  // NOLINT(google-build-using-namespace)
using data::StoredAs;

// What was read of the wind.
struct WindLog {
  int wholes = 0;
  std::vector<data::StoredPart> parts;
};

class LoggedStore final : public data::Source {
 public:
  explicit LoggedStore(std::shared_ptr<WindLog> log)
      : log_(std::move(log)), source_(cloud_and_wind(false)) {}
  [[nodiscard]] const data::DatasetInfo& info() const override { return source_->info(); }
  Result<data::Volume> read(std::size_t field, std::size_t step) override {
    log_->wholes += field == 1 ? 1 : 0;
    return source_->read(field, step);
  }
  Result<data::Volume> read_part(std::size_t field, std::size_t step,
                                 const data::StoredPart& part) override {
    if (field == 1) log_->parts.push_back(part);
    return source_->read_part(field, step, part);
  }

 private:
  std::shared_ptr<WindLog> log_;
  std::unique_ptr<data::Source> source_;
};

struct Logged {
  explicit Logged(std::uint64_t bytes)
      : dataset(std::make_unique<LoggedStore>(log), "store", bytes) {}
  std::shared_ptr<WindLog> log = std::make_shared<WindLog>();
  data::Dataset dataset;
};

protocol::View of_lines(int stride) {
  protocol::View view = of_one_voxel();
  view.camera.height = 0.6;
  view.vector.field = {protocol::FieldChoice::Kind::named, "wind"};
  view.vector.stride = stride;
  view.vector.length = 0.05;
  view.vector.magnitude_range = {0.0, 2.0};
  view.method.detail = protocol::Detail::full;
  return view;
}

// Its defaults need samples too.
scene::CompletedView completed_of(const protocol::View& view) {
  static data::Dataset roomy = store(100 * samples_bytes);
  return scene::complete(view, roomy).value();
}

TEST(Middles, LinesOfTheWholeReadNothingElse) {
  for (const int stride : {2, 4, 8}) {
    Logged of(100 * samples_bytes);
    const auto scene = scene::build_scene(completed_of(of_lines(stride)), of.dataset).value();
    EXPECT_EQ(scene.level, (std::array{0, 0, 0}));
    EXPECT_FALSE(scene.lattice.part);
    EXPECT_EQ(of.log->wholes, 0);
    ASSERT_EQ(of.log->parts.size(), 1U);
    EXPECT_EQ(of.log->parts[0].as, StoredAs::strided);
    EXPECT_EQ(1 << of.log->parts[0].level, stride);
    std::uint64_t kernels = 1;
    for (const int samples : dims) kernels *= static_cast<unsigned>((samples - 1) / stride + 1);
    EXPECT_EQ(scene.vector->field->bytes(), kernels * 3 * sizeof(float));
  }
}

TEST(Middles, LinesOfABoxReadThoseInIt) {
  // Neither the cloud nor the wind fits.
  Logged of(samples_bytes);
  protocol::View view = of_lines(2);
  view.camera.height = 0.004;
  view.vector.length = 0.001;
  const auto scene = scene::build_scene(completed_of(view), of.dataset).value();
  EXPECT_EQ(scene.level, (std::array{0, 0, 0}));
  ASSERT_TRUE(scene.lattice.part);
  EXPECT_EQ(of.log->wholes, 0);
  ASSERT_EQ(of.log->parts.size(), 1U);
  EXPECT_EQ(of.log->parts[0].as, StoredAs::strided);
  EXPECT_EQ(of.log->parts[0].box, data::strided_box(scene.lattice.held(), 2));
  EXPECT_LT(of.log->parts[0].box.samples(), scene.lattice.part->samples() / 6);
}

TEST(Middles, AChangeOfStrideOfAResidentWindReadsNothing) {
  Logged of(100 * samples_bytes);
  ASSERT_TRUE(scene::build_scene(completed_of(of_lines(3)), of.dataset));
  for (const int stride : {2, 4, 8}) {
    const auto completed = completed_of(of_lines(stride));
    const auto scene = scene::build_scene(completed, of.dataset).value();
    EXPECT_EQ(scene.vector->field_stride, stride);
    Logged other(100 * samples_bytes);
    const auto read = scene::build_scene(completed, other.dataset).value();
    EXPECT_EQ(test::render(scene, 1).image.rgba, test::render(read, 1).image.rgba);
    EXPECT_EQ(scene.vector->field->masked, read.vector->field->masked);
    EXPECT_EQ(scene.vector->field->range, read.vector->field->range);
  }
  EXPECT_EQ(of.log->wholes, 1);
  EXPECT_TRUE(of.log->parts.empty());
}

// What the samples between them are needed for.
TEST(Middles, EverySampleIsReadWhereLinesAreNotAlone) {
  const auto reads_all = [](const protocol::View& view) {
    Logged of(100 * samples_bytes);
    const auto scene = scene::build_scene(completed_of(view), of.dataset);
    EXPECT_TRUE(scene) << scene.error().message;
    return of.log->wholes == 1 && of.log->parts.empty() && scene->vector->field_stride == 1;
  };
  EXPECT_FALSE(reads_all(of_lines(4)));
  EXPECT_TRUE(reads_all(of_lines(1)));
  EXPECT_TRUE(reads_all(of_lines(3))) << "middles that are not stored";
  protocol::View view = of_lines(4);
  view.scalars->front().stride = 4;
  EXPECT_TRUE(reads_all(view)) << "a medium of the same stride";
  view.scalars->front().stride = 2;
  EXPECT_FALSE(reads_all(view)) << "a medium of another stride";
  view = of_lines(4);
  view.light.emplace();
  EXPECT_TRUE(reads_all(view)) << "light of samples";
  view = of_lines(4);
  view.vector.color.by = protocol::ColorBy::scalar;
  view.vector.color.field = "cloud";
  EXPECT_TRUE(reads_all(view)) << "colours of samples";
  view = of_lines(4);
  view.geometry.slice = protocol::SliceView{protocol::GridAxis::z, 30};
  EXPECT_TRUE(reads_all(view)) << "a slice";
  view = of_lines(4);
  view.region.x = {0.0, 4000.0};
  EXPECT_TRUE(reads_all(view)) << "a region";
}

TEST(Middles, FitWhereTheSamplesDoNot) {
  // A cloud of one part and a wind of three; with stride 4 a wind of a twentieth.
  data::Dataset dataset = store(samples_bytes * 3 / 2);
  const auto part_at = [&](int stride) {
    protocol::View view = of_lines(stride);
    view.camera.height = 0.004;  // of which a box fits at any stride
    view.vector.length = 0.001;
    return scene::part_of(completed_of(view), dataset);
  };
  EXPECT_EQ(part_at(4).halvings, (std::array{0, 0, 0}));
  EXPECT_FALSE(part_at(4).held);
  EXPECT_TRUE(part_at(3).held) << "the whole wind does not fit";
  EXPECT_TRUE(scene::build_scene(completed_of(of_lines(4)), dataset));
}

TEST(Middles, OfLinesAloneABoxIsDrawnWhereTheWholeDoesNotFit) {
  // Middles of 3/8 parts.
  data::Dataset dataset = store(samples_bytes / 3);
  protocol::View view = of_lines(2);
  view.scalars->clear();
  view.camera.height = 0.004;
  view.vector.length = 0.001;
  view.method.detail = protocol::Detail::automatic;
  const auto part = scene::part_of(completed_of(view), dataset);
  EXPECT_EQ(part.halvings, (std::array{0, 0, 0}));
  EXPECT_TRUE(part.held);
  EXPECT_EQ(part.wanted, (std::array{0, 0, 0}));
}

TEST(Middles, AnOutlineHasTheDefaultStrideOfTheStore) {
  protocol::View view = of_lines(1);
  view.vector.stride.reset();
  const auto stride_in = [&](data::Dataset dataset) {
    const int stride = scene::outline(view, dataset).value().view.vector.stride.value();
    EXPECT_EQ(stride, scene::complete(view, dataset).value().view().vector.stride);
    return stride;
  };
  const int stride = stride_in(store(100 * samples_bytes));
  EXPECT_GT(stride_in(store(samples_bytes)), stride) << "of which the middles are stored";
}

TEST(Middles, AnEmptyPictureIsExplainedByTheRangeOfTheField) {
  data::Dataset dataset = store(100 * samples_bytes);
  const auto why = [&](int stride) {
    protocol::View view = of_lines(stride);
    view.scalars->clear();
    view.vector.min_magnitude = 100;
    const auto completed = completed_of(view);
    const auto scene = scene::build_scene(completed, dataset).value();
    EXPECT_EQ(scene.vector->field_stride, stride == 3 ? 1 : stride);
    return why_empty(scene, completed.view(), dataset, {}, engine::WorkReport(), true);
  };
  const std::string wanted = why(3);  // by all samples
  EXPECT_NE(wanted.find("is below /vector/minMagnitude 100"), std::string::npos) << wanted;
  EXPECT_EQ(why(8), wanted);
}

TEST(Middles, APickHasTheVectorOfTheKernel) {
  data::Dataset dataset = store(100 * samples_bytes);
  protocol::View view = of_lines(4);
  view.scalars->clear();
  view.camera.height = 0.3;
  const auto scene = scene::build_scene(completed_of(view), dataset).value();
  ASSERT_EQ(scene.vector->field_stride, 4);
  const auto wind = dataset.volume("wind", 0).value();
  int found = 0;
  for (int x = 0; x < 40; ++x) {
    const auto picked = pick(scene, x + 0.5, 15.5, CancelToken()).value();
    if (!picked) continue;
    ++found;
    const auto& [i, j, k] = picked->sample;
    const auto at = static_cast<std::size_t>((k * dims[1] + j) * dims[0] + i);
    const double magnitude =
        std::hypot(wind->component(0)[at], wind->component(1)[at], wind->component(2)[at]);
    EXPECT_NEAR(picked->value, magnitude, 1e-5);
    for (std::size_t a = 0; a < 3; ++a) {
      const int sample = picked->sample[a];
      EXPECT_EQ(sample, data::strided_sample(sample / 4, 4, dims[a]));
    }
  }
  EXPECT_GT(found, 5);
}

TEST(Middles, EstimatesByKernelsAreThoseOfAllSamples) {
  data::Dataset dataset = store(100 * samples_bytes);
  protocol::View view = of_lines(4);
  view.camera.height = 0.3;
  view.vector.min_magnitude = 0.8;
  const auto scene = scene::build_scene(completed_of(view), dataset).value();
  ASSERT_EQ(scene.vector->field_stride, 4);
  scene::Scene all = scene;
  all.vector->field = dataset.volume("wind", 0).value();
  all.vector->field_stride = 1;
  std::vector<RayThrough> through;
  for (int k = 2; k < dims[2]; k += 12) {
    for (int j = 2; j < dims[1]; j += 4) {
      for (int i = 2; i < dims[0]; i += 4) through.push_back({{i, j, k}, 1});
    }
  }
  const PixelTrials found = pixel_trials(scene, through);
  const PixelTrials wanted = pixel_trials(all, through);
  EXPECT_GT(found.skipped_change.value(), 0);
  EXPECT_EQ(found.skipped_change.value(), wanted.skipped_change.value());
  EXPECT_GT(found.trials.value().kernel, 0);
  EXPECT_EQ(found.trials.value().kernel, wanted.trials.value().kernel);
  EXPECT_EQ(found.trials.value().slab, wanted.trials.value().slab);
}

TEST(Middles, ContentIsThatOfVectorsOfKernels) {
  data::Dataset dataset = store(100 * samples_bytes);
  protocol::View view = of_lines(4);
  view.vector.min_magnitude = 0.4;
  const auto scene = scene::build_scene(completed_of(view), dataset).value();
  ASSERT_EQ(scene.vector->field_stride, 4);
  const data::Volume& middles = *scene.vector->field;
  auto spread = std::make_shared<data::Volume>();
  spread->dims = dims;
  spread->components = 3;
  std::vector<float> values;
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) {
          const int at = ((k / 4) * middles.dims[1] + j / 4) * middles.dims[0] + i / 4;
          values.push_back(middles.component(c)[at]);
        }
      }
    }
  }
  spread->values = std::move(values);
  finish_volume(*spread);
  scene::Scene all = scene;
  all.vector->field = spread;
  all.vector->field_stride = 1;
  const auto found = content_of(scene).value();
  const auto wanted = content_of(all).value();
  EXPECT_GT(found.lines, 0);
  EXPECT_EQ(found.lines, wanted.lines);
  EXPECT_EQ(found.length, wanted.length);
  EXPECT_EQ(found.gaps, wanted.gaps);
  EXPECT_EQ(found.shade, wanted.shade);
}

// The longest vector is not one of the middles.
TEST(Middles, ALegendHasTheRangeOfTheField) {
  data::Dataset dataset = store(100 * samples_bytes);
  protocol::View view = of_lines(8);
  view.scalars->clear();
  view.vector.color.by = protocol::ColorBy::magnitude;
  const auto longest = static_cast<double>(dataset.volume("wind", 0).value()->range[1]);
  const auto legend_to = [&](double top) {
    view.vector.color.range = {0.0, top};
    const auto completed = completed_of(view);
    const auto scene = scene::build_scene(completed, dataset).value();
    EXPECT_EQ(scene.vector->field_stride, 8);
    EXPECT_LT(scene.vector->field->range[1], 0.999 * longest);
    annotate::Figure figure;
    figure.width = 640;
    figure.height = 480;
    const annotate::Subject subject{completed, scene, dataset.info()};
    add_legend(subject, style_of(subject), figure);
    std::string text;
    for (const annotate::Item& item : figure.above) {
      if (const auto* one = std::get_if<annotate::Text>(&item)) text += one->text + '\n';
    }
    return text;
  };
  EXPECT_NE(legend_to(0.999 * longest).find("less than 0.1 % of the lines"), std::string::npos);
  EXPECT_EQ(legend_to(1.001 * longest).find("of the lines"), std::string::npos);
}

TEST(Middles, AnotherResidentPartStandsIn) {
  data::Dataset dataset = store(samples_bytes);
  protocol::View view = of_lines(2);
  view.camera.height = 0.004;
  view.vector.length = 0.001;
  view.scalars->clear();
  const auto of = completed_of(view);
  const auto how = scene::coarsening_of(of.lattice(), {0, 0, 0});
  const auto lines = scene::lines_at(of.view(), how, of.lattice(), dataset);
  ASSERT_TRUE(lines.middles);
  const auto quantum = scene::least_quantum(of.view(), dims, {0, 0, 0}, false);
  const data::Box narrow =
      scene::box_in_sight(of.view(), of.camera(), of.lattice(), {0, 0, 0}, quantum);
  const auto part = scene::part_of_field(dataset, lines, {narrow, nullptr}).value();
  ASSERT_TRUE(dataset.derived("wind", 0, part));
  const scene::DrawnPart wanted{
      {0, 0, 0}, data::HeldPart{data::whole_box(dims), nullptr}, {0, 0, 0}};
  const auto found = scene::stand_in_for(of, wanted, dataset);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->part.halvings, (std::array{0, 0, 0}));
  EXPECT_EQ(found->part.held, (data::HeldPart{narrow, nullptr}));
  EXPECT_EQ(found->missing_bytes, 0U);
}

}  // namespace
}  // namespace windsplat::frame
