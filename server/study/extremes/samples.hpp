// Small datasets in memory for the extreme cases.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "server/data/model/dataset_info.hpp"
#include "server/data/resident/dataset.hpp"

namespace windsplat::study {

// The samples of a dataset, x fastest. Fields: scalar "density", vector "flow" (three components,
// one after the other), and scalar "height" unless it is empty.
struct Samples {
  data::Grid grid;
  std::vector<float> density;
  std::vector<float> flow;
  std::vector<float> height;
};

// Axes in metres whose samples lie `spacing` apart.
data::Grid box_grid(const std::array<int, 3>& dims, const std::array<double, 3>& spacing);
// Longitudes, latitudes (up to the poles if `poles`) and heights.
data::Grid globe_grid(const std::array<int, 3>& dims, bool poles);

// Smooth waves: a density from 0.2 to 1 and a flow with components from -1 to 1.
Samples waves(data::Grid grid);

std::shared_ptr<data::Dataset> make_dataset(Samples samples);

}  // namespace windsplat::study
