// Pixels composited from the kernels near their rays, against pictures by other code.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

#include "server/base/thread_pool.hpp"
#include "server/engine/reference/reference.hpp"
#include "server/frame/content.hpp"
#include "server/frame/difference.hpp"
#include "server/frame/measure.hpp"
#include "server/frame/pixel_trials.hpp"
#include "server/frame/ray_kernels.hpp"
#include "server/frame/ray_light.hpp"
#include "server/quality/laws.hpp"
#include "server/quality/setting.hpp"
#include "server/quality/view_traits.hpp"
#include "server/scene/build.hpp"
#include "server/scene/completed_view.hpp"
#include "tests/numerics/family/family.hpp"
#include "tests/numerics/naive_renderer.hpp"
#include "tests/numerics/scenes.hpp"

namespace windsplat::test {
namespace {

// Calls visit(x, y, ray, kernels) for pixels of a scene that show samples.
template <class Visit>
void each_pixel(const scene::Scene& scene, const Visit& visit) {
  frame::RayKernels kernels(scene);
  const auto& view = kernels.view();
  const auto& dims = scene.lattice.dims;
  for (int n = 0; n < 400; ++n) {
    const frame::Index i{(7 * n + 3) % dims[0], (11 * n / 20 + 1) % dims[1], (3 * n / 7) % dims[2]};
    const glm::dvec3 place = kernels.samples().place(i);
    const auto at = engine::reference::to_camera(
        view, engine::reference::plus({place.x, place.y, place.z}, -1, view.eye));
    if (view.perspective && at[2] <= view.near) continue;
    const double scale = 1 / (view.pixel * (view.perspective ? at[2] : 1));
    const double x = std::floor(view.half_width + at[0] * scale);
    const double y = std::floor(view.half_height + at[1] * scale);
    if (x < 0 || y < 0 || x >= scene.camera.width || y >= scene.camera.height) continue;
    const frame::PictureRay ray = frame::picture_ray(view, x + 0.5, y + 0.5);
    const double wide = scene.vector ? scene.vector->r2 : 0;
    visit(static_cast<int>(x), static_cast<int>(y), ray, *kernels.around(i, {ray}, wide));
  }
}

template <class Picture>
frame::Light light_at(const Picture& picture, int x, int y) {
  const auto* rgba = picture.rgba.data() +
                     4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                          static_cast<std::size_t>(x));
  frame::Light out;
  for (std::size_t c = 0; c < 3; ++c) out.rgb[c] = rgba[c];
  out.alpha = rgba[3];
  return out;
}

// What is behind a transmittance of 1e-3 is left out.
constexpr double left_out = 1e-3;

std::vector<scene::Scene> scenes() {
  std::vector<scene::Scene> out;
  out.push_back(cloudy_scene(20, 100));
  out.push_back(out[0]);
  out.back().camera = look({0, 0, 0}, {0.3, 1, -0.2}, 3, 100, 90, false, 1.2);
  out.push_back(out[0]);
  out.back().vector->stride = 2;
  out.back().scalars[0].stride = 2;
  out.push_back(out[0]);
  out.back().scalars.clear();
  out.push_back(out[0]);
  out.back().vector.reset();
  // From within, layers of different strides alternate by their distance from the eye.
  for (const auto& [lines, medium] : {std::pair{1, 3}, std::pair{3, 2}, std::pair{1, 1}}) {
    out.push_back(out[0]);
    out.back().vector->stride = lines;
    out.back().scalars[0].stride = medium;
    const glm::dvec3 forward = glm::normalize(glm::dvec3(0.3, 1, -0.2));
    out.back().camera =
        look(glm::dvec3(0.13, -0.21, 0.07) + forward, forward, 1, 55, 45, true, 0.6);
  }
  return out;
}

TEST(RayLight, OfKernelsEqualsTheNaiveRenderer) {
  for (const scene::Scene& scene : scenes()) {
    frame::RayGround ground(scene);
    const frame::RayLight light(scene, ground);
    const auto picture = naive::render<double>(scene);
    int compared = 0;
    each_pixel(scene, [&](int x, int y, const auto& ray, const auto& kernels) {
      const frame::Light one = light.by_kernels(kernels, ray);
      const double off = std::sqrt(frame::square_difference(one, light_at(picture, x, y)));
      EXPECT_LT(off, 1.5 * left_out) << scene.camera.eye.x << ' ' << x << ' ' << y;
      ++compared;
    });
    EXPECT_GT(compared, 50);
  }
}

// Pieces of a quarter of a slab have a sixteenth of its error, and slabs that of the engine's.
TEST(RayLight, ByDepthApproachesTheReferenceAndSlabsHaveTheErrorOfTheEngine) {
  ThreadPool pool(2);
  for (scene::Scene scene : scenes()) {
    frame::RayGround ground(scene);
    frame::RayLight light(scene, ground);
    const auto reference = engine::reference::render(scene, pool, {}, {1e-6}).value();
    scene.method = scene::Method::slab;
    const engine::Rendered slabs = render(scene, 2);
    double exact_off = 0;
    double own = 0;
    double drawn = 0;
    int count = 0;
    each_pixel(scene, [&](int x, int y, const auto& ray, const auto& kernels) {
      const auto one = light.by_depth(kernels, ray);
      const frame::Light truth = light_at(reference, x, y);
      exact_off += frame::square_difference(one.exact, truth);
      own += frame::square_difference(one.slabs, one.exact);
      drawn += frame::square_difference(light_at(slabs.image, x, y), truth);
      ++count;
    });
    EXPECT_LT(std::sqrt(exact_off / count), 0.12 * std::sqrt(drawn / count) + left_out);
    EXPECT_NEAR(std::sqrt(own / count), std::sqrt(drawn / count),
                0.3 * std::sqrt(drawn / count) + left_out / 2);
  }
}

// Without any law: of lines, a medium and both, in data of kinds to which nothing is fitted.
TEST(PixelTrials, HaveTheErrorsOfCalibrationRuns) {
  ThreadPool pool(2);
  frame::Workspace workspace;
  int compared = 0;
  int within = 0;
  for (const FamilyMember& member : strangers()) {
    const auto dataset = formula_dataset(member.field, member.formula);
    for (std::uint32_t scene = 30; scene < 33; ++scene) {
      auto view = random_view(*dataset, scene, 2, 240);
      view.quality.max_error = 1;  // so that slabs are allowed
      const auto completed = scene::complete(view, *dataset).value();
      const auto done = frame::calibrate(
          completed, *dataset, pool, {}, workspace, [&](const frame::CalibrationSample& one) {
            const quality::Setting& setting = quality::settings[one.setting];
            const double detail = one.viewpoint.detail;
            const bool merges = setting.coarser > 0 || (detail > 0 && detail < 1);
            if (merges || setting.half_level > 0) return;
            const quality::Trials& trials = *one.viewpoint.content->trials;
            const double tried = setting.method == protocol::MethodName::kernel
                                     ? trials.kernel
                                     : trials.slab / (setting.thinner * setting.thinner);
            if (*one.measured.error < 1e-4) return;
            ++compared;
            within += std::abs(std::log(tried / *one.measured.error)) < std::log(2) ? 1 : 0;
          });
      ASSERT_TRUE(done);
    }
  }
  EXPECT_GE(compared, 8);
  EXPECT_GT(within, 0.85 * compared);
}

// Of most pixels of these views the error is thousands of times less than the mean.
TEST(PixelTrials, FindErrorsThatFewPixelsHave) {
  auto members = family();
  for (auto& stranger : strangers()) members.push_back(std::move(stranger));
  ThreadPool pool(2);
  struct Seen {
    std::size_t member;
    std::uint32_t scene;
    std::uint32_t viewpoint;
  };
  for (const Seen& seen : {Seen{7, 0, 1}, Seen{26, 8, 0}, Seen{26, 2, 1}}) {
    const FamilyMember& member = members[seen.member];
    const auto dataset = formula_dataset(member.field, member.formula);
    const auto number =
        3 * (100 * static_cast<std::uint32_t>(seen.member) + seen.scene) + seen.scene % 3;
    auto view = random_view(*dataset, number, seen.viewpoint, 640);
    view.vector.stride = 1;
    const auto completed = scene::complete(view, *dataset).value();
    scene::Scene scene = scene::build_scene(completed, *dataset).value();
    const double tried = frame::content_of(scene)->trials->kernel;
    scene.method = scene::Method::slab;
    scene.slab_thickness = 0.25;
    const engine::Image truth = render(scene, 2).image;
    scene.method = scene::Method::kernel;
    const engine::Image drawn = render(scene, 2).image;
    const double error = frame::difference_of(drawn.rgba, truth.rgba).rmse;
    EXPECT_GT(error, 1e-3);
    EXPECT_LT(std::abs(std::log(tried / error)), std::log(2)) << member.field.name << error;
  }
}

// Cells of an optical depth of about 0.25 across, seen at a slant.
scene::Scene flat_cells(double flatness) {
  scene::Scene scene = cloudy_scene(4, 24);
  scene.lattice = even_lattice({4, 4, 4}, {0.5, 0.5, 0.5 / flatness});
  const auto wave = [&](int c, double x, double y, double z) {
    return static_cast<float>(1 + 0.5 * std::sin(3 * x + c) * std::cos(2 * y - 3 * z * flatness));
  };
  scene.vector =
      plain_lines(make_volume(scene.lattice, 3,
                              [&](int c, double x, double y, double z) {
                                return wave(c, x, y, z) / static_cast<float>(c == 2 ? flatness : 1);
                              }),
                  {0.9F, 0.5F, 0.1F});
  scene.vector->length = 0.3;
  const auto extinction = [&](int c, double x, double y, double z) {
    return static_cast<float>(0.5 * flatness) * wave(c, x, y, z);
  };
  scene.scalars = {medium(make_volume(scene.lattice, 1, extinction), {0.5F, 0.6F, 0.9F})};
  scene.scalars[0].color =
      ramp_color(0.2 * flatness, 0.8 * flatness, {0.9F, 0.2F, 0.1F}, {0.2F, 0.5F, 1.0F});
  return scene;
}

// Slabs have a least depth: from a flatness of some 1e4 on, all layers of these cells lie in one.
TEST(PixelTrials, ResolveCellsMuchFlatterThanSlabs) {
  ThreadPool pool(2);
  for (const double flatness : {1.0, 1e3, 1e4, 1e5, 1e6, 1e7}) {
    for (const double thickness : {1.0, 0.25}) {
      scene::Scene scene = flat_cells(flatness);
      const auto truth = engine::reference::render(scene, pool, {}, {1e-6}).value();
      const auto content = frame::content_of(scene);
      ASSERT_TRUE(content && content->trials) << flatness;
      quality::Viewpoint seen;
      seen.content = content;
      const auto check = [&](protocol::MethodName method, double least) {
        const double tried = quality::tried_error({true, true, 1, thickness}, {method, 0, 0}, seen);
        const double error = frame::difference_of(render(scene, 2).image.rgba, truth.rgba).rmse;
        EXPECT_GT(error, least) << flatness;
        EXPECT_LT(std::abs(std::log(tried / error)), std::log(2))
            << flatness << ' ' << thickness << ' ' << tried << ' ' << error;
      };
      check(protocol::MethodName::kernel, 1e-3);
      scene.method = scene::Method::slab;
      scene.slab_thickness = thickness;
      check(protocol::MethodName::slab, flatness > 1e4 ? 1e-3 : 1e-5);
    }
  }
}

}  // namespace
}  // namespace windsplat::test
