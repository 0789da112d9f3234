// The groups of cases. Fields have few samples and pictures few pixels, so that the brute-force
// integral takes a fraction of a second.
#include "server/study/extremes/cases.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "server/study/extremes/samples.hpp"

namespace windsplat::study {

namespace {

using protocol::Projection;
using protocol::View;

constexpr int side = 4;  // samples along each axis
constexpr int picture_width = 24;
constexpr int picture_height = 18;

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

data::Grid cube_grid() { return box_grid({side, side, side}, {1, 1, 1}); }

// Lines of one to three pixels in a medium of this extinction at a density of 1, every sample
// drawn.
View base_view(Projection projection, double extinction = 0.5) {
  View view;
  view.ground.tint = view.ground.coastlines = false;  // the truth has one colour of the ground
  view.dataset = "extremes";
  view.camera.projection = projection;
  view.image.width = picture_width;
  view.image.height = picture_height;
  view.vector.field = {protocol::FieldChoice::Kind::named, "flow"};
  view.vector.length = 0.4;
  view.vector.r1 = 20;  // pixels at a height of 720
  view.vector.r2 = 60;
  view.method.detail = protocol::Detail::full;
  protocol::ScalarView medium;
  medium.field = "density";
  medium.color.map = "magma";
  medium.color.range = {0.0, 1.2};
  medium.extinction = {{{0.0, 0.0}, {1.0, extinction}}};
  medium.min_optical_depth = 0;
  view.scalars.emplace().push_back(medium);
  return view;
}

Case numbered(double value, View view, std::shared_ptr<data::Dataset> dataset) {
  return {text_of(value), value, std::move(view), std::move(dataset), false, {}};
}

// A case for each value: change(view, value) of the base view.
template <class Change>
std::vector<Case> vary(Projection projection, const std::vector<double>& values,
                       const Change& change) {
  const auto dataset = make_dataset(waves(cube_grid()));
  std::vector<Case> cases;
  for (const double value : values) {
    View view = base_view(projection);
    change(view, value);
    cases.push_back(numbered(value, std::move(view), dataset));
  }
  return cases;
}

// Of values beyond one of the limits of a view.
void refuse_beyond(double least, double most, const char* by_design, std::vector<Case>& cases) {
  for (Case& one : cases) {
    if (one.value < least || one.value > most) one.refused_by_design = by_design;
  }
}

// The edge of the box is 2; the last extinction is beyond the limit of a view.
std::vector<Case> depths(Projection projection) {
  std::vector<Case> cases =
      vary(projection, {1e-30, 1e-20, 1e-10, 1e-6, 1e-4, 1e-3, 1e-2, 0.1,  0.3,  1,    3,
                        10,    30,    100,   1e3,  1e4,  1e6,  1e8,  1e12, 1e20, 1e30, 3e30},
           [](View& view, double value) {
             view.scalars->front().extinction = {{{0.0, 0.0}, {1.0, value / 2}}};
           });
  refuse_beyond(0, 2e30, "/scalars/0/extinction/1/1", cases);
  return cases;
}

std::vector<Case> opacities(Projection projection) {
  std::vector<Case> cases = vary(projection, {0, 1e-6, 1e-3, 0.1, 0.5, 0.9, 1, 1.1},
                                 [](View& view, double value) { view.vector.opacity = value; });
  refuse_beyond(0, 1, "/vector/opacity", cases);
  return cases;
}

std::vector<Case> magnitudes(Projection projection) {
  std::vector<Case> cases;
  for (const double value : {1e-45, 1e-41, 1.2e-38, 1e-30, 1e-20, 1e-10, 1e-3, 1.0, 1e3, 1e10, 1e20,
                             1e30, 1e37, 1e38, 3e38}) {
    Samples samples = waves(cube_grid());
    for (float& v : samples.flow) v = static_cast<float>(value * static_cast<double>(v));
    cases.push_back(numbered(value, base_view(projection), make_dataset(std::move(samples))));
  }
  return cases;
}

template <class Change>
Case changed_samples(const char* label, Projection projection, const Change& change) {
  Samples samples = waves(cube_grid());
  change(samples);
  Case made;
  made.label = label;
  made.view = base_view(projection);
  made.dataset = make_dataset(std::move(samples));
  return made;
}

std::vector<Case> values(Projection projection) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float infinity = std::numeric_limits<float>::infinity();
  constexpr float largest = std::numeric_limits<float>::max();
  const auto fill = [](std::vector<float>& values, float value) {
    std::fill(values.begin(), values.end(), value);
  };
  std::vector<Case> cases;
  const auto add = [&](const char* label, const auto& change) {
    cases.push_back(changed_samples(label, projection, change));
  };
  add("every other sample masked", [=](Samples& s) {
    for (std::size_t i = 0; i < s.density.size(); i += 2) s.density[i] = s.flow[i] = nan;
  });
  add("a masked half", [=](Samples& s) {
    std::fill_n(s.density.begin(), s.density.size() / 2, nan);
    std::fill_n(s.flow.begin(), s.density.size() / 2, nan);
  });
  add("infinite samples", [=](Samples& s) {
    for (std::size_t i = 0; i < s.density.size(); i += 3) {
      s.density[i] = infinity;
      s.flow[i] = -infinity;
    }
  });
  add("one unmasked sample", [=](Samples& s) {
    const std::array<float, 2> kept{s.density[21], s.flow[21]};
    fill(s.density, nan);
    std::fill_n(s.flow.begin(), s.density.size(), nan);
    s.density[21] = kept[0];
    s.flow[21] = kept[1];
  });
  add("all masked", [=](Samples& s) {
    fill(s.density, nan);
    fill(s.flow, nan);
  });
  cases.back().invisible = true;
  add("all zero", [=](Samples& s) {
    fill(s.density, 0);
    fill(s.flow, 0);
  });
  cases.back().invisible = true;
  add("constant", [=](Samples& s) {
    fill(s.density, 0.5F);
    fill(s.flow, 1);
  });
  add("constant, every default", [=](Samples& s) {
    fill(s.density, 0.5F);
    fill(s.flow, 1);
  });
  cases.back().view.scalars->front() = {};
  cases.back().view.scalars->front().field = "density";
  cases.back().view.vector.length.reset();
  add("negative", [=](Samples& s) {
    for (float& v : s.density) v = -v;
  });
  add("largest floats", [=](Samples& s) {
    for (float& v : s.density) v = largest;
    for (float& v : s.flow) v = v < 0 ? -largest : largest;
  });
  add("zero beside 1e30", [=](Samples& s) {
    for (std::size_t i = 0; i < s.density.size(); ++i) s.density[i] = i % 2 == 0 ? 0 : 1e30F;
    for (std::size_t i = 0; i < s.flow.size(); ++i) s.flow[i] *= i % 2 == 0 ? 1e-30F : 1e30F;
  });
  return cases;
}

std::vector<Case> axes(Projection projection) {
  std::vector<Case> cases;
  for (const std::array<int, 3>& dims : {std::array{1, 1, 1},
                                         {6, 1, 1},
                                         {1, 6, 1},
                                         {1, 1, 6},
                                         {4, 4, 1},
                                         {4, 1, 4},
                                         {1, 4, 4},
                                         {2, 2, 2},
                                         {2, 12, 2}}) {
    Case made;
    made.label =
        std::to_string(dims[0]) + " x " + std::to_string(dims[1]) + " x " + std::to_string(dims[2]);
    made.view = base_view(projection);
    made.dataset = make_dataset(waves(box_grid(dims, {1, 1, 1})));
    cases.push_back(std::move(made));
  }
  return cases;
}

// The narrowest cell may be 1e-7 times as wide as the widest.
constexpr double aspect_max = 1e7;
const std::vector<double> aspects{1, 10, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8};

// Flat cells, of an optical depth of 0.25 across.
std::vector<Case> plates(Projection projection) {
  std::vector<Case> cases;
  cases.reserve(aspects.size());
  for (const double aspect : aspects) {
    View view = base_view(projection, aspect / 2);
    view.geometry.vertical = protocol::VerticalPlacement::metric;
    cases.push_back(
        numbered(aspect, std::move(view),
                 make_dataset(waves(box_grid({side, side, side}, {1, 1, 1 / aspect})))));
  }
  refuse_beyond(1, aspect_max, "the narrowest cell of axis", cases);
  return cases;
}

// Long cells seen along their length, magnified as far as a view permits.
std::vector<Case> needles(Projection projection) {
  std::vector<Case> cases;
  for (const double aspect : aspects) {
    View view = base_view(projection);
    view.camera.eye = {{0, 0, 3}};
    view.camera.target = {{0, 0, 0}};
    view.camera.up = {0, 1, 0};
    view.camera.height = std::max(3 / aspect, 1e-6);
    view.camera.fov_y = std::max(50 / aspect, 0.001);
    cases.push_back(
        numbered(aspect, std::move(view),
                 make_dataset(waves(box_grid({side, side, side}, {1 / aspect, 1 / aspect, 1})))));
  }
  refuse_beyond(1, aspect_max, "the narrowest cell of axis", cases);
  return cases;
}

const std::vector<double> angles{0.0009, 0.001, 0.01, 0.1, 1,   5,   15,  35,
                                 60,     90,    120,  150, 170, 178, 179, 179.5};

void refuse_angles(std::vector<Case>& cases) { refuse_beyond(0.001, 179, "/camera/fovY", cases); }

std::vector<Case> fields_of_view(Projection projection) {
  if (projection == Projection::orthographic) return {};
  std::vector<Case> cases =
      vary(projection, angles, [](View& view, double value) { view.camera.fov_y = value; });
  refuse_angles(cases);
  return cases;
}

// The eye stays where it is.
std::vector<Case> zooms(Projection projection) {
  if (projection == Projection::orthographic) return {};
  std::vector<Case> cases = vary(projection, angles, [](View& view, double value) {
    view.camera.eye = {{1.2, -2.4, 1.3}};
    view.camera.target = {{0.1, 0, 0}};
    view.camera.fov_y = value;
  });
  refuse_angles(cases);
  return cases;
}

// The samples of the cube lie at -0.75, -0.25, 0.25 and 0.75 along each axis.
std::vector<Case> eyes(Projection projection) {
  struct Place {
    const char* label;
    protocol::Vec3 eye;
  };
  constexpr std::array<Place, 11> places{{{"outside", {1.2, -2.4, 1.3}},
                                          {"on a face of the box", {0.13, -1, 0.21}},
                                          {"at a corner of the box", {-1, -1, -1}},
                                          {"inside a cell", {0.13, -0.31, 0.21}},
                                          {"at the centre", {0, 0, 0}},
                                          {"at a sample", {0.25, -0.25, 0.25}},
                                          {"1e-6 beside a sample", {0.250001, -0.25, 0.25}},
                                          {"on a face of a cell", {0.13, -0.5, 0.21}},
                                          {"on an edge of a cell", {0.13, -0.5, 0.5}},
                                          {"beyond the box", {0.5, 3, -0.5}},
                                          {"1e6 away", {-299440, -898302, 321622}}}};
  const auto dataset = make_dataset(waves(cube_grid()));
  std::vector<Case> cases;
  for (const Place& place : places) {
    Case made;
    made.label = place.label;
    made.dataset = dataset;
    made.view = base_view(projection);
    made.view.camera.eye = place.eye;
    const bool far = std::abs(place.eye[0]) > 1e3;
    made.view.camera.target =
        far ? protocol::Vec3{0, 0, 0}
            : protocol::Vec3{place.eye[0] + 0.3, place.eye[1] + 1, place.eye[2] - 0.4};
    made.view.camera.fov_y = far ? 0.001 : 60;
    made.view.camera.height = far ? 4 : 2;
    cases.push_back(std::move(made));
  }
  return cases;
}

std::vector<Case> strides(Projection projection) {
  const auto dataset = make_dataset(waves(box_grid({6, 5, 6}, {1, 1, 1})));
  std::vector<Case> cases;
  for (const double value : {1.0, 2.0, 3.0, 4.0, 8.0, 16.0, 32.0, 64.0, 65.0}) {
    View view = base_view(projection);
    view.vector.stride = view.scalars->front().stride = static_cast<int>(value);
    cases.push_back(numbered(value, std::move(view), dataset));
  }
  refuse_beyond(1, 64, "/vector/stride", cases);
  return cases;
}

std::vector<Case> thicknesses(Projection projection) {
  std::vector<Case> cases =
      vary(projection, {0.04, 0.05, 0.1, 0.25, 0.5, 1, 2, 4, 8, 16, 32, 64, 65},
           [](View& view, double value) { view.method.slab_thickness = value; });
  refuse_beyond(0.05, 64, "/method/slabThickness", cases);
  return cases;
}

std::vector<Case> pictures(Projection projection) {
  const auto dataset = make_dataset(waves(cube_grid()));
  std::vector<Case> cases;
  for (const std::array<int, 2>& size : {std::array{1, 1},
                                         {1, 18},
                                         {24, 1},
                                         {2, 2},
                                         {97, 61},
                                         {1920, 1088},
                                         {8192, 1},
                                         {1, 8192},
                                         {8192, 4320},
                                         {8193, 1},
                                         {8192, 4321}}) {
    Case made;
    made.label = std::to_string(size[0]) + " x " + std::to_string(size[1]);
    made.dataset = dataset;
    made.view = base_view(projection);
    made.view.image.width = size[0];
    made.view.image.height = size[1];
    if (size[0] > 8192) made.refused_by_design = "/image/width";
    if (size[0] == 8192 && size[1] > 4320) made.refused_by_design = "/image: ";
    cases.push_back(std::move(made));
  }
  return cases;
}

Samples terrain_samples() {
  Samples samples = waves(cube_grid());
  for (int k = 0; k < side; ++k) {
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        samples.height.push_back(static_cast<float>(k + 0.5 * std::sin(2 * i) * std::cos(j)));
      }
    }
  }
  return samples;
}

