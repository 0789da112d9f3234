// Extinctions -> transmittances along parallel rays -> their values at the samples.
#include "server/light/sunlight.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>

#include "server/base/check.hpp"
#include "server/base/thread_pool.hpp"

namespace windsplat::light {

namespace {

using scene::Lattice;
using scene::SampleFactors;
using scene::ScalarLayer;

constexpr double extinction_max = 1e30;  // as in the engine

std::size_t index(int i) { return static_cast<std::size_t>(i); }

// Extinction of a value: linear between points, constant beyond them; of two points at one value
// the second counts from there on.
class Function {
 public:
  Function(const ScalarLayer& layer, double factor) {
    for (const auto& [value, extinction] : layer.extinction) {
      x_.push_back(value);
      y_.push_back(factor * std::min(extinction, extinction_max));
    }
  }
  double operator()(double value) const {
    if (std::isnan(value)) return 0;
    const auto above =
        static_cast<std::size_t>(std::upper_bound(x_.begin(), x_.end(), value) - x_.begin());
    if (above == 0) return y_.front();
    if (above == x_.size()) return y_.back();
    const double part = (value - x_[above - 1]) / (x_[above] - x_[above - 1]);
    return y_[above - 1] + part * (y_[above] - y_[above - 1]);
  }

 private:
  std::vector<double> x_, y_;
};

// The sample that stands for each sample of an axis.
std::vector<int> kernel_samples(int samples, int stride) {
  std::vector<int> out;
  for (int i = 0; i < samples; ++i) {
    const int first = i - i % stride;
    out.push_back(first + (std::min(stride, samples - first) - 1) / 2);
  }
  return out;
}

void add_row(const ScalarLayer& layer, const Function& function, const std::vector<int>& along,
             std::size_t row, float* to) {
  using data::TwoValues;
  const data::Volume& field = *layer.field;
  const auto add = [&](const float* values, const float* shares) {
    for (std::size_t i = 0; i < along.size(); ++i) {
      const std::size_t at = row + index(along[i]);
      const double share = shares != nullptr ? static_cast<double>(shares[at]) : 1;
      if (!(share > 0)) continue;
      to[i] += static_cast<float>(share * function(static_cast<double>(values[at])));
    }
  };
  if (field.components == 1) return add(field.values.data(), nullptr);
  add(field.component(TwoValues::low), field.component(TwoValues::low_share));
  add(field.component(TwoValues::high), field.component(TwoValues::high_share));
}

// The rays along one axis across the layers, evenly spaced. Ray p passes a layer at the distance
// `down` from the first one's sunny face at origin + p pitch + slope down.
struct RayAxis {
  const std::vector<double>* positions = nullptr;
  // The faces of the box, but a ray further out where rays leave it or run along it: samples at the
  // face lie between a ray inside and one that the medium must have dimmed alike.
  double low = 0, high = 0;
  double origin = 0;
  double pitch = 1;
  double slope = 0;  // displacement for each unit down
  int first = 0;     // number of the first ray
  int count = 0;

