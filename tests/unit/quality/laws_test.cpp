// Forecasts of a scene before any measurement.
#include "server/quality/laws.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "server/quality/table.hpp"

namespace windsplat::quality {
namespace {

using protocol::MethodName;

const Kind both{true, true, 1.4, 1};
const Kind media{false, true, 1.4, 1};

double error_of(const Kind& kind, const Setting& setting,
                const Viewpoint& viewpoint = {2, {}, 640, 480}) {
  return expected_error(kind, setting, viewpoint).value;
}

// The slab method is of order 2 in the slab thickness, at every content.
TEST(Laws, SlabErrorGrowsWithTheSquareOfThickness) {
  for (const Kind& kind : {both, media}) {
    Kind dense = kind;
    dense.thickness = 4;  // far above the smallest reported error
    const double own = error_of(dense, {MethodName::slab, 0, 0});
    EXPECT_NEAR(error_of(dense, {MethodName::slab, 0, 0, 2}) / own, 1.0 / 4, 1e-12);
    EXPECT_NEAR(error_of(dense, {MethodName::slab, 0, 0, 4}) / own, 1.0 / 16, 1e-12);
    Kind thick = dense;
    thick.thickness = 8;
    EXPECT_NEAR(error_of(thick, {MethodName::slab, 0, 0}) / own, 4, 1e-12);
  }
}

TEST(Laws, FewerPixelsAndCoarserDataIncreaseTheError) {
  for (const Kind& kind : {both, media}) {
    double last = error_of(kind, {MethodName::slab, 0, 0});
    for (const Setting& worse : {Setting{MethodName::kernel, 0, 0},
                                 {MethodName::kernel, 1, 0},
                                 {MethodName::kernel, 2, 0},
                                 {MethodName::kernel, 4, 0},
                                 {MethodName::kernel, 6, 0}}) {
      EXPECT_GT(error_of(kind, worse), last);
      last = error_of(kind, worse);
    }
    EXPECT_GT(error_of(kind, {MethodName::kernel, 1, 2}),
              error_of(kind, {MethodName::kernel, 1, 1}));
    EXPECT_GT(error_of(kind, {MethodName::kernel, 1, 1}),
              error_of(kind, {MethodName::kernel, 1, 0}));
  }
}

// Also where the error of the method dominates that of fewer pixels: otherwise nothing would favour
// the larger of two pictures.
TEST(Laws, EverySmallerPictureOfTheSameProportionsHasAGreaterError) {
  const Kind lines{true, false, 1.4, 1};
  Viewpoint smooth{2, {}, 640, 480};
  smooth.content = Content{};
  smooth.content->bends.fill(1e-4);
  smooth.content->layers = 5;
  smooth.content->length = 0.5;
  for (const Viewpoint& viewpoint : {Viewpoint{2, {}, 640, 480}, smooth}) {
    for (const Kind& kind : {lines, media, both}) {
      double last = 0;
      for (const int half_level : {0, 2, 4, 6, 8}) {
        const double error = error_of(kind, {MethodName::kernel, half_level, 0}, viewpoint);
        EXPECT_GT(error, last) << "half level " << half_level;
        last = error;
      }
    }
  }
}

TEST(Laws, LinesAloneAreExactWithSlabs) {
  const Kind lines{true, false, 1.4, 1};
  EXPECT_NEAR(error_of(lines, {MethodName::slab, 0, 0}), error_least, 1e-3 * error_least);
}

// No error is below that of single precision, whatever the content.
TEST(Laws, ErrorsAreAtLeastThatOfSinglePrecision) {
  Viewpoint empty{2, {}, 640, 480};
  empty.content = Content{};
  empty.content->lines = empty.content->layers = empty.content->depth = 0;
  empty.content->cell_depth = empty.content->line_depth = 0;
  empty.content->step = empty.content->order = 0;
  empty.content->bends.fill(0);
  empty.content->shifts.fill(0);
  for (const Kind& kind : {both, media}) {
    for (const Setting& setting : settings) {
      EXPECT_GE(error_of(kind, setting, empty), error_least);
    }
  }
}

// At full size and of every sample, but for the factor that is fitted.
TEST(Laws, ErrorsOfMethodsAreThoseOfTriedPixels) {
  Viewpoint seen{2, {}, 640, 480};
  seen.content = Content{};
  for (const Kind& kind : {both, media, Kind{true, false, 1.4, 1}}) {
    const auto errors = [&](double kernel, double slab) {
      seen.content->trials = Trials{kernel, slab, slab / 3};
      return std::array{error_of(kind, {MethodName::kernel, 0, 0}, seen),
                        error_of(kind, {MethodName::slab, 0, 0}, seen)};
    };
    const auto [kernel, slab] = errors(4e-3, 1e-3);
    EXPECT_NEAR(kernel, 4e-3, 2e-3);
    EXPECT_NEAR(slab, 1e-3, 5e-4);
    EXPECT_NEAR(errors(8e-3, 1e-3)[0], 2 * kernel, 1e-12);
    EXPECT_NEAR(errors(8e-3, 1e-3)[1], slab, 1e-12);
    EXPECT_NEAR(errors(4e-3, 3e-3)[1], 3 * slab, 1e-12);
    EXPECT_LE(errors(0, 0)[0], error_least);
    errors(4e-3, 1e-3);
    const auto thinner = [&](int by) {
      return error_of(kind, {MethodName::slab, 0, 0, by}, seen) / errors(4e-3, 1e-3)[1];
    };
    EXPECT_NEAR(thinner(2), 1.0 / 3, 1e-9);
    EXPECT_NEAR(thinner(4), 1.0 / 12, 1e-9);
  }
}

// Independent of that of the method; where nothing was tried it is that of the kind of scene.
TEST(Laws, ErrorsContainWhatIsLostWhereRaysEnd) {
  Viewpoint seen{2, {}, 640, 480};
  seen.content = Content{};
  seen.content->trials = Trials{4e-3, 1e-3, 3e-4};
  const Setting slab{MethodName::slab, 0, 0};
  const double of_method = error_of(media, slab, seen);
  seen.content->trials->stop = 2e-3;
  EXPECT_NEAR(error_of(media, slab, seen), std::hypot(of_method, 2e-3), 1e-12);
  Kind kind = media;
  kind.stop = 5e-3;
  EXPECT_NEAR(error_of(kind, slab, seen), std::hypot(of_method, 2e-3), 1e-12);
  seen.content.reset();
  EXPECT_GE(error_of(kind, slab, seen), 5e-3);
}

// Slabs that would be thinner than the least ones are drawn as these.
TEST(Laws, SlabsBelowTheLeastDepthHaveItsError) {
  Viewpoint seen{2, {}, 640, 480};
  seen.content = Content{};
  const auto tried = [&](double thinnest, double thickness, int thinner) {
    seen.content->trials = Trials{4e-3, 1e-3, 4e-4, thinnest};
    return tried_error({true, true, 1, thickness}, {MethodName::slab, 0, 0, thinner}, seen);
  };
  for (const double thickness : {0.25, 1.0, 4.0}) EXPECT_NEAR(tried(4, thickness, 1), 1e-3, 1e-12);
  EXPECT_NEAR(tried(4, 8, 1), 4e-3, 1e-12);
  EXPECT_NEAR(tried(4, 8, 4), 1e-3, 1e-12);
  for (const int thinner : {2, 4}) EXPECT_NEAR(tried(0.5, 1, thinner), 4e-4, 1e-12);
  EXPECT_NEAR(tried(0.1, 1, 4), 1e-4, 1e-12);
}

// Lines that cover less of the picture lose less in a smaller one, and so does a medium whose light
// differs less from cell to cell.
TEST(Laws, ErrorsGrowWithTheirCauses) {
  Viewpoint seen{2, {}, 640, 480};
  seen.content = Content{};
  seen.content->trials = Trials{1e-4, 1e-4, 1e-4};
  Viewpoint sparse = seen;
  sparse.content->lines /= 5;
  const Kind lines{true, false, 1.4, 1};
  for (const Setting& setting :
       {Setting{MethodName::kernel, 2, 0}, Setting{MethodName::kernel, 0, 1}}) {
    EXPECT_LT(error_of(lines, setting, sparse), error_of(lines, setting, seen));
  }
  Viewpoint smooth = seen;
  smooth.content->step /= 5;
  for (double& bend : smooth.content->bends) bend /= 5;
  for (double& shift : smooth.content->shifts) shift /= 5;
  EXPECT_LT(error_of(media, {MethodName::kernel, 2, 0}, smooth),
            error_of(media, {MethodName::kernel, 2, 0}, seen));
}

// A size of whole pixels changes the proportions, which moves what is seen.
TEST(Laws, APictureOfOtherProportionsHasAGreaterError) {
  const Setting half{MethodName::kernel, 2, 0};
  Viewpoint even{2, {}, 640, 320};
  even.content = Content{};
  // Smooth, but inclined.
  even.content->bends = {1e-6, 6e-6, 4e-5, 2e-4, 2e-3};
  even.content->shifts = {1e-3, 2.5e-3, 6e-3, 1.6e-2, 5e-2};
  even.content->trials = Trials{1e-5, 1e-5, 1e-5};
  Viewpoint odd = even;
  odd.width = 641;
  EXPECT_GT(error_of(media, half, odd), 1.2 * error_of(media, half, even));
}

// Below the least distance light is taken to be smooth, beyond the greatest it has no structure.
TEST(Content, PowersOfTheDistanceAreKeptBetweenDistances) {
  AtDistances known{};
  for (std::size_t k = 0; k < distances_count; ++k) known[k] = std::pow(distances[k], 1.3);
  for (const double distance : {1 / 2000.0, 1 / 1000.0, 1 / 333.0, 1 / 60.0, 1 / 40.0}) {
    EXPECT_NEAR(at_distance(known, distance, 2) / std::pow(distance, 1.3), 1, 1e-9) << distance;
  }
  EXPECT_NEAR(at_distance(known, 1 / 8000.0, 2), known.front() / 16, 1e-12);
  EXPECT_NEAR(at_distance(known, 1 / 8000.0, 1), known.front() / 4, 1e-12);
  EXPECT_EQ(at_distance(known, 0, 2), 0);
  EXPECT_NEAR(at_distance(known, 1, 2) / known.back(), 1, 1e-9);
}

TEST(Content, SeenTwiceAsLargeChangesAtTwiceTheDistance) {
  Content content;
  for (std::size_t k = 0; k < distances_count; ++k) {
    content.bends[k] = std::pow(distances[k], 1.3);
    content.shifts[k] = std::pow(distances[k], 0.7);
  }
  const Content large = scaled(content, 2);
  EXPECT_DOUBLE_EQ(large.cell, 2 * content.cell);
  for (std::size_t k = 1; k < distances_count; ++k) {
    EXPECT_NEAR(large.bends[k] / std::pow(distances[k] / 2, 1.3), 1, 1e-9);
    EXPECT_NEAR(large.shifts[k] / std::pow(distances[k] / 2, 0.7), 1, 1e-9);
  }
}

TEST(Laws, IncompleteViewsHavePositiveFiniteErrors) {
  for (const Kind& kind : {Kind{}, both, media, Kind{true, true, 50, 32}}) {
    for (const Viewpoint& viewpoint :
         {Viewpoint{}, Viewpoint{1e12, {0, 0, 1}, 8192, 8192}, Viewpoint{1e-12}}) {
      for (const Setting& setting : settings) {
        const Expected error = expected_error(kind, setting, viewpoint);
        EXPECT_GT(error.value, 0);
        EXPECT_LE(error.value, 1);
        EXPECT_GT(expected_ms(kind, setting, viewpoint).value, 0);
      }
    }
  }
}

TEST(Laws, FewerPixelsTakeLessTime) {
  const Viewpoint viewpoint{2, {}, 640, 480};
  const auto ms = [&](const Setting& setting) {
    return expected_ms(both, setting, viewpoint).value;
  };
  EXPECT_LT(ms({MethodName::kernel, 2, 0}), ms({MethodName::kernel, 0, 0}));
  EXPECT_LT(ms({MethodName::kernel, 0, 1}), ms({MethodName::kernel, 0, 0}));
  EXPECT_GT(ms({MethodName::slab, 0, 0}), ms({MethodName::kernel, 0, 0}));
  EXPECT_GT(ms({MethodName::slab, 0, 0, 2}), ms({MethodName::slab, 0, 0}));
}

TEST(Prior, EqualsTheLawsWithTheCombinedUncertainty) {
  Viewpoint viewpoint{2, {}, 640, 480};
  viewpoint.content.emplace();
  for (const Setting& setting : settings) {
    const Forecast told = prior(both, setting, viewpoint);
    const Expected error = expected_error(both, setting, viewpoint);
    EXPECT_EQ(told.error, error.value);
    EXPECT_NEAR(told.spread, std::hypot(error.scatter.signature, error.scatter.viewpoint), 1e-12);
    EXPECT_FALSE(told.timed);
  }
}

}  // namespace
}  // namespace windsplat::quality
