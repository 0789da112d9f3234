// Kernels in isolation: exponentials, jitter, and every target compared with the portable code.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "server/engine/kernels/dispatch.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

using engine::kernels::Table;
using engine::kernels::usable_tables;

struct Pair {
  float absorbed = -1;
  float transmitted = -1;
};

Pair attenuate(const Table& table, float tau) {
  Pair pair;
  table.attenuate(1, &tau, &pair.absorbed, &pair.transmitted);
  return pair;
}

TEST(Attenuation, HoldsFromZeroToInfinity) {
  for (const Table* table : usable_tables()) {
    SCOPED_TRACE(table->name);
    EXPECT_EQ(attenuate(*table, 0.0F).absorbed, 0.0F);
    EXPECT_EQ(attenuate(*table, 0.0F).transmitted, 1.0F);
    EXPECT_EQ(attenuate(*table, 1e-30F).absorbed, 1e-30F);
    EXPECT_NEAR(attenuate(*table, 1.0F).absorbed, 1 - std::exp(-1.0), 1e-7);
    for (const float tau : {50.0F, 1e4F, std::numeric_limits<float>::infinity()}) {
      EXPECT_EQ(attenuate(*table, tau).absorbed, 1.0F) << tau;
      EXPECT_GE(attenuate(*table, tau).transmitted, 0.0F) << tau;
      EXPECT_LE(attenuate(*table, tau).transmitted, 1e-21F) << tau;
    }
  }
}

TEST(Attenuation, IsAccurateEverywhere) {
  for (const Table* table : usable_tables()) {
    double worst_absorbed = 0;
    double worst_transmitted = 0;
    for (int step = -30000; step < 1900; ++step) {
      const auto tau = static_cast<float>(std::pow(10.0, 1e-3 * step));
      const Pair pair = attenuate(*table, tau);
      const double exact = static_cast<double>(tau);
      worst_absorbed = std::max(worst_absorbed, std::abs(pair.absorbed / -std::expm1(-exact) - 1));
      worst_transmitted =
          std::max(worst_transmitted, std::abs(pair.transmitted / std::exp(-exact) - 1));
    }
    EXPECT_LT(worst_absorbed, 1e-6) << table->name;
    EXPECT_LT(worst_transmitted, 1e-6) << table->name;
  }
}

// One of the six random numbers at every position of a small lattice, with the statistics that
// distinguish noise from a pattern: mean, variance, correlation with a neighbour.
struct Statistics {
  double mean = 0, variance = 0, correlation = 0;
};

Statistics statistics(const Table& table, int which, std::array<int, 3> step, int seed_step) {
  constexpr int side = 32;
  double sum = 0, square = 0, product = 0;
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        std::array<float, 6> here{};
        std::array<float, 6> there{};
        table.jitter(7, 3, i, j, k, here.data());
        table.jitter(7 + static_cast<std::uint32_t>(seed_step), 3, i + step[0], j + step[1],
                     k + step[2], there.data());
        const double a = static_cast<double>(here[which]) - 0.5;
        const double b = static_cast<double>(there[which]) - 0.5;
        sum += a;
        square += a * a;
        product += a * b;
      }
    }
  }
  constexpr double n = static_cast<double>(side) * side * side;
  return {sum / n, square / n, product / square};
}

TEST(Jitter, IsWhiteOverTheLattice) {
  const Table& table = engine::kernels::portable_table();
  for (int which = 0; which < 6; ++which) {
    for (const auto& step : {std::array<int, 3>{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}) {
      const Statistics s = statistics(table, which, step, 0);
      // Four standard errors of 32^3 uniform numbers.
      EXPECT_NEAR(s.mean, 0, 4 * std::sqrt(1.0 / 12 / 32768));
      EXPECT_NEAR(s.variance, 1.0 / 12, 4 * std::sqrt(1.0 / 180 / 32768));
      EXPECT_NEAR(s.correlation, 0, 4 / std::sqrt(32768.0)) << which;
    }
    EXPECT_NEAR(statistics(table, which, {0, 0, 0}, 1).correlation, 0, 4 / std::sqrt(32768.0));
  }
}

TEST(Jitter, NumbersOfOneKernelPositionAreIndependent) {
  const Table& table = engine::kernels::portable_table();
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) {
      double product = 0;
      for (int i = 0; i < 32768; ++i) {
        std::array<float, 6> six{};
        table.jitter(1, 0, i % 32, i / 32 % 32, i / 1024, six.data());
        product += (static_cast<double>(six[a]) - 0.5) * (static_cast<double>(six[b]) - 0.5);
      }
      EXPECT_NEAR(product / 32768 * 12, 0, 4 / std::sqrt(32768.0)) << a << " " << b;
    }
  }
}

