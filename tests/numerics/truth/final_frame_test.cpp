// A final frame is the most accurate that a stream shows of its view: errors of the settings of
// moving frames compared with that of the final one, over the trial fields.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "server/frame/frame.hpp"
#include "server/quality/pick.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "tests/numerics/scenes.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::test {
namespace {

using protocol::MethodName;
using quality::Setting;

enum class Content { lines, medium, both };

// A view of every sample from its own direction.
scene::CompletedView framed(data::Dataset& dataset, Content content, int width, double azimuth) {
  protocol::View view;
  view.dataset = "trial";
  view.image.width = width;
  view.image.height = width * 3 / 4;
  view.method.detail = protocol::Detail::full;
  if (content == Content::medium) view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  if (content == Content::lines) view.scalars.emplace();
  const auto completed = scene::complete(view, dataset).value();
  return completed
      .with([&](protocol::View& turned) {
        scene::orbit(turned, completed.lattice(), azimuth, 25, 1);
      })
      .value();
}

std::vector<float> drawn(const scene::CompletedView& view, data::Dataset& dataset,
                         const Setting& setting) {
  const auto at = frame::at_setting(view, setting).value();
  return render(scene::build_scene(at, dataset).value(), 2).image.rgba;
}

double rmse(const std::vector<float>& a, const std::vector<float>& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = static_cast<double>(a[i]) - static_cast<double>(b[i]);
    squares += d * d;
  }
  return std::sqrt(squares / static_cast<double>(a.size()));
}

// Slabs of a quarter and an eighth of the thickness, extrapolated by their second order
// (MethodError.SlabsAreSecondOrderInTheirThickness).
std::vector<float> truth_of(const scene::CompletedView& view, data::Dataset& dataset) {
  const std::vector<float> quarter = drawn(view, dataset, {MethodName::slab, 0, 0, 4});
  std::vector<float> truth = drawn(view, dataset, {MethodName::slab, 0, 0, 8});
  for (std::size_t i = 0; i < truth.size(); ++i) truth[i] += (truth[i] - quarter[i]) / 3;
  return truth;
}

// Every setting of full size that a moving frame may have. Smaller pictures have the errors of
// their pixels.
void compare(const scene::CompletedView& view, data::Dataset& dataset, const std::string& what) {
  constexpr double resolved = 1e-5;  // of pictures of single precision
  const quality::Aim moving{33, 1e-6, true};
  const std::vector<float> truth = truth_of(view, dataset);
  const double final_error =
      rmse(drawn(view, dataset, quality::settings[quality::own_setting(view.view())]), truth);
  for (const Setting& setting : quality::settings) {
    if (!quality::is_candidate(setting, view.view(), moving) || setting.half_level > 0) continue;
    const double error = rmse(drawn(view, dataset, setting), truth);
    EXPECT_TRUE(final_error <= error || final_error < resolved)
        << what << ": " << final_error << " after " << error << ", thinner " << setting.thinner;
  }
}

TEST(FinalFrame, IsTheMostAccurateShownOfItsView) {
  int views = 0;
  double azimuth = 0;
  for (const char* name : {"white noise", "turbulence", "steep turbulence", "vortices", "shells",
                           "plume", "front", "shear layers"}) {
    for (const std::array<int, 3>& dims : {std::array{20, 18, 16}, std::array{24, 20, 6}}) {
      const auto dataset = trial_dataset({name, dims, {1e3, 1e3, 1e3 * dims[2] / dims[0]}});
      for (const Content content : {Content::medium, Content::both}) {
        azimuth += 67;
        const int width = std::array{160, 240, 320}[views++ % 3];
        compare(framed(*dataset, content, width, azimuth), *dataset,
                std::string(name) + " at " + std::to_string(width));
      }
    }
  }
  for (const char* name : {"turbulence", "vortices", "plume"}) {
    const auto dataset = trial_dataset({name, {20, 18, 16}, {1e3, 9e2, 8e2}});
    compare(framed(*dataset, Content::lines, 640, 30), *dataset, name);
    ++views;
  }
  EXPECT_GE(views, 32);
}

}  // namespace
}  // namespace windsplat::test