  [[nodiscard]] double place(int ray, double down) const {
    return origin + (first + ray) * pitch + slope * down;
  }
  // The place among the rays, from the first one.
  [[nodiscard]] double ray_at(double place, double down) const {
    return (place - origin - slope * down) / pitch - first;
  }
};

// The faces of the cells along an axis.
std::vector<double> edges_of(const Lattice& lattice, int a) {
  const auto& spacing = lattice.spacing[index(a)];
  std::vector<double> edges{lattice.box_min[a]};  // samples need not be in the middle of cells
  for (const double width : spacing) edges.push_back(edges.back() + width);
  return edges;
}

// The faces of the box along an axis.
std::array<double, 2> ends_of(const Lattice& lattice, int a) {
  const std::vector<double> edges = edges_of(lattice, a);
  return {edges.front(), edges.back()};
}

RayAxis rays_along(const Lattice& lattice, int a, double slope, double depth) {
  RayAxis rays;
  rays.positions = &lattice.positions[index(a)];
  const auto [low, high] = ends_of(lattice, a);
  rays.slope = slope;
  rays.origin = rays.positions->front();
  const double mean = (high - low) / static_cast<double>(rays.positions->size());
  const auto& spacing = lattice.spacing[index(a)];
  rays.pitch = std::max(*std::min_element(spacing.begin(), spacing.end()), 0.25 * mean);
  // Spacings that differ by rounding only are even.
  if (rays.pitch > 0.999 * mean) rays.pitch = mean;
  rays.low = slope > 0 ? low : low - rays.pitch;
  rays.high = slope < 0 ? high : high + rays.pitch;
  const double least = std::min(0.0, slope * depth);
  const double most = std::max(0.0, slope * depth);
  rays.first = static_cast<int>(std::floor((rays.low - rays.origin - most) / rays.pitch));
  const int last = static_cast<int>(std::ceil((rays.high - rays.origin - least) / rays.pitch));
  rays.count = last - rays.first + 1;
  return rays;
}

// Where a layer lies below the sunny face of the box, and what its rays meet along one axis.
struct Crossing {
  std::vector<int> lower;     // sample below the ray, or the last but one
  std::vector<float> part;    // share of the next sample
  std::vector<float> enters;  // the part of the way through the layer before the box
  std::vector<float> leaves;  // the part of the way at its end
};

struct Layer {
  int number = 0;                          // of its samples
  double top = 0, middle = 0, bottom = 0;  // below the sunny face of the box
};

void cross(const RayAxis& rays, const Layer& layer, Crossing& to) {
  const auto count = index(rays.count);
  to.lower.resize(count);
  to.part.resize(count);
  to.enters.resize(count);
  to.leaves.resize(count);
  const auto& positions = *rays.positions;
  const int last = static_cast<int>(positions.size()) - 1;
  int low = 0;
  for (int p = 0; p < rays.count; ++p) {
    const double place = rays.place(p, layer.middle);
    while (low + 1 < last && positions[index(low + 1)] <= place) ++low;
    double part = 0;
    if (last > 0) {
      part = (place - positions[index(low)]) / (positions[index(low + 1)] - positions[index(low)]);
    }
    to.lower[index(p)] = low;
    to.part[index(p)] = static_cast<float>(std::clamp(part, 0.0, 1.0));
    const double from = rays.place(p, layer.top);
    const double way = rays.place(p, layer.bottom) - from;
    double enters = 0;
    double leaves = from >= rays.low && from <= rays.high ? 1 : 0;
    if (way != 0) {
      const double a = (rays.low - from) / way;
      const double b = (rays.high - from) / way;
      enters = std::clamp(std::min(a, b), 0.0, 1.0);
      leaves = std::clamp(std::max(a, b), 0.0, 1.0);
    }
    to.enters[index(p)] = static_cast<float>(enters);
    to.leaves[index(p)] = static_cast<float>(leaves);
  }
}

// Strides of the lattice, in samples.
struct Steps {
  std::size_t layer = 1, u = 1, v = 1;
};

// The rays of some rows (along v) and the samples between them.
class Band {
 public:
  Band(const std::vector<float>& extinctions, const Steps& steps, const RayAxis& u,
       const RayAxis& v, int first_row, int rows)
      : extinctions_(extinctions),
        steps_(steps),
        u_(u),
        v_(v),
        first_row_(first_row),
        rows_(rows),
        left_(index(u.count) * index(rows), 1.0F),
        mean_(left_) {}

  // way: through the layer, world units.
  void pass(const Layer& layer, double way, const Crossing& u, const Crossing& v,
            SampleFactors& to) {
    for (int row = 0; row < rows_; ++row) cross_layer(layer, way, u, v, row);
    const int samples = static_cast<int>(v_.positions->size());
    for (int j = 0; j < samples; ++j) {
      const double at = v_.ray_at((*v_.positions)[index(j)], layer.middle) - first_row_;
      const int row = static_cast<int>(std::floor(at));
      if (row < 0 || row >= rows_ - 1) continue;
      write_row(layer, row, at - row, j, to);
    }
  }

 private:
  void cross_layer(const Layer& layer, double way, const Crossing& u, const Crossing& v, int row) {
    const auto q = index(first_row_ + row);
    float* left = left_.data() + index(row) * index(u_.count);
    float* mean = mean_.data() + index(row) * index(u_.count);
    const float* const samples = extinctions_.data() + index(layer.number) * steps_.layer;
    const float* const near = samples + index(v.lower[q]) * steps_.v;
    const float* const far = v.part[q] > 0 ? near + steps_.v : near;
    const float beside = v.part[q];
    for (int p = 0; p < u_.count; ++p) {
      const auto n = index(p);
      const float inside = std::min(u.leaves[n], v.leaves[q]) - std::max(u.enters[n], v.enters[q]);
      mean[n] = left[n];
      if (!(inside > 0)) continue;
      const std::size_t at = index(u.lower[n]) * steps_.u;
      const float part = u.part[n];
      const std::size_t next = part > 0 ? at + steps_.u : at;
      const float first = near[at] + part * (near[next] - near[at]);
      const float second = far[at] + part * (far[next] - far[at]);
      const float rho = first + beside * (second - first);
      if (!(rho > 0)) continue;
      left[n] *= std::exp(-rho * inside * static_cast<float>(way));
      mean[n] = 0.5F * (mean[n] + left[n]);
    }
  }

  void write_row(const Layer& layer, int row, double part, int j, SampleFactors& to) const {
    const float* const near = mean_.data() + index(row) * index(u_.count);
    const float* const far = near + u_.count;
    std::uint16_t* const out = to.data() + index(layer.number) * steps_.layer + index(j) * steps_.v;
    const auto beside = static_cast<float>(part);
    const auto& positions = *u_.positions;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const double at = u_.ray_at(positions[i], layer.middle);
      const auto p = std::min(static_cast<std::size_t>(std::max(at, 0.0)), index(u_.count) - 2);
      const auto along = static_cast<float>(at - static_cast<double>(p));
      const float first = near[p] + along * (near[p + 1] - near[p]);
      const float second = far[p] + along * (far[p + 1] - far[p]);
      const float factor = first + beside * (second - first);
      out[i * steps_.u] = static_cast<std::uint16_t>(
          std::lround(static_cast<float>(scene::full_factor) * std::clamp(factor, 0.0F, 1.0F)));
    }
  }

