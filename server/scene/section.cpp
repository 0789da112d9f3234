// Plane and box -> directions and pitch; places between samples -> interpolated values.
#include "server/scene/section.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <utility>

#include "server/base/check.hpp"
#include "server/base/thread_pool.hpp"
#include "server/scene/lattice.hpp"
#include "server/scene/place.hpp"
#include "server/scene/refusal.hpp"

namespace windsplat::scene {

namespace {

using data::Volume;
using Clock = std::chrono::steady_clock;

// The samples next to a place, and the share of the second along each axis.
struct Neighbours {
  std::array<int, 3> low{};
  std::array<double, 3> part{};
};

constexpr double rounding = 1e-9;  // of a cell

// A place as close to a sample as rounding allows has no share of the next one.
void snap(int axis, double part, Neighbours& at) {
  if (part > 1 - rounding) ++at.low[axis];
  at.part[axis] = part > rounding && part <= 1 - rounding ? part : 0;
}

// `at.low` of the previous sample is where the search begins.
void seek(const std::vector<double>& positions, double x, int axis, Neighbours& at) {
  auto low = static_cast<std::size_t>(at.low[axis]);
  while (low > 0 && positions[low] > x) --low;
  while (low + 1 < positions.size() && positions[low + 1] <= x) ++low;
  at.low[axis] = static_cast<int>(low);
  at.part[axis] = 0;
  if (x < positions[low] || low + 1 == positions.size()) return;
  snap(axis, (x - positions[low]) / (positions[low + 1] - positions[low]), at);
}

glm::dvec3 place_of(const Section& section, int i, int j, int k) {
  const std::array<int, 3> sample{i, j, k};
  glm::dvec3 at = section.first;
  for (int a = 0; a < 3; ++a) at += sample[a] * section.pitch[a] * section.along[a];
  return at;
}

// False outside of the box. `at`: neighbours of any sample, best those of the previous one.
bool find_neighbours(const Section& section, int i, int j, int k, Neighbours& at) {
  const Lattice& whole = *section.whole;
  if (!section.oblique) {
    at = {{i, j, k}, {0, 0, 0}};
    at.low[section.axis] = static_cast<int>(section.index);
    snap(section.axis, section.index - std::floor(section.index), at);
    return true;
  }
  const glm::dvec3 place = place_of(section, i, j, k);
  for (int a = 0; a < 3; ++a) {
    const double margin = rounding * (whole.box_max[a] - whole.box_min[a]);
    if (place[a] < whole.box_min[a] - margin || place[a] > whole.box_max[a] + margin) return false;
    seek(whole.positions[a], place[a], a, at);
  }
  return true;
}

// The place of a sample of a layer of a curved lattice, on the straight line between its
// neighbours.
glm::dvec3 place_between(const Section& section, int i, int j, int k) {
  Neighbours at;
  find_neighbours(section, i, j, k, at);
  const Lattice& whole = *section.whole;
  const auto place = [&](const std::array<int, 3>& sample) {
    const auto row = static_cast<std::size_t>(sample[2]) * whole.dims[1] + sample[1];
    const auto& near = (*whole.places)[row * whole.dims[0] + sample[0]];
    return glm::dvec3(near[0], near[1], near[2]);
  };
  const glm::dvec3 low = place(at.low);
  const double part = at.part[section.axis];
  if (!(part > 0)) return low;
  ++at.low[section.axis];
  return low + part * (place(at.low) - low);
}

double value_at(const float* values, const std::array<int, 3>& dims, const Neighbours& at) {
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double share = 1;
    std::size_t index = 0;
    for (int a = 2; a >= 0; --a) {
      const unsigned next = corner >> static_cast<unsigned>(a) & 1U;
      share *= next != 0 ? at.part[a] : 1 - at.part[a];
      index =
          index * static_cast<std::size_t>(dims[a]) + static_cast<std::size_t>(at.low[a]) + next;
    }
    if (share > 0) sum += share * static_cast<double>(values[index]);
  }
  return sum;
}

double value_at(const std::vector<double>& values, int axis, const Neighbours& at) {
  const auto low = static_cast<std::size_t>(at.low[axis]);
  const double part = at.part[axis];
  return part > 0 ? (1 - part) * values[low] + part * values[low + 1] : values[low];
}

std::size_t samples_of(const Section& section) {
  std::size_t samples = 1;
  for (const int count : section.dims) samples *= static_cast<std::size_t>(count);
  return samples;
}

// The components of a vector that was turned may exceed those of the data and the range of float;
// a conversion beyond it is undefined.
float as_float(double value) {
  constexpr double most = std::numeric_limits<float>::max();
  return static_cast<float>(value < -most ? -most : value > most ? most : value);
}

// Calls visit(n, i, j, k, neighbours) for each sample, on several threads if there are many;
// `neighbours` are those left by the previous call on the thread.
template <class Visit>
void each_sample(const Section& section, const Visit& visit) {
  constexpr std::size_t block = 4096;
  constexpr std::size_t blocks_a_thread = 16;
  const std::size_t samples = samples_of(section);
  const std::size_t blocks = (samples + block - 1) / block;
  const auto pool = few_threads(blocks / blocks_a_thread);
  const auto [nx, ny, nz] = section.dims;
  const Clock::time_point began = Clock::now();
  pool->run(blocks, [&, nx = nx, ny = ny](std::size_t number, unsigned) {
    const std::size_t end = std::min(samples, (number + 1) * block);
    std::size_t n = number * block;
    const std::size_t row = n / static_cast<std::size_t>(nx);
    int i = static_cast<int>(n % static_cast<std::size_t>(nx));
    int j = static_cast<int>(row % static_cast<std::size_t>(ny));
    int k = static_cast<int>(row / static_cast<std::size_t>(ny));
    Neighbours neighbours;
    for (; n < end; ++n) {
      visit(n, i, j, k, neighbours);
      if (++i < nx) continue;
      i = 0;
      if (++j < ny) continue;
      j = 0;
      ++k;
    }
  });
  const auto took = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - began);
  *section.sampling_us += took.count();
}

