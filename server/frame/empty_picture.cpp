// Ranges and masks of what is shown, compared with the thresholds of the view.
#include "server/frame/empty_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/volume.hpp"

namespace windsplat::frame {
namespace {

std::string number(double value) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::string quoted(const std::string& name) {
  std::string out = "\"";
  return out.append(printable(name)).append("\"");
}

// Values of a scalar, or magnitudes of a vector, of the samples shown; nullopt: all are masked.
using Span = std::optional<std::array<double, 2>>;

double value_of(const data::Volume& volume, std::size_t n) {
  if (volume.components == 1) return static_cast<double>(volume.component(0)[n]);
  std::array<double, 3> v{};
  for (int c = 0; c < std::min(volume.components, 3); ++c) {
    v[static_cast<std::size_t>(c)] = static_cast<double>(volume.component(c)[n]);
  }
  return std::hypot(v[0], v[1], v[2]);
}

Span span_of_slice(const data::Volume& volume, const scene::Slice& slice) {
  const auto axis = static_cast<std::size_t>(slice.axis);
  std::size_t stride = 1;
  for (std::size_t a = 0; a < axis; ++a) stride *= static_cast<std::size_t>(volume.dims[a]);
  const auto length = static_cast<std::size_t>(volume.dims[axis]);
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (std::size_t n = 0; n < volume.samples() / length; ++n) {
    const std::size_t at =
        (n / stride * length + static_cast<std::size_t>(slice.sample)) * stride + n % stride;
    const double value = value_of(volume, at);
    if (!std::isfinite(value)) continue;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  if (low > high) return std::nullopt;
  return std::array{low, high};
}

Span span_of(const data::Volume& volume, const std::optional<scene::Slice>& slice) {
  if (slice && volume.components != data::TwoValues::components) {
    return span_of_slice(volume, *slice);
  }
  if (volume.masked == static_cast<std::int64_t>(volume.samples())) return std::nullopt;
  return std::array{static_cast<double>(volume.range[0]), static_cast<double>(volume.range[1])};
}

// The largest extinction between two values of a piecewise linear table that is constant beyond its
// ends.
double largest_extinction(const std::vector<std::array<double, 2>>& table,
                          const std::array<double, 2>& values) {
  const auto at = [&table](double value) {
    if (value <= table.front()[0]) return table.front()[1];
    for (std::size_t i = 1; i < table.size(); ++i) {
      if (value > table[i][0]) continue;
      const double share = (value - table[i - 1][0]) / (table[i][0] - table[i - 1][0]);
      return table[i - 1][1] + share * (table[i][1] - table[i - 1][1]);
    }
    return table.back()[1];
  };
  double largest = std::max(at(values[0]), at(values[1]));
  for (const auto& [value, extinction] : table) {
    if (value > values[0] && value < values[1]) largest = std::max(largest, extinction);
  }
  return largest;
}

std::string all_masked(const std::string& field, const protocol::View& view, bool slice) {
  const bool part = view.region != protocol::RegionView{};
  return "every sample of " + quoted(field) + (slice ? " in the slice" : "") +
         (part ? " in the region" : "") + " is masked at step " + std::to_string(view.step) +
         (view.region.where.empty() ? "" : ", or left out by /region/where");
}

// Empty: values of the vectors do not explain it.
std::string why_no_lines(const scene::VectorLayer& layer, const protocol::View& view,
                         const data::Dataset& dataset, const std::optional<scene::Slice>& slice) {
  const std::string& field = view.vector.field.name;
  Span span = span_of(*layer.field, slice);
  if (layer.field_stride > 1) {  // what is held are the middles of kernels
    const auto all = dataset.seen(field, static_cast<std::size_t>(view.step));
    if (!all) return "";
    const bool masked = all->masked == static_cast<std::int64_t>(dataset.info().grid.samples());
    span = masked ? Span() : std::array{double{all->range[0]}, double{all->range[1]}};
  }
  if (!span) return all_masked(field, view, slice.has_value());
  const double largest = (*span)[1];
  if (!(largest > 0)) return "every vector of " + quoted(field) + " is zero";
  if (largest >= layer.min_magnitude) return "";
  return "the largest magnitude of " + quoted(field) + ", " + number(largest) +
         ", is below /vector/minMagnitude " + number(layer.min_magnitude);
}

std::string why_no_medium(const scene::ScalarLayer& layer, const std::string& field,
                          std::size_t index, const protocol::View& view,
                          const std::optional<scene::Slice>& slice) {
  const Span span = span_of(*layer.field, slice);
  if (!span) return all_masked(field, view, slice.has_value());
  if (largest_extinction(layer.extinction, *span) > 0) return "";
  return "/scalars/" + std::to_string(index) + "/extinction is 0 at every value of " +
         quoted(field) + ", " + number((*span)[0]) + " to " + number((*span)[1]);
}

std::string reasons(const scene::Scene& scene, const protocol::View& view,
                    const data::Dataset& dataset, const std::vector<std::string>& surfaces,
                    const engine::WorkReport& work) {
  if (!scene.vector && scene.scalars.empty() && scene.surfaces.empty()) {
    return "the view shows no field: neither lines of an opacity above 0 nor a medium of an "
           "extinction above 0";
  }
  std::vector<std::string> all;
  bool unexplained = false;
  const auto add = [&](std::string reason) {
    if (reason.empty()) {
      unexplained = true;
    } else {
      all.push_back(std::move(reason));
    }
  };
  // What is held of a part explains nothing of the whole.
  const bool part = scene.lattice.part.has_value();
  if (scene.vector) add(part ? "" : why_no_lines(*scene.vector, view, dataset, scene.slice));
  auto layer = scene.scalars.begin();
  for (std::size_t i = 0; i < view.scalars->size() && layer != scene.scalars.end(); ++i) {
    const protocol::ScalarView& scalar = (*view.scalars)[i];
    if (layer->extinction != scalar.extinction.value()) continue;
    add(part ? "" : why_no_medium(*layer, scalar.field, i, view, scene.slice));
    ++layer;
  }
  all.insert(all.end(), surfaces.begin(), surfaces.end());
  if (surfaces.size() < scene.surfaces.size()) unexplained = true;
  if (unexplained) {
    const bool seen = !work.variant.reference && work.culled < work.samples;
    all.emplace_back(seen ? "what lies in the picture is masked, or below a threshold of the view"
                          : "the camera does not show the data");
  }
  std::string text;
  for (const std::string& reason : all) text += (text.empty() ? "" : "; ") + reason;
  return text;
}

}  // namespace

std::string why_empty(const scene::Scene& scene, const protocol::View& view,
                      const data::Dataset& dataset, const std::vector<std::string>& surfaces,
                      const engine::WorkReport& work, bool transparent) {
  // The report does not count the pixels of surfaces: any triangle counts as drawn.
  const bool drawn = work.variant.reference                    ? !transparent
                     : scene.surfaces.size() > surfaces.size() ? true
                     : scene.body ? work.culled + work.skipped_both < work.samples
                                  : work.pixel_updates > 0;
  return drawn ? "" : reasons(scene, view, dataset, surfaces, work);
}

}  // namespace windsplat::frame
