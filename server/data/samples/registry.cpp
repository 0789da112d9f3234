// Name and size of a sample -> Source; the list of built-in samples.
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <system_error>

#include "server/data/model/source.hpp"
#include "server/data/samples/samples.hpp"
#include "server/data/samples/source.hpp"

namespace windsplat::data {

namespace {

constexpr int dim_max = 4096;
constexpr std::int64_t samples_max = std::int64_t{1} << 28;  // 3 GiB per vector field
// Of samples that are computed by boxes, so that they need not fit in memory.
constexpr std::int64_t samples_by_boxes_max = std::int64_t{1} << 36;
constexpr int steps_max = 100000;

struct Sample {
  const char* name;
  SampleSize size;
  std::unique_ptr<Source> (*make)(const SampleSize&);
  std::int64_t samples_max = data::samples_max;
};

constexpr std::array<Sample, 3> samples = {{
    {"tornado", tornado_size, make_tornado, samples_by_boxes_max},
    {"climate", climate_size, make_climate},
    {"efield", efield_size, make_efield},
}};

Result<SampleSize> chosen_size(const Sample& sample, std::array<int, 3> dims, int steps) {
  const SampleSize& own = sample.size;
  SampleSize size = own;
  std::int64_t total = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (dims[a] < 0 || dims[a] > dim_max) {
      return make_error(ErrorKind::invalid, "the dimensions of a sample must be 1 to " +
                                                std::to_string(dim_max) + ", not " +
                                                std::to_string(dims[a]));
    }
    size.dims[a] = dims[a] == 0 ? own.dims[a] : dims[a];
    total *= size.dims[a];
  }
  if (total > sample.samples_max) {
    return make_error(ErrorKind::too_large, std::string("the sample ") + sample.name +
                                                " has at most " +
                                                std::to_string(sample.samples_max) +
                                                " grid points, not " + std::to_string(total));
  }
  if (steps < 0 || steps > steps_max) {
    return make_error(ErrorKind::invalid, "a sample must have 1 to " + std::to_string(steps_max) +
                                              " steps, not " + std::to_string(steps));
  }
  size.steps = steps == 0 ? own.steps : steps;
  return size;
}

// "64x32x16", or "64" for a cube; nullopt if malformed.
std::optional<std::array<int, 3>> parse_dims(std::string_view text) {
  std::array<int, 3> dims{};
  std::size_t count = 0;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (; count < dims.size(); ++count) {
    const auto [next, fault] = std::from_chars(at, end, dims.at(count));
    if (fault != std::errc() || dims.at(count) < 1) return std::nullopt;
    at = next;
    if (at == end) break;
    if (*at++ != 'x') return std::nullopt;
  }
  if (count == 0) return std::array{dims[0], dims[0], dims[0]};
  return count == 2 ? std::optional(dims) : std::nullopt;
}

const Sample* find_sample(std::string_view name) {
  const auto* found = std::find_if(samples.begin(), samples.end(),
                                   [&](const Sample& sample) { return name == sample.name; });
  return found == samples.end() ? nullptr : found;
}

}  // namespace

Result<std::unique_ptr<Source>> open_sample(const std::string& name, std::array<int, 3> dims,
                                            int steps) {
  const Sample* found = find_sample(name);
  if (found == nullptr) {
    return make_error(ErrorKind::not_found, "no built-in sample \"" + printable(name) + "\"");
  }
  auto size = chosen_size(*found, dims, steps);
  if (!size) return size.error();
  return found->make(*size);
}

std::optional<SizedSample> sized_sample(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (find_sample(text.substr(0, colon)) == nullptr) return std::nullopt;
  if (colon == std::string::npos) return SizedSample{text, {0, 0, 0}};
  const auto dims = parse_dims(std::string_view(text).substr(colon + 1));
  if (!dims) return std::nullopt;
  return SizedSample{text.substr(0, colon), *dims};
}

std::vector<std::string> sample_names() {
  std::vector<std::string> names;
  names.reserve(samples.size());
  for (const Sample& sample : samples) names.emplace_back(sample.name);
  return names;
}

}  // namespace windsplat::data
