// What each axis of a NRRD is for, and where its samples lie in the world.
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
  int world = -1;    // of a space axis 0 x, 1 y, 2 z; -1: by name and order
  std::string name;  // unique within the file
  std::string units;
  std::vector<double> coordinates;  // empty: placed by index
};

struct Placing {
  std::vector<PlacedAxis> axes;                     // parallel to the header's
  std::array<bool, 3> turned{false, false, false};  // world axes that the space names the other way
  std::vector<std::string> notes;
};

// Errors: bad_data as a plain sentence, without the file's name.
Result<Placing> place_axes(const Header& header);

}  // namespace windsplat::data::nrrd
