// Errors of pictures of sizes between the settings that calibration runs measure, estimated from
// those of the settings, compared with the truth over the trial fields.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "server/frame/frame.hpp"
#include "server/quality/sizes.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::test {
namespace {

using protocol::MethodName;
using quality::Setting;

constexpr int largest = 32;  // sixteenths of a halving: a quarter of the width

scene::CompletedView seen(data::Dataset& dataset, bool lines, int height, double azimuth) {
  protocol::View view;
  view.dataset = "trial";
  view.image = {240, height};
  view.method.detail = protocol::Detail::full;
  if (!lines) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  const auto completed = scene::complete(view, dataset).value();
  return completed
      .with([&](protocol::View& turned) {
        scene::orbit(turned, completed.lattice(), azimuth, 25, 1);
      })
      .value();
}

engine::Image picture(const scene::CompletedView& view, data::Dataset& dataset,
                      const Setting& setting) {
  const auto at = frame::at_setting(view, setting).value();
  return render(scene::build_scene(at, dataset).value(), 2).image;
}

// Bilinear between the centres of pixels.
double value_at(const engine::Image& from, double x, double y, int channel) {
  const auto at = [&](int column, int row) {
    const int i = std::clamp(column, 0, from.width - 1);
    const int j = std::clamp(row, 0, from.height - 1);
    return static_cast<double>(
        from.rgba[static_cast<std::size_t>(4 * (j * from.width + i) + channel)]);
  };
  const double left = std::floor(x);
  const double top = std::floor(y);
  const int i = static_cast<int>(left);
  const int j = static_cast<int>(top);
  const double above = at(i, j) + (x - left) * (at(i + 1, j) - at(i, j));
  const double below = at(i, j + 1) + (x - left) * (at(i + 1, j + 1) - at(i, j + 1));
  return above + (y - top) * (below - above);
}

double error_of(const engine::Image& shown, const engine::Image& truth) {
  double squares = 0;
  for (int y = 0; y < truth.height; ++y) {
    for (int x = 0; x < truth.width; ++x) {
      for (int c = 0; c < 4; ++c) {
        const double d = value_at(shown, (x + 0.5) * shown.width / truth.width - 0.5,
                                  (y + 0.5) * shown.height / truth.height - 0.5, c) -
                         value_at(truth, x, y, c);
        squares += d * d;
      }
    }
  }
  return std::sqrt(squares / static_cast<double>(truth.rgba.size()));
}

TEST(BetweenSizes, ErrorsAreThoseOfTheTruth) {
  std::vector<double> ratios;
  double azimuth = 0;
  for (const char* name : {"white noise", "turbulence", "steep turbulence", "vortices", "shells",
                           "plume", "front", "shear layers"}) {
    const auto dataset = trial_dataset({name, {20, 18, 16}, {1e3, 1e3, 8e2}});
    for (const bool lines : {false, true}) {
      azimuth += 67;
      const auto view = seen(*dataset, lines, lines ? 180 : 161, azimuth);
      const engine::Image truth = picture(view, *dataset, {MethodName::slab, 0, 0, 8});
      std::array<double, largest + 1> errors{};
      const auto setting = [](int size) {
        return Setting{MethodName::kernel, size / 8, 0, 1, size % 8};
      };
      for (const int size : {0, 1, 3, 6, 8, 10, 13, 16, 20, 24, 28, 32}) {
        errors[static_cast<std::size_t>(size)] =
            error_of(picture(view, *dataset, setting(size)), truth);
      }
      quality::Forecasts measured;
      for (std::size_t i = 0; i < measured.size(); ++i) {
        const auto size = static_cast<std::size_t>(8 * quality::settings[i].half_level);
        measured[i].ms = 1;
        measured[i].error = size <= largest && errors[size] > 0 ? errors[size] : 1;
      }
      for (int size = 0; size <= largest; ++size) {
        const double truly = errors[static_cast<std::size_t>(size)];
        if (size % 8 == 0 || !(truly > 0)) continue;
        const double estimate = quality::forecast_between(setting(size), measured).error;
        ratios.push_back(estimate / truly);
      }
    }
  }
  std::sort(ratios.begin(), ratios.end());
  ASSERT_EQ(ratios.size(), 16U * 7);
  EXPECT_NEAR(ratios[ratios.size() / 2], 1, 0.1);
  EXPECT_GT(ratios[ratios.size() / 20], 0.75);
  EXPECT_LT(ratios[ratios.size() * 19 / 20], 1.35);
}

}  // namespace
}  // namespace windsplat::test