// A volume of which visit(neighbours, values) sets the components of each sample that lies
// in the box; the others are masked.
template <class Visit>
Volume filled(const Section& section, int components, const Visit& visit) {
  Volume out;
  out.dims = section.dims;
  out.components = components;
  const std::size_t samples = samples_of(section);
  out.values = data::Samples(samples * static_cast<std::size_t>(components));
  each_sample(section, [&](std::size_t n, int i, int j, int k, Neighbours& neighbours) {
    std::array<double, 3> values{};
    values.fill(std::numeric_limits<double>::quiet_NaN());
    if (find_neighbours(section, i, j, k, neighbours)) visit(neighbours, values);
    for (int c = 0; c < components; ++c) {
      out.values[static_cast<std::size_t>(c) * samples + n] = as_float(values[c]);
    }
  });
  finish_volume(out);
  return out;
}

glm::dvec3 vector_at(const Volume& volume, const Neighbours& at) {
  glm::dvec3 out(0);
  for (int c = 0; c < std::min(volume.components, 3); ++c) {
    out[c] = value_at(volume.component(c), volume.dims, at);
  }
  return out;
}

// The direction in which a vector is drawn, of any length.
glm::dvec3 drawn_along(glm::dvec3 vector, const ComponentFactors& factors, const Neighbours& at) {
  vector *= factors.scale;
  if (const auto& rates = factors.rates) {
    vector *= glm::dvec3(value_at(rates->x, 1, at), rates->y, value_at(rates->z, 2, at));
  }
  return vector;
}

glm::dvec3 unit(const glm::dvec3& vector) {
  const double length = glm::length(vector);
  return length > 0 ? vector / length : glm::dvec3(0);
}

double bearing(const glm::dvec3& vector) {
  const double degrees = std::atan2(vector.x, vector.y) * 180 / std::numbers::pi;
  return degrees < 0 ? degrees + 360 : degrees;
}

// ---- the plane ----

// The length of a cell along a direction.
double cell_along(const Lattice& lattice, const glm::dvec3& direction) {
  double cells2 = 0;
  for (int a = 0; a < 3; ++a) {
    const double cells = direction[a] / cell_size(lattice, static_cast<std::size_t>(a));
    cells2 += cells * cells;
  }
  return 1 / std::sqrt(cells2);
}

// Sets the directions of a plane with this unit normal.
void set_directions(glm::dvec3 normal, Section& section) {
  int axis = 0;
  for (int a = 1; a < 3; ++a) {
    if (std::abs(normal[a]) >= std::abs(normal[axis])) axis = a;
  }
  if (normal[axis] < 0) normal = -normal;
  const int u = axis == 0 ? 1 : 0;
  const int v = axis == 2 ? 1 : 2;
  glm::dvec3 first(0);
  first[u] = 1;
  first = glm::normalize(first - normal[u] * normal);
  glm::dvec3 second = glm::cross(normal, first);
  if (second[v] < 0) second = -second;
  section.axis = axis;
  section.along[axis] = normal;
  section.along[u] = first;
  section.along[v] = second;
}

struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
};

// The extents of points along the directions of a plane.
std::array<Extent, 3> extents_of(const std::vector<glm::dvec3>& points, const Section& section) {
  std::array<Extent, 3> extents;
  for (const glm::dvec3& point : points) {
    for (int c = 0; c < 3; ++c) {
      const double at = glm::dot(section.along[c], point);
      extents[c] = {std::min(extents[c].low, at), std::max(extents[c].high, at)};
    }
  }
  return extents;
}