  const std::vector<float>& extinctions_;
  const Steps& steps_;
  const RayAxis& u_;
  const RayAxis& v_;
  int first_row_;
  int rows_;
  std::vector<float> left_;  // transmittance of each ray so far
  std::vector<float> mean_;  // of those before and after the layer
};

// The layers across an axis from the sun on.
std::vector<Layer> layers_across(const Lattice& lattice, int axis, bool from_last) {
  const auto& positions = lattice.positions[index(axis)];
  const std::vector<double> edges = edges_of(lattice, axis);
  const int count = static_cast<int>(positions.size());
  std::vector<Layer> layers;
  for (int n = 0; n < count; ++n) {
    const int k = from_last ? count - 1 - n : n;
    const double below = edges[index(k)];
    const double above = edges[index(k) + 1];
    const double middle = positions[index(k)];
    if (from_last) {
      layers.push_back({k, edges.back() - above, edges.back() - middle, edges.back() - below});
    } else {
      layers.push_back({k, below - edges.front(), middle - edges.front(), above - edges.front()});
    }
  }
  return layers;
}

}  // namespace

int layer_axis(const Lattice& lattice, const glm::dvec3& sun) {
  int axis = 0;
  double most = -1;
  for (int a = 0; a < 3; ++a) {
    const auto [low, high] = ends_of(lattice, a);
    const double passed = std::abs(sun[a]) * lattice.dims[index(a)] / (high - low);
    if (passed > most) {
      most = passed;
      axis = a;
    }
  }
  return axis;
}

std::vector<float> extinctions(const Lattice& lattice, const std::vector<ScalarLayer>& media,
                               double factor, const CancelToken& cancel) {
  const std::size_t nx = index(lattice.dims[0]);
  const std::size_t ny = index(lattice.dims[1]);
  const std::size_t rows = ny * index(lattice.dims[2]);
  std::vector<float> out(nx * rows, 0.0F);
  constexpr std::size_t samples_a_thread = 65536;
  const auto pool = few_threads(out.size() / samples_a_thread);
  for (const ScalarLayer& layer : media) {
    const Function function(layer, factor);
    std::array<std::vector<int>, 3> kernels;
    for (int a = 0; a < 3; ++a) {
      kernels[index(a)] = kernel_samples(lattice.dims[index(a)], layer.stride);
    }
    pool->run(rows, [&](std::size_t row, unsigned) {
      if (cancel.cancelled()) return;
      const std::size_t y = index(kernels[1][row % ny]);
      const std::size_t z = index(kernels[2][row / ny]);
      add_row(layer, function, kernels[0], nx * (y + ny * z), out.data() + nx * row);
    });
  }
  return out;
}

SampleFactors sunlight(const Lattice& lattice, const std::vector<float>& extinctions,
                       const glm::dvec3& sun, const CancelToken& cancel) {
  WINDSPLAT_CHECK(lattice.places == nullptr);
  constexpr int rows_of_band = 32;
  const int m = layer_axis(lattice, sun);
  const int u = m == 0 ? 1 : 0;
  const int v = m == 2 ? 1 : 2;
  const std::array<std::size_t, 3> step{1, index(lattice.dims[0]),
                                        index(lattice.dims[0]) * index(lattice.dims[1])};
  const Steps steps{step[index(m)], step[index(u)], step[index(v)]};
  const auto [low, high] = ends_of(lattice, m);
  const double steep = std::abs(sun[m]);
  const RayAxis u_rays = rays_along(lattice, u, -sun[u] / steep, high - low);
  const RayAxis v_rays = rays_along(lattice, v, -sun[v] / steep, high - low);
  const std::vector<Layer> layers = layers_across(lattice, m, sun[m] > 0);
  SampleFactors out(extinctions.size());
  const int bands = (v_rays.count + rows_of_band - 1) / rows_of_band;
  const auto pool = few_threads(index(bands));
  pool->run(index(bands), [&](std::size_t number, unsigned) {
    const int first = static_cast<int>(number) * rows_of_band;
    // One row more, between which and the last the samples lie.
    const int rows = std::min(rows_of_band + 1, v_rays.count - first);
    Band band(extinctions, steps, u_rays, v_rays, first, rows);
    Crossing along_u;
    Crossing along_v;
    for (const Layer& layer : layers) {
      if (cancel.cancelled()) return;
      cross(u_rays, layer, along_u);
      cross(v_rays, layer, along_v);
      band.pass(layer, (layer.bottom - layer.top) / steep, along_u, along_v, out);
    }
  });
  return out;
}

}  // namespace windsplat::light