Samples map_samples() {
  Samples samples = waves(cube_grid());
  auto columns = std::make_shared<data::Columns>();
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      columns->longitude.push_back(10 + 2 * i + 0.7 * j);
      columns->latitude.push_back(40 + 2 * j - 0.4 * i);
    }
  }
  samples.grid.columns = std::move(columns);
  return samples;
}

std::vector<Case> mappings(Projection projection) {
  using protocol::GeometryMapping;
  using protocol::GroundShow;
  std::vector<Case> cases;
  const auto add = [&](const char* label, Samples samples) -> View& {
    Case made;
    made.label = label;
    made.view = base_view(projection);
    made.dataset = make_dataset(std::move(samples));
    cases.push_back(std::move(made));
    return cases.back().view;
  };
  const auto add_globe = [&](const char* label, std::array<int, 3> dims, bool poles,
                             GroundShow body) -> View& {
    View& view = add(label, waves(globe_grid(dims, poles)));
    view.geometry.mapping = GeometryMapping::sphere;
    view.ground.show = body;
    return view;
  };
  add("flat", waves(cube_grid()));
  add("flat with ground", waves(cube_grid())).ground.show = GroundShow::on;
  add("slice across x", waves(cube_grid())).geometry.slice = {protocol::GridAxis::x, 1};
  add("slice across z", waves(cube_grid())).geometry.slice = {protocol::GridAxis::z, 2};
  add("terrain", terrain_samples()).geometry.height_field = "height";
  View& ground = add("terrain with ground", terrain_samples());
  ground.geometry.height_field = "height";
  ground.ground.show = GroundShow::on;
  add("curvilinear", map_samples()).geometry.mapping = GeometryMapping::curvilinear;
  add_globe("sphere, no body", {10, 5, 3}, false, GroundShow::off);
  add_globe("sphere with poles, no body", {10, 5, 3}, true, GroundShow::off);
  add_globe("sphere", {10, 5, 3}, false, GroundShow::automatic);
  add_globe("sphere, world vectors", {10, 5, 3}, false, GroundShow::automatic).vector.space =
      protocol::VectorSpace::world;
  add_globe("sphere of one layer", {10, 5, 1}, false, GroundShow::automatic);
  add("sphere of a box", waves(cube_grid())).geometry.mapping = GeometryMapping::sphere;
  cases.back().refused_by_design = "/geometry/mapping: sphere requires longitudes and latitudes";
  return cases;
}

}  // namespace

const std::vector<Group>& groups() {
  static const std::vector<Group> all{
      {"depth", "optical depth through the box", true, depths},
      {"opacity", "opacity of lines", true, opacities},
      {"magnitude", "magnitude of vectors", false, magnitudes},
      {"values", "values of samples", false, values},
      {"axes", "samples along the axes", false, axes},
      {"plates", "width over height of flat cells", false, plates},
      {"needles", "length over width of long cells", false, needles},
      {"fov", "field of view of a framed box, degrees", false, fields_of_view},
      {"zoom", "field of view from a fixed eye, degrees", false, zooms},
      {"eye", "place of the eye", false, eyes},
      {"stride", "stride, samples", false, strides},
      {"slabs", "slab thickness, cells", false, thicknesses},
      {"picture", "size of the picture, pixels", false, pictures},
      {"mapping", "mapping of the grid", false, mappings}};
  return all;
}

std::vector<std::string> group_names() {
  std::vector<std::string> names;
  for (const Group& group : groups()) names.emplace_back(group.name);
  return names;
}

const char* parameter_of(const std::string& group) {
  for (const Group& one : groups()) {
    if (group == one.name) return one.parameter;
  }
  return "";
}

}  // namespace windsplat::study
