#include "server/data/cf/mesh/mesh_grid.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "server/data/cf/mesh/accuracy.hpp"

namespace windsplat::data::cf {

namespace {

std::string three_digits(double value) {
  std::array<char, 32> text{};
  const int length = std::snprintf(text.data(), text.size(), "%.3g", value);
  return {text.data(), static_cast<std::size_t>(std::max(length, 0))};
}

std::string percent(double part) { return three_digits(100 * part) + " %"; }

}  // namespace

Result<MeshGrid> MeshGrid::of(Mesh mesh, std::size_t samples_max) {
  MeshGrid out;
  out.mesh_ = std::make_unique<Mesh>(std::move(mesh));
  auto lattice = lattice_of(*out.mesh_, samples_max);
  if (!lattice) return lattice.error();
  out.lattice_ = *lattice;
  auto cells = find_cells(*out.mesh_, out.lattice_);
  if (!cells) return cells.error();
  out.cells_ = std::move(*cells);
  return out;
}

MeshWeights& MeshGrid::weights(MeshLocation location) {
  auto& made = weights_.at(location == MeshLocation::face ? 0 : 1);
  if (!made) made.emplace(*mesh_, lattice_, cells_.cells, location);
  return *made;
}

std::vector<std::string> MeshGrid::notes(const std::string& convention, MeshLocation most,
                                         bool by_positions) {
  std::vector<std::string> out;
  const std::string unit = mesh_->on_sphere ? " degrees" : "";
  std::string text =
      convention + ": a mesh of " + std::to_string(mesh_->cells()) +
      (by_positions ? " polygons" : " cells") + " is resampled onto a lattice of " +
      std::to_string(lattice_.x.count) + " x " + std::to_string(lattice_.y.count) + ", " +
      three_digits(lattice_.x.spacing) + " x " + three_digits(lattice_.y.spacing) + unit +
      " apart, with a median cell size of " + three_digits(lattice_.median_size) + unit + "; " +
      percent(static_cast<double>(cells_.hit) / static_cast<double>(mesh_->cells())) + " of the " +
      (by_positions ? "polygons" : "cells") + " contain a sample";
  const double error = error_of_wave(*mesh_, lattice_, weights(most), most);
  if (std::isfinite(error)) {
    text += "; waves " + three_digits(test_wave_cells) + " cells long at its " +
            (most == MeshLocation::face ? "cells"
             : by_positions             ? "positions"
                                        : "nodes") +
            " are drawn with an rms error of " + percent(error);
  }
  out.push_back(std::move(text));
  if (lattice_.is_coarse) {
    out.push_back("the lattice is coarser than half of the cells: it may not have more than " +
                  std::to_string(samples_per_cell_max) +
                  " samples for a cell, nor more than suit the size of the file");
  }
  if (lattice_.no_area > 0) {
    out.push_back("cells of the mesh without area are left out: " +
                  std::to_string(lattice_.no_area));
  }
  if (cells_.twice > cells_.inside / 1000) {
    out.push_back("cells of the mesh overlap: the first cell is drawn at " +
                  percent(static_cast<double>(cells_.twice) / static_cast<double>(cells_.inside)) +
                  " of the samples");
  }
  return out;
}

}  // namespace windsplat::data::cf
