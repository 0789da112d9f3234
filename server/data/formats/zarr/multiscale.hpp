// The attribute `multiscales`: one image or field at several resolutions.
// https://ngff.openmicroscopy.org/0.5/
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/data/formats/zarr/json.hpp"

namespace windsplat::data::zarr {

struct ImageAxis {
  std::string name;
  bool is_space = false;
  bool is_time = false;
  std::string unit;
  double first = 0;  // position of the first sample
  double spacing = 1;
};

struct Multiscale {
  std::string finest;               // path of its array or group
  std::vector<std::string> levels;  // paths of all levels
  std::vector<ImageAxis> axes;      // slowest first; empty if not given
  bool placed = false;              // whether positions are given
};

// Of the attributes of a group; nullopt if it has no levels that can be read.
std::optional<Multiscale> multiscale_of(const Json& attributes);

}  // namespace windsplat::data::zarr
