// The built-in samples by name.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/model/source.hpp"

namespace windsplat::data {

// Built-in samples: computed on request and deterministic. name: tornado, climate or efield. dims
// {0,0,0} and steps 0 select the default size.
Result<std::unique_ptr<Source>> open_sample(const std::string& name,
                                            std::array<int, 3> dims = {0, 0, 0}, int steps = 0);
std::vector<std::string> sample_names();

// The name of a sample with an optional size: "tornado:256" is a cube, "climate:640x320x38" a box;
// without size {0,0,0}. nullopt: no sample has this name.
struct SizedSample {
  std::string name;
  std::array<int, 3> dims{};
};
std::optional<SizedSample> sized_sample(const std::string& text);

}  // namespace windsplat::data