scene::Scene busy_scene(int width, int height, bool perspective) {
  scene::Scene scene;
  scene.lattice = make_lattice({{{0.1, 0.12, 0.09, 0.1, 0.11, 0.1, 0.1, 0.08, 0.1, 0.13, 0.1},
                                 {0.1, 0.1, 0.12, 0.1, 0.1, 0.11, 0.1},
                                 {0.2, 0.15, 0.25}}});
  const auto wave = [](int c, double x, double y, double z) {
    return static_cast<float>(std::sin(5 * x + c) + std::cos(4 * y - c) * std::sin(3 * z + 1));
  };
  scene.camera = look({0, 0, 0}, {0.3, 1, -0.5}, 2, width, height, perspective, 0.3);
  scene.vector = plain_lines(make_volume(scene.lattice, 3, wave), {0.9F, 0.5F, 0.1F});
  scene.vector->length = 0.3;
  scene.vector->head_desaturation = 0.5;
  scene.vector->jitter_center = 0.5;
  scene.vector->jitter_stride = 0.3;
  scene.scalars.push_back(medium(make_volume(scene.lattice, 1, wave), {0.5F, 0.6F, 0.9F}));
  return scene;
}

// Lane by lane without fused multiply-add, at the full vector width: differences are due to
// rounding. Targets with FMA also differ by the processor's estimates of reciprocal square roots.
TEST(Targets, AgreeAtAwkwardSizes) {
  const auto tables = usable_tables();
  for (int size = 1; size <= 67; ++size) {
    const scene::Scene scene = busy_scene(size, 68 - size, size % 2 == 0);
    const engine::Rendered portable = render_with(*tables.front(), scene);
    EXPECT_GT(portable.work.pixel_updates, 0);
    std::optional<engine::Rendered> fused;
    for (const Table* table : tables) {
      engine::Rendered other = render_with(*table, scene);
      EXPECT_LE(largest_difference(portable, other), 1e-5) << table->name << " " << size;
      const auto updates = static_cast<double>(portable.work.pixel_updates);
      EXPECT_NEAR(static_cast<double>(other.work.pixel_updates), updates, 0.01 * updates);
      const std::string name = table->name;
      if (name != "avx2" && name != "avx512") continue;
      if (fused) {
        EXPECT_LE(largest_difference(*fused, other), 1e-5) << size;
      }
      fused = std::move(other);
    }
  }
}

// Whole numbers yield integer lengths, some equal to the tolerance.
TEST(Targets, RenderLinesExactlyAtTheTolerance) {
  for (const Table* table : usable_tables()) {
    int drawn = 0;
    for (int part = 1; part <= 100; ++part) {
      scene::Scene scene = busy_scene(8, 8, true);
      scene.scalars.clear();
      scene.vector->field = make_volume(scene.lattice, 3, [&](int c, double, double, double) {
        return static_cast<float>((c == 0 ? 2 : c == 1 ? 3 : 6) * part);
      });
      scene.vector->min_magnitude = 7 * part;
      const engine::WorkReport work = render_with(*table, scene).work;
      drawn += work.skipped_vector == 0 ? 1 : 0;
    }
    EXPECT_EQ(drawn, 100) << table->name;
  }
}

// Squares of such vectors overflow or underflow.
TEST(Targets, MeasureVectorsOfAnySize) {
  for (const Table* table : usable_tables()) {
    for (const double size : {1e-35, 1e-20, 1.0, 1e20, 1e35}) {
      scene::Scene scene = busy_scene(8, 8, true);
      scene.scalars.clear();
      scene.vector->field = make_volume(scene.lattice, 3, [&](int c, double, double, double) {
        return static_cast<float>((c == 0 ? 2 : c == 1 ? 3 : 6) * size);
      });
      scene.vector->min_magnitude = 6.99 * size;
      EXPECT_EQ(render_with(*table, scene).work.skipped_vector, 0) << table->name << " " << size;
      scene.vector->min_magnitude = 7.01 * size;
      const engine::WorkReport work = render_with(*table, scene).work;
      EXPECT_EQ(work.skipped_vector, work.samples - work.culled) << table->name << " " << size;
    }
  }
}

TEST(Targets, VariantNamesTheActiveTarget) {
  const auto table = engine::kernels::chosen_table();
  ASSERT_TRUE(table);
  const engine::Rendered rendered = render(busy_scene(8, 8, true));
  EXPECT_NE(engine::text_of(rendered.work.variant).find((*table)->name), std::string::npos);
}

}  // namespace
}  // namespace windsplat::test