std::string text_of(const glm::dvec3& point) {
  std::ostringstream text;
  text << '(' << point.x << ", " << point.y << ", " << point.z << ')';
  return text.str();
}

Result<Section> make_plane(const protocol::PlaneView& plane, const Lattice& whole) {
  Section section;
  section.whole = &whole;
  section.oblique = true;
  const glm::dvec3 point(plane.point[0], plane.point[1], plane.point[2]);
  set_directions(glm::normalize(glm::dvec3(plane.normal[0], plane.normal[1], plane.normal[2])),
                 section);
  const auto met = points_in_box(whole, point, section.along[section.axis]);
  const auto extents = extents_of(met, section);
  if (met.empty()) {
    return invalid_at("/geometry/plane/point", "the plane misses the box of the data, from " +
                                                   text_of(whole.box_min) + " to " +
                                                   text_of(whole.box_max) +
                                                   " in the world: move the point into it");
  }
  double samples = 1;
  section.first = glm::dot(section.along[section.axis], point) * section.along[section.axis];
  for (int a = 0; a < 3; ++a) {
    section.pitch[a] = cell_along(whole, section.along[a]);
    if (a == section.axis) continue;
    const double length = extents[a].high - extents[a].low;
    const double count = std::max(std::round(length / section.pitch[a]), 1.0);
    samples *= count;
    if (length > 0) section.pitch[a] = length / count;
    section.first += (extents[a].low + 0.5 * section.pitch[a]) * section.along[a];
    section.dims[a] = static_cast<int>(std::min(count, 1e9));
  }
  if (samples > static_cast<double>(plane_samples_max)) {
    std::ostringstream text;
    text << "the plane has " << static_cast<std::int64_t>(samples)
         << " samples, more than the limit of " << plane_samples_max
         << ": a layer (/geometry/slice) has no limit";
    return invalid_at("/geometry/plane", text.str());
  }
  return section;
}

void append(const std::vector<double>& values, std::vector<double>& to) {
  to.insert(to.end(), values.begin(), values.end());
}

// Determines what is sampled: places in the grid, and of a plane also the placement of the grid.
std::vector<double> numbers_of(const Section& section) {
  std::vector<double> out{static_cast<double>(section.axis), section.oblique ? 1.0 : 0.0,
                          section.index};
  if (section.oblique) append(section.placement, out);
  return out;
}

void append_factors(const ComponentFactors& factors, std::vector<double>& to) {
  for (int a = 0; a < 3; ++a) to.push_back(factors.scale[a]);
  if (!factors.rates) return;
  append(factors.rates->x, to);
  to.push_back(factors.rates->y);
  append(factors.rates->z, to);
}

// All bytes of the numbers, which clients choose: two planes with the same digest could be found.
std::string key_of(const char* what, const std::vector<double>& numbers) {
  return what + std::string(reinterpret_cast<const char*>(numbers.data()),
                            numbers.size() * sizeof(double));
}

// What determines the places of the samples of a dataset, and the plane.
std::vector<double> placement_of(const protocol::GeometryView& geometry, const Lattice& whole) {
  std::vector<double> out{static_cast<double>(geometry.mapping),
                          static_cast<double>(geometry.vertical)};
  out.insert(out.end(), whole.first.begin(), whole.first.end());
  out.insert(out.end(), whole.dims.begin(), whole.dims.end());
  out.insert(out.end(), geometry.scale.begin(), geometry.scale.end());
  if (geometry.plane) {
    out.insert(out.end(), geometry.plane->point.begin(), geometry.plane->point.end());
    out.insert(out.end(), geometry.plane->normal.begin(), geometry.plane->normal.end());
  }
  return out;
}

std::uint64_t bytes_of(const Section& section, std::size_t components) {
  return samples_of(section) * components * sizeof(float);
}

std::array<float, 3> rounded(const glm::dvec3& place) {
  return {static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z)};
}

}  // namespace

Result<Section> make_section(const protocol::GeometryView& geometry, const Lattice& whole) {
  if (geometry.plane) {
    auto plane = make_plane(*geometry.plane, whole);
    if (plane) plane->placement = placement_of(geometry, whole);
    return plane;
  }
  Section section;
  section.whole = &whole;
  section.placement = placement_of(geometry, whole);
  section.heights = geometry.height_field.value_or("");
  section.axis = static_cast<int>(geometry.slice->axis);
  section.index = slice_index(*geometry.slice, whole);
  section.dims = whole.dims;
  section.dims[section.axis] = 1;
  for (std::size_t a = 0; a < 3; ++a) section.pitch[a] = cell_size(whole, a);
  return section;
}

