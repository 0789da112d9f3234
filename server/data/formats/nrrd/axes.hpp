// Roles of the axes of a NRRD file, and the coordinates of their samples.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "server/base/error.hpp"
#include "server/data/formats/nrrd/header.hpp"

namespace windsplat::data::nrrd {

enum class Use { space, steps, components, single };

struct PlacedAxis {
  Use use = Use::space;
  int world = -1;    // world axis of a space axis: 0 x, 1 y, 2 z; -1: by name and order
  std::string name;  // unique within the file
  std::string units;
  std::vector<double> coordinates;  // empty: placed by index
};

struct Placing {
  std::vector<PlacedAxis> axes;                     // parallel to those of the header
  std::array<bool, 3> turned{false, false, false};  // world axes reversed by the space
  std::vector<std::string> notes;
};

// Errors: bad_data, without the file name in the message.
Result<Placing> place_axes(const Header& header);

}  // namespace windsplat::data::nrrd
