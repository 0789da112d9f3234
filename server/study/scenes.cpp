// Names -> subjects -> scenes.
#include "server/study/scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/base/check.hpp"
#include "server/data/samples/samples.hpp"
#include "server/scene/build.hpp"
#include "server/scene/camera.hpp"
#include "server/scene/completed_view.hpp"
#include "server/study/blobs.hpp"

namespace windsplat::study {

namespace {

constexpr std::uint64_t resident_bytes_max = 4ULL << 30;
constexpr std::array<const char*, 5> blob_names{"soft", "dense", "stiff", "vectors", "scalar"};
constexpr std::array<const char*, 3> sample_scenes{"climate", "tornado", "efield"};
constexpr double azimuth = 30;    // oblique: along no axis and no diagonal
constexpr double elevation = 25;  // degrees

bool is_one_of(const std::string& name, const auto& names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// The largest optical depth along a row of samples, for an extinction that equals the density.
Result<double> deepest_row(data::Dataset& dataset) {
  const auto volume = dataset.volume("density", 0);
  if (!volume) return volume.error();
  constexpr std::size_t n = blob_samples;
  double deepest = 0;
  for (std::size_t z = 0; z < n; ++z) {
    for (std::size_t x = 0; x < n; ++x) {
      double sum = 0;
      for (std::size_t y = 0; y < n; ++y) sum += (*volume)->values[(z * n + y) * n + x];
      deepest = std::max(deepest, sum * 2 / n);
    }
  }
  return deepest;
}

Result<void> set_medium(const std::string& name, data::Dataset& dataset, protocol::View& view) {
  protocol::ScalarView medium;
  medium.field = "density";
  medium.color.map = "magma";
  medium.color.range = {0.0, 1.2};
  medium.min_optical_depth = 0;
  if (name == "stiff") {
    constexpr double cell = 2.0 / blob_samples;
    constexpr double depth_of_cell = 20;
    medium.extinction = {{{0.45, 0.0}, {0.4501, depth_of_cell / cell}}};
  } else {
    const auto deepest = deepest_row(dataset);
    if (!deepest) return deepest.error();
    const double depth = name == "dense" ? 10 : 1;
    medium.extinction = {{{0.0, 0.0}, {1.0, depth / *deepest}}};
  }
  view.scalars.emplace().push_back(medium);
  return {};
}

Result<Subject> blob_subject(const std::string& name, bool quick) {
  auto dataset = std::make_shared<data::Dataset>(make_blobs(), "blobs", resident_bytes_max);
  protocol::View view;
  view.dataset = "blobs";
  view.image.background = "#101418";
  view.scalars.emplace();
  if (name == "scalar") {
    view.vector.field = {protocol::FieldChoice::Kind::none, ""};
  } else {
    view.vector.field = {protocol::FieldChoice::Kind::named, "flow"};
    // Only the fastest tenth is drawn, or less in front of a medium: more would hide everything
    // behind them.
    view.vector.min_magnitude = name == "vectors" ? 0.34 : 0.45;
    view.vector.r1 = 3;  // about one pixel wide at the size of the study
    view.vector.r2 = 7;
    view.vector.magnitude_range = {0.0, 0.8};
    view.vector.color.by = protocol::ColorBy::magnitude;
    view.vector.color.range = {0.2, 0.8};
    view.vector.length = 0.3;
  }
  if (name != "vectors") {
    if (const auto set = set_medium(name, *dataset, view); !set) return set.error();
  }
  const int side = quick ? 64 : 128;
  auto subject = make_subject(name, std::move(dataset), view, {side, side});
  if (subject) subject->calibrated = false;  // made to compare methods, unlike viewed data
  return subject;
}

}  // namespace

std::vector<std::string> standard_names() {
  std::vector<std::string> names(blob_names.begin(), blob_names.end());
  names.insert(names.end(), sample_scenes.begin(), sample_scenes.end());
  return names;
}

Result<Subject> standard_subject(const std::string& name, bool quick) {
  if (is_one_of(name, blob_names)) return blob_subject(name, quick);
  if (!is_one_of(name, sample_scenes)) {
    std::string message = "there is no standard scene '" + printable(name) + "'; known scenes:";
    for (const std::string& known : standard_names()) {
      message += ' ';
      message += known;
    }
    return make_error(ErrorKind::not_found, std::move(message));
  }
  auto source = data::open_sample(name);
  if (!source) return source.error();
  auto dataset = std::make_shared<data::Dataset>(std::move(*source), name, resident_bytes_max);
  protocol::View view;
  view.dataset = name;
  return make_subject(name, std::move(dataset), view,
                      quick ? PictureSize{80, 60} : PictureSize{160, 120});
}

Result<Subject> make_subject(const std::string& name, std::shared_ptr<data::Dataset> dataset,
                             const protocol::View& view, PictureSize size) {
  protocol::View wanted = view;
  wanted.image.width = size.width;
  wanted.image.height = size.height;
  const bool framed = view.camera.eye || view.camera.target || view.camera.height;
  const auto completed = scene::complete(wanted, *dataset);
  if (!completed) return completed.error();
  protocol::View looked_at = completed->view();
  if (!framed) scene::orbit(looked_at, completed->lattice(), azimuth, elevation, 1);
  return Subject{name, std::move(looked_at), std::move(dataset)};
}

Knobs own_knobs(const protocol::View& view) {
  Knobs knobs;
  knobs.stride = view.vector.stride.value();
  const bool lines = view.vector.field.kind == protocol::FieldChoice::Kind::named;
  if (!lines && !view.scalars->empty()) knobs.stride = view.scalars->front().stride;
  knobs.span = view.vector.span;
  knobs.slab_thickness = view.method.slab_thickness;
  knobs.stop_transmittance = view.method.stop_transmittance;
  knobs.width = view.image.width;
  return knobs;
}

Knobs own_knobs(const Subject& subject) { return own_knobs(subject.view); }

Result<scene::Scene> scene_at(const Subject& subject, const Setting& setting) {
  const Knobs& knobs = setting.knobs;
  protocol::View view = subject.view;
  view.method.detail = protocol::Detail::full;  // all methods use the same medium and the same
                                                // lines
  view.image.width = knobs.width;
  view.image.height =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(subject.view.image.height) *
                                               knobs.width / subject.view.image.width)));
  // Layers of different strides keep their ratio. A scene is built for its strides: lines of a
  // store may be drawn from the vectors of one stride alone.
  const int own = own_knobs(subject).stride;
  const auto strided = [&](int stride) { return std::max(1, stride * knobs.stride / own); };
  view.vector.stride = strided(view.vector.stride.value());
  for (protocol::ScalarView& medium : *view.scalars) medium.stride = strided(medium.stride);
  auto scene = scene::build_scene(view, *subject.dataset);
  if (!scene) return scene.error();
  scene->method = setting.method;
  scene->compositing = setting.compositing;
  scene->slab_thickness = knobs.slab_thickness;
  scene->stop_transmittance = knobs.stop_transmittance;
  if (scene->vector) scene->vector->span = knobs.span;
  return scene;
}

}  // namespace windsplat::study