std::vector<double> along_section(const Section& section, int axis, std::vector<double> values) {
  if (axis != section.axis || section.oblique) return values;
  Neighbours at;
  find_neighbours(section, 0, 0, 0, at);
  return {value_at(values, axis, at)};
}

std::string places_of(const Section& section) {
  if (!section.oblique && !section.whole->places) return "";
  std::vector<double> numbers = numbers_of(section);
  append(section.placement, numbers);
  return key_of("places", numbers) + section.heights;
}

Result<Lattice> lattice_of(const Section& section, data::Dataset& dataset) {
  using Places = std::vector<std::array<float, 3>>;
  const Lattice& whole = *section.whole;
  Lattice out = whole;
  out.dims = section.dims;
  if (out.dims[0] == 1) out.around = 0;
  for (int a = 0; a < 3; ++a) {
    out.positions[a] = along_section(section, a, whole.positions[a]);
    out.spacing[a] = along_section(section, a, whole.spacing[a]);
    if (!section.oblique) continue;
    out.positions[a].clear();
    for (int i = 0; i < section.dims[a]; ++i) {
      out.positions[a].push_back(glm::dot(section.first, section.along[a]) + i * section.pitch[a]);
    }
    out.spacing[a].assign(static_cast<std::size_t>(section.dims[a]), section.pitch[a]);
  }
  const std::string key = places_of(section);
  if (key.empty()) return out;
  const std::size_t samples = samples_of(section);
  auto kept = dataset.auxiliary(key, samples * sizeof(Places::value_type), [&] {
    auto places = std::make_shared<Places>(samples);
    each_sample(section, [&](std::size_t n, int i, int j, int k, Neighbours&) {
      (*places)[n] =
          rounded(section.oblique ? place_of(section, i, j, k) : place_between(section, i, j, k));
    });
    return places;
  });
  if (!kept) return kept.error();
  out.places = std::static_pointer_cast<const Places>(*kept);
  WINDSPLAT_CHECK(out.places->size() == samples);
  return out;
}

data::Derivation sampled(const Section& section, int components) {
  return {key_of("section", numbers_of(section)),
          bytes_of(section, static_cast<std::size_t>(components)), [section](const Volume& volume) {
            return filled(section, volume.components, [&](const Neighbours& at, auto& values) {
              const glm::dvec3 value = vector_at(volume, at);
              for (int c = 0; c < volume.components; ++c) values[c] = value[c];
            });
          }};
}

data::Derivation sampled_vectors(const Section& section, const ComponentFactors& factors) {
  std::vector<double> numbers = numbers_of(section);
  append_factors(factors, numbers);
  return {
      key_of("vectors", numbers), bytes_of(section, 3), [section, factors](const Volume& volume) {
        return filled(section, 3, [&](const Neighbours& at, auto& values) {
          const glm::dvec3 vector = vector_at(volume, at);
          const glm::dvec3 turned = glm::length(vector) * unit(drawn_along(vector, factors, at));
          for (int a = 0; a < 3; ++a) values[a] = glm::dot(turned, section.along[a]);
        });
      }};
}

data::Derivation sampled_colors(const Section& section, const ComponentFactors& factors,
                                const VectorLayer& layer) {
  const auto [bottom, top] = height_range(*section.whole);
  const auto [low, high] = layer.color.range;
  const double full = layer.magnitude_range[1];
  const double weight = layer.rise_weight;
  const LineColor by = layer.color_by;
  std::vector<double> numbers = numbers_of(section);
  numbers.push_back(static_cast<double>(by));
  if (by != LineColor::world_z) append_factors(factors, numbers);
  if (by == LineColor::rise) {
    numbers.insert(numbers.end(), {low, high, layer.length, full, weight, bottom, top});
  }
  const auto color = [section, factors, by, full, weight, length = layer.length, bottom = bottom,
                      top = top, low = low,
                      high = high](const Volume& volume, const Neighbours& at) {
    const double z = value_at(section.whole->positions[2], 2, at);
    if (by == LineColor::world_z) return z;
    const glm::dvec3 vector = vector_at(volume, at);
    const glm::dvec3 direction = unit(drawn_along(vector, factors, at));
    if (by == LineColor::direction) {
      const glm::dvec3& normal = section.along[section.axis];
      return bearing(direction - glm::dot(direction, normal) * normal);
    }
    const double part = full > 0 ? std::min(glm::length(vector) / full, 1.0) : 1.0;
    const double rise = direction.z * part * length;
    return (1 - weight) * (z - bottom) / (top - bottom) + weight * (rise - low) / (high - low);
  };
  return {key_of("colors", numbers), bytes_of(section, 1), [section, color](const Volume& volume) {
            return filled(section, 1, [&](const Neighbours& at, auto& values) {
              values[0] = color(volume, at);
            });
          }};
}

}  // namespace windsplat::scene
