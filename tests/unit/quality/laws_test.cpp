// Forecasts of a scene before any measurement.
#include "server/quality/laws.hpp"

#include <gtest/gtest.h>

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
  empty.content->step = empty.content->incline = empty.content->order = 0;
  empty.content->bends.fill(0);
  for (const Kind& kind : {both, media}) {
    for (const Setting& setting : settings) {
      EXPECT_GE(error_of(kind, setting, empty), error_least);
    }
  }
}

// Lines that cover less of the picture have less error, and a medium whose light differs less from
// cell to cell loses less in a smaller picture.
TEST(Laws, ErrorsGrowWithTheirCauses) {
  Viewpoint seen{2, {}, 640, 480};
  seen.content = Content{};
  Viewpoint sparse = seen;
  sparse.content->lines /= 5;
  sparse.content->layers /= 5;
  const Kind lines{true, false, 1.4, 1};
  EXPECT_LT(error_of(lines, {MethodName::kernel, 0, 0}, sparse),
            error_of(lines, {MethodName::kernel, 0, 0}, seen));
  Viewpoint smooth = seen;
  smooth.content->step /= 5;
  smooth.content->incline /= 5;
  for (double& bend : smooth.content->bends) bend /= 5;
  EXPECT_LT(error_of(media, {MethodName::kernel, 2, 0}, smooth),
            error_of(media, {MethodName::kernel, 2, 0}, seen));
  Viewpoint plain = seen;  // of one colour: the order of its samples makes no difference
  plain.content->tint /= 5;
  plain.content->order /= 5;
  EXPECT_LT(error_of(media, {MethodName::kernel, 0, 0}, plain),
            error_of(media, {MethodName::kernel, 0, 0}, seen));
}

// Lines in a medium that is hardly there have the error of lines alone.
TEST(Laws, AThinMediumLeavesTheErrorOfLines) {
  Viewpoint seen{2, {}, 640, 480};
  seen.content = Content{};
  seen.content->depth = seen.content->cell_depth = seen.content->line_depth = 1e-9;
  seen.content->step = seen.content->incline = seen.content->order = 1e-10;
  seen.content->bends.fill(1e-10);
  const Setting kernel{MethodName::kernel, 0, 0};
  EXPECT_GE(error_of(both, kernel, seen), 0.999 * error_of({true, false, 1.4, 1}, kernel, seen));
}

// A size of whole pixels changes the proportions, which moves what is seen.
TEST(Laws, APictureOfOtherProportionsHasAGreaterError) {
  const Setting half{MethodName::kernel, 2, 0};
  Viewpoint even{2, {}, 640, 320};
  even.content = Content{};
  even.content->bends = {1e-5, 1e-4, 1e-3, 4e-3};  // smooth, but inclined
  Viewpoint odd = even;
  odd.width = 641;
  EXPECT_GT(error_of(media, half, odd), 1.2 * error_of(media, half, even));
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
