// A source of numbers in memory that is read by boxes, with a scalar and a wind.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/data/model/box.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::test {

inline data::DatasetInfo made_info(const std::array<int, 3>& dims, std::size_t steps = 1) {
  data::DatasetInfo info;
  info.source = "made";
  info.digest = "d1";
  constexpr std::array names{"x", "y", "z"};
  for (std::size_t a = 0; a < 3; ++a) {
    data::Axis& axis = info.grid.axes.at(a);
    axis.name = names.at(a);
    axis.coordinates.resize(static_cast<std::size_t>(dims.at(a)));
    std::iota(axis.coordinates.begin(), axis.coordinates.end(), 0.0);
  }
  data::FieldInfo scalar;
  scalar.name = "q";
  scalar.components = {"q"};
  data::FieldInfo wind;
  wind.name = "wind";
  wind.kind = data::FieldKind::vector;
  wind.components = {"u", "v", "w"};
  wind.component_units = {"m/s", "m/s", "m/s"};
  for (data::FieldInfo* field : {&scalar, &wind}) {
    field->box_chunk = {1, 1, 1};
    info.fields.push_back(*field);
  }
  for (std::size_t step = 0; step < steps; ++step) {
    info.steps.push_back({static_cast<double>(step), std::to_string(step)});
  }
  if (steps > 1) info.time_units = "hours since 2001-01-01";
  return info;
}

class MadeSource : public data::Source {
 public:
  explicit MadeSource(data::DatasetInfo info) : info_(std::move(info)) {}
  [[nodiscard]] const data::DatasetInfo& info() const override { return info_; }
  Result<data::Volume> read(std::size_t field, std::size_t step) override {
    return whole(info_, field, step);
  }
  Result<data::Volume> read_part(std::size_t field, std::size_t step,
                                 const data::StoredPart& part) override {
    // Made once for all pencils of a step: making it takes longer than they do.
    if (kept_of_ != std::pair{field, step}) {
      kept_ = whole(info_, field, step);
      kept_of_ = {field, step};
    }
    return cut(kept_, part.box);
  }

  // Noise, a tenth of it masked, and a corner of a few bricks.
  static data::Volume whole(const data::DatasetInfo& info, std::size_t field, std::size_t step) {
    data::Volume out;
    out.dims = info.grid.dims();
    out.components = static_cast<int>(info.fields[field].components.size());
    const std::size_t samples = out.samples();
    out.values = data::Samples(samples * info.fields[field].components.size());
    std::uint32_t state = static_cast<std::uint32_t>(17 * field + step + 1);
    for (std::size_t i = 0; i < samples; ++i) {
      const auto x = static_cast<int>(i % static_cast<std::size_t>(out.dims[0]));
      for (std::size_t c = 0; c < info.fields[field].components.size(); ++c) {
        state = state * 1664525U + 1013904223U;
        const bool masked = (c == 0 && state >> 28U == 0) || x < 70;
        out.values[c * samples + i] = masked ? std::numeric_limits<float>::quiet_NaN()
                                             : static_cast<float>(state >> 8U) * 1e-5F - 50;
      }
    }
    finish_volume(out);
    return out;
  }

 private:
  data::DatasetInfo info_;
  data::Volume kept_;
  std::optional<std::pair<std::size_t, std::size_t>> kept_of_;  // field and step
};

}  // namespace windsplat::test
