// Small generated datasets of many kinds, on which the estimates of errors are fitted and judged,
// and a random sequence of views of each.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "protocol/view.hpp"
#include "server/data/resident/dataset.hpp"
#include "tests/numerics/trial_fields.hpp"

namespace windsplat::test {

// A member: turbulence of several spectra, noise, plumes, fronts, shells, sheets, vortices, layered
// atmospheres, oceans with masked land, needle and pancake grids.
struct FamilyMember {
  TrialField field;
  TrialFormula formula;
};
// Deterministic. `seed` selects other hashed values, for the members that have any.
std::vector<FamilyMember> family(std::uint32_t seed = 0);
// Kinds that are not in the family, to judge what was fitted to it.
std::vector<FamilyMember> strangers();

// A completed view of random scene (lines, a medium or both; their density, radii, lengths and
// thresholds) from a random viewpoint and size. Views with the same `scene` have the same scene
// signature; its content is lines, medium, both, lines, ... in turn.
protocol::View random_view(data::Dataset& dataset, std::uint32_t scene, std::uint32_t viewpoint,
                           int width_most = 800);

}  // namespace windsplat::test
